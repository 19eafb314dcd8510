"""The best plan of one push."""

import time
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from ..errors import FlatpushError, InputError
from ..geometry import pose_error
from ..problem import Certificate, Plan, PushSegment, Scene, TransitSegment
from ..simulation import certify, clearance_of
from ..steering.three_twist import words
from .candidates import automatic_pushes
from .options import PushOption, push_options
from .rolling import rolling_segment
from .segments import ArcGeometry, arc_duration, arcs_of, fingertips, landing, push_segment

Segments = tuple[PushSegment | TransitSegment, ...]


def plan(scene: Scene) -> Plan:
    """The best single push among those listed, or among the automatic candidates.

    A start within the goal tolerance is a solved plan without a push. The way is the cheapest of all words of all
    pushes whose object and fingers keep the clearance; finding a way around obstacles takes more than one push
    and is not tried.

    Returns:
        a Plan with its certificate; where there is none, status "no_plan" and the reason of each push.
    """
    began = time.perf_counter()
    if scene.planning.two_finger == "cone":
        raise InputError(
            "two_finger: cone, the true composite cone, is not available yet",
            key="planning.two_finger",
            value="cone",
            hint="Use middle, the virtual middle contact.",
        )
    scene, refused = _resolved(scene)
    if np.all(np.abs(pose_error(scene.start, scene.goal)) <= scene.planning.goal_tolerance):
        return _solved(scene, (), began)
    options = push_options(scene)
    refused = (*refused, *(o for o in options if o.car is None))
    reasons = {o.push.name: o.refusal for o in refused}
    ways = sorted(
        (
            (cost, i, k, arcs)
            for i, o in enumerate(options)
            if o.car
            for k, (cost, arcs) in enumerate(_ways(scene, o))
        ),
        key=lambda way: way[:3],
    )
    if not ways:
        return _none(scene, f"no push can steer the object. {_listed(reasons)}", began)
    tightest = -np.inf
    for _, i, _, arcs in ways:
        try:
            segments = _segments(scene, options[i], arcs)
        except FlatpushError as error:
            reasons.setdefault(options[i].push.name, str(error))
            continue
        clearance = clearance_of(scene, segments)
        if clearance is None or clearance >= scene.planning.clearance:
            return _solved(scene, segments, began)
        tightest = max(tightest, clearance)
    if np.isfinite(tightest):
        blocked = (
            f"each of the {len(ways)} ways of one push comes too near to an obstacle or the bounds: the best has"
            f" {1000 * tightest:.2f} mm of clearance and {1000 * scene.planning.clearance:.2f} mm are asked for. "
        )
        return _none(scene, blocked + _listed(reasons), began)
    return _none(scene, _listed(reasons), began)


def _resolved(scene: Scene) -> tuple[Scene, tuple[PushOption, ...]]:
    """The scene with its pushes listed."""
    if scene.pushes != "auto":
        return scene, ()
    pushes, refused = automatic_pushes(scene)
    return replace(scene, pushes=pushes), refused


def _ways(scene: Scene, option: PushOption) -> list[tuple[float, list[ArcGeometry]]]:
    """All words of a push with their costs."""
    car = option.car
    assert car is not None
    found = []
    for word in words(car.left_centre, car.right_centre, car.direction, scene.start_pose, scene.goal_pose):
        arcs = arcs_of(car, word.word, word.parameters, fingertips(option.push.fingers, option.push.spacing))
        if scene.planning.cost == "time":
            cost = sum(arc_duration(arc, scene.pusher) for arc in arcs)
        else:
            left, straight, right = car.weights(scene.planning.cost)
            each = {"L": left, "S": straight, "R": right}
            cost = sum(each[x] * float(p) for x, p in zip(word.word, word.parameters, strict=True))
        found.append((cost, arcs))
    return found


def _segments(scene: Scene, option: PushOption, arcs: list[ArcGeometry]) -> Segments:
    assert option.car is not None
    fingers = fingertips(option.push.fingers, option.push.spacing)
    if scene.pusher.turns:
        push = push_segment(scene, option.push.name, option.car, fingers, arcs, scene.start_pose)
    else:
        push = rolling_segment(scene, option, arcs)
    return (
        landing(scene.pusher, push.pusher[0]),
        push,
        landing(scene.pusher, push.pusher[-1], leaving=True),
    )


def _listed(reasons: dict[str, str]) -> str:
    return " · ".join(f"{name}: {reason}" for name, reason in reasons.items())


def _solved(scene: Scene, segments: Segments, began: float) -> Plan:
    certificate = certify(scene, segments)
    return Plan(
        "solved",
        scene,
        certificate["cost"],
        certificate["duration"],
        segments,
        Certificate(certificate),
        run=_run(began),
    )


def _none(scene: Scene, reason: str, began: float) -> Plan:
    return Plan("no_plan", scene, reason=reason, run=_run(began))


def _run(began: float) -> dict[str, object]:
    try:
        number = version("flatpush")
    except PackageNotFoundError:
        number = "unknown"
    return {"version": number, "planning_time": time.perf_counter() - began}
