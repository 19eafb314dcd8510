"""Plans made by hand, to be drawn."""

import numpy as np

from flatpush.geometry import Outline, compose, exp
from flatpush.problem import (
    Arc,
    CarCentres,
    Certificate,
    Object,
    Plan,
    Push,
    Pusher,
    PushSegment,
    Rollout,
    Scene,
    TransitSegment,
    Workspace,
)
from flatpush.view.timeline import Timeline

TRIANGLE = 1e-3 * np.array([[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]])


LEFT, RIGHT = (
    np.array([-0.125, 0.0375]),
    np.array([0.125, 0.0375]),
)  # turning centres of a push along +y, in O


SPEED = 0.02


def about(centre, turn):
    """A body twist in O about a centre; + counter-clockwise; the flat point moves with SPEED."""
    w = turn * SPEED / 0.125
    return np.array([w * centre[1], -w * centre[0], w])


ARCS = {"left": about(LEFT, 1), "right": about(RIGHT, -1), "straight": np.array([0.0, SPEED, 0.0])}


def one_push(start, turns=("left", "straight", "right"), name="long edge"):
    """A push along +y of O that spends three seconds on each turn."""
    times, poses, arcs = [0.0], [np.asarray(start, dtype=float)], []
    for turn in turns:
        arcs.append(Arc(turn, ARCS[turn], 3.0, 3.0 * SPEED))
        begin = poses[-1]
        for s in np.arange(1, 31) / 30:
            times.append(3.0 * (len(arcs) - 1 + s))
            poses.append(compose(begin, exp(3.0 * s * ARCS[turn])))
    objects = np.array(poses)
    pusher = compose(objects, [0.0, -0.012, np.pi / 2])
    tips = np.array([[0.0, 0.009], [0.0, -0.009]])
    word = "".join(turn[0].upper() for turn in turns)
    return PushSegment(name, word, tuple(arcs), np.array(times), objects, pusher, tips)


def transit(start, end, lifted=0.0):
    times = np.array([0.0, 0.5, 1.0])
    return TransitSegment(times, np.array([start, end, end]), np.array([0.0, lifted, 0.0]))


def make_plan(
    turns=("left", "straight", "right"), pushes=1, cars=True, name="triangle", push="long edge", **workspace
):
    thing = Object(Outline.polygon(TRIANGLE), "uniform", 0.3, name=name)
    at = thing.outline.nearest((0.0, -0.0095))
    start = [0.05, -0.15, 0.4]
    segments, pose = [], np.array(start)
    for _ in range(pushes):
        segment = one_push(pose, turns, push)
        before = compose(segment.pusher[0], [-0.01, 0.0, 0.0])
        after = compose(segment.pusher[-1], [-0.01, 0.0, 0.0])
        came = segments[-1].pusher[-1] if segments else before
        segments += [transit(came, before, 0.03 if segments else 0.0), transit(before, segment.pusher[0])]
        segments += [segment, transit(segment.pusher[-1], after)]
        pose = segment.object[-1]
    scene = Scene(
        thing,
        start,
        pose,
        Pusher(fingers=2, spacing=0.018),
        (Push(push, at, 2, 0.018),),
        Workspace(**workspace),
    )
    car = {push: CarCentres(tuple(LEFT), tuple(RIGHT), (0.0, 1.0))}
    duration = float(sum(s.times[-1] for s in segments))
    certificate = Certificate((0.0, 0.0, 0.0), 0.18 * pushes, duration, cars=car if cars else {})
    return Plan("solved", scene, 0.18 * pushes, duration, tuple(segments), certificate)


def follow(plan):
    """A rollout that does what the plan says."""
    line = Timeline.of(plan)
    modes = ("sticking",) * len(line.times)
    return Rollout(line.object[-1], line.times, line.object, line.pusher, modes, "completed")


def boxes_overlap(a, b):
    return min(a[2], b[2]) > max(a[0], b[0]) and min(a[3], b[3]) > max(a[1], b[1])
