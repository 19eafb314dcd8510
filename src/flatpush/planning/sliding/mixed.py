"""One slide, and from where it leaves the object a push that steers like a car to the goal."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...errors import FlatpushError
from ...geometry import compose, relative, wrap_angle
from ...problem import Scene
from ...steering.fleet import Fleet
from ...steering.lengths import fleet_lengths
from ..assembly import Segments, assemble, following
from ..empty_table import direct_paths
from ..options import PushOption
from ..transits import PusherPath, Transits
from .exact import SlidePlanner
from .timed import leaving, slide_segments

TRIED = 12  # slides, those first after which the rest costs least


def mixed_segments(
    scene: Scene,
    planner: SlidePlanner,
    options: Sequence[PushOption],
    fleet: Fleet,
    transits: Transits,
    below: float,
) -> Iterator[Segments]:
    """Segments of plans of a slide and a push, about the cheapest first, that promise to cost less than this.

    A car steers from any pose to any other, so that it makes up exactly for whatever slide went before. The way from
    the one to the other is a lifted one; there are none where the finger stays on the table or keeps its direction.

    Args:
        options: pushes that steer. fleet, transits: theirs.
        below: [m or s], in the unit of the scene's cost.
    """
    slides, goal = planner.slides, np.tile(scene.goal_pose, (fleet.size, 1))
    after = compose(scene.start_pose, slides.displacement)
    costs = slides.length + planner.switch_cost + fleet_lengths(fleet, after, scene.goal_pose).min(axis=0)
    for k in np.argsort(costs, kind="stable")[:TRIED].tolist():
        if costs[k] >= below:
            return
        made = planner.made(scene.start_pose, (k,))
        if made is None:
            continue
        pose = made[0].object[-1]
        rest = replace(scene, start=pose)
        try:
            path = direct_paths(fleet, pose, goal)[0]
            pushed = assemble(rest, transits, options, path)
            first = options[path.pushes[0]].placement
            assert first is not None
            down = transits.landing(first)
        except FlatpushError:
            continue
        segments = list(slide_segments(scene, made)[:-1])
        up, heights = leaving(scene, pose, segments[-1].pusher[-1])
        up = relative(pose, up)
        turn = down.poses[0, 2] - up[-1, 2]
        onto = down.poses + np.array([0.0, 0.0, wrap_angle(turn) - turn])
        way = PusherPath(np.concatenate([up, onto]), np.concatenate([heights, down.heights]), down.reach)
        segments.append(following(way.segment(scene.pusher, pose), segments[-1]))
        for segment in pushed[1:]:
            segments.append(following(segment, segments[-1]))
        yield tuple(segments)
