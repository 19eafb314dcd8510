"""Where the object may be, from wherever in a region it starts: the tube of a plan for two fingers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..contact.landing import Landing, Side, StartRegion, carried
from ..errors import InputError
from ..geometry import compose, rotate
from ..problem import PushSegment, Scene, Segment
from ..problem.certificate import Certificate, TubePart
from ..problem.mechanics import first_landing, named, placement_of, side_of
from .clearance import clearance_of, object_distances

# Poses along a landing, and angles of a start region, at which distances are taken; what lies between is bounded.
STEPS, ANGLES = 64, 33
# Lengths that a plan keeps to within this are kept [m].
EXACT = 1e-9


def tube_of(scene: Scene, segments: Sequence[Segment]) -> tuple[TubePart, ...] | None:
    """The tube of a plan, a part for each push; None where the scene states no start region.

    Each push has to begin straight, until both fingers hold the object for every start (see contact.landing).

    Raises:
        InputError: for a plan of which that cannot be said: the push and what it lacks.
    """
    known = scene.object.uncertainty
    pushes = [s for s in segments if isinstance(s, PushSegment)]
    if known is None or known.start is None or not pushes:
        return None
    if any(len(push.fingers) != 2 for push in pushes) or len(pushes) < sum(
        s.kind != "transit" for s in segments
    ):
        raise InputError("one finger does not make up for a start that is off")
    parts: list[TubePart] = []
    before: Side | None = None
    offset = 0.0
    for number, push in enumerate(pushes, 1):
        with _told(f"push {number} ({push.push})"):
            side = side_of(scene, placement_of(scene, named(scene, push.push)))
            first = push.arcs[0]
            way = first.duration * first.twist[:2] * (first.turn == "straight")
            tilt, straight = side.tilt(way), float(np.hypot(*way))
            if before is None:
                found, off = first_landing(scene, side, tilt), known.start.moves(side.reach)
            else:
                found, off = carried(side, before.along, offset, tilt), offset
            found = replace(found, offset=found.offset + known.offset, wander=found.wander + known.offset)
            check_landing(side, found, off)
            if found.travel > straight + EXACT:
                raise InputError(
                    f"goes straight for {1000 * straight:.2f} mm, and both fingers hold the object for every start only"
                    f" after {1000 * found.travel:.2f} mm"
                )
            clearance = _clearance(scene, push, side, found, offset if before else known.start)
        before, offset = side, found.offset
        x, y = offset * np.abs(rotate(push.object[-1, 2], side.along))
        parts.append(TubePart(push.push, found.gap, found.travel, offset, (float(x), float(y)), clearance))
    return tuple(parts)


def tube_excess(scene: Scene, certificate: Certificate) -> float:
    """How far from the goal the object may end, as a share of the goal's tolerance; within it up to 1."""
    box = np.zeros(3)
    if certificate.tube:
        box[:2] = certificate.tube[-1].end
    elif scene.object.uncertainty is not None and (region := scene.object.uncertainty.start) is not None:
        box[:] = region.position, region.position, region.angle  # it stays where it starts
    tolerance = np.array(scene.planning.goal_tolerance)
    return float(np.max((np.abs(certificate.goal_error) + box) / tolerance))


def check_landing(side: Side, found: Landing, off: float) -> None:
    """Whether fingers land clear of an object that may be off by so much there [m], and stay on their side.

    Raises:
        InputError: where they do not.
    """
    if off > side.beside + EXACT:
        raise InputError(
            f"a finger passes another side of the object at {1000 * side.beside:.2f} mm, which may be off by"
            f" {1000 * off:.2f} mm there",
            hint="A push further from corners that point inwards, or a smaller region, would do.",
        )
    if off > side.back + EXACT:
        raise InputError(
            f"the fingers land {1000 * side.back:.2f} mm off the object, which may be off by {1000 * off:.2f} mm there",
            hint=f"pusher: {{approach: …}} of {1000 * (off - side.back):.2f} mm more would do.",
        )
    beside = max(found.offset, found.wander)
    if beside > side.room + EXACT:
        raise InputError(
            f"a finger is {1000 * side.room:.2f} mm from the end of its side, and may be off by {1000 * beside:.2f} mm"
            " along it",
            hint="A push nearer to the middle of a longer side, or a smaller region, would do.",
        )


def region_clearance(scene: Scene, region: StartRegion) -> float | None:
    """The least clearance of the object alone, anywhere in a region about the start [m]; None with nothing around."""
    distances = object_distances(scene)
    if distances is None:
        return None
    turns = np.linspace(-region.angle, region.angle, ANGLES)
    poses = scene.start_pose + turns[:, None] * [0.0, 0.0, 1.0]
    between = scene.object.outline.radius_about((0.0, 0.0)) * region.angle / (ANGLES - 1)
    return float(np.min(distances(poses))) - region.position - between


def _clearance(
    scene: Scene, push: PushSegment, side: Side, found: Landing, entry: StartRegion | float
) -> float | None:
    """What a push keeps from obstacles and bounds, the object being anywhere in its part of the tube [m]."""
    here = replace(scene, start=push.object[0])
    whole = clearance_of(here, [push])
    distances = object_distances(scene)
    if whole is None or distances is None:
        return None
    room = whole - found.offset
    if isinstance(entry, StartRegion):
        start = region_clearance(here, entry)
        assert start is not None
        # The outline turns about a finger that touches it.
        middle = 0.5 * sum(side.fingers) * side.along - side.depth * side.normal
        spread = 0.5 * abs(side.fingers[0] - side.fingers[1]) + found.wander
        reach = scene.object.outline.radius_about(middle) + spread
        off = float(np.hypot(found.gap, found.wander)) + entry.angle * reach
        room = min(room, start)
    else:
        off = max(entry, found.offset)
    way = push.arcs[0].twist[:2] / np.hypot(*push.arcs[0].twist[:2])
    ways = np.linspace(0.0, found.travel, STEPS)[:, None] * way
    poses = compose(push.object[0], np.column_stack([ways, np.zeros(STEPS)]))
    return min(room, float(np.min(distances(poses))) - off - 0.5 * found.travel / (STEPS - 1))


class _told:
    """Says of which push a refusal speaks."""

    def __init__(self, what: str) -> None:
        self.what = what

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, InputError):
            raise InputError(
                f"{self.what}: {error.rule}", key=error.key, value=error.value, hint=error.hint
            ) from None
