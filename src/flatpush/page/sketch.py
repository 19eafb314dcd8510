"""A path before it is timed and proved: what the page draws while something is dragged."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..contact import Placement
from ..geometry import compose, exp, transform
from ..planning import Planner
from ..planning.assembly import car_of
from ..planning.options import PushOption
from ..planning.path import Path
from ..planning.segments import fingertips
from ..planning.transits import PusherPath
from ..problem import Scene
from ..view import trace, words
from ..view.table import MM
from .plain import plain


@dataclass(frozen=True, eq=False)
class Sketch:
    """A path and the pusher's ways before, between and after its pushes.

    Attributes:
        path: whose pushes are numbers of the options; ways: one more than its stretches, from X_OE to X_OE.
    """

    scene: Scene
    options: Sequence[PushOption]
    path: Path
    ways: tuple[PusherPath, ...]

    @classmethod
    def of(cls, planner: Planner, path: Path) -> "Sketch | None":
        """None where a finger keeps its direction: it rolls along, and only the timed plan tells where it is.

        Raises:
            FlatpushError: if the pusher has no way between two pushes.
        """
        if not planner.scene.pusher.turns or not path.pieces:
            return None
        hands = [_placement(planner.usable[number]) for number in path.pushes]
        transits = planner.transits
        between = [transits.between(one, other) for one, other in pairwise(hands)]
        ways = (transits.landing(hands[0]), *between, transits.landing(hands[-1]).reversed())
        return cls(planner.scene, planner.usable, path, ways)

    def picture(self) -> dict[str, object]:
        """What picture() tells of the plan of this path, without its times and what is proved of it."""
        scene, path = self.scene, self.path
        stretches = path.stretches
        steps = np.array([path.step(*piece) for piece in path.pieces])
        reach = 0.5 * scene.object.outline.size
        x, y = scene.object.cof
        travels = np.hypot(steps[:, 0] - steps[:, 2] * y, steps[:, 1] + steps[:, 2] * x)
        travels += reach * np.abs(steps[:, 2])
        apart = trace.interval(reach, float(travels.sum()))
        samples = 1 + np.ceil(np.abs(steps[:, 2]) / trace.FLAT_STEP)
        # Where each outline and each point of the flat point's path is: pieces passed since the start of the path.
        marks, points, first = [], [], 0
        for _, word, *_ in stretches:
            some = np.arange(first, first + len(word) + 1)
            gone = np.concatenate([[0.0], np.cumsum(travels[some[:-1]])])
            count = max(1, round(float(gone[-1]) / apart))
            marks.append(np.interp(np.linspace(0.0, gone[-1], count + 1), gone, some))
            pieces = [k + np.arange(1, n + 1) / n for k, n in zip(some, samples[some[:-1]], strict=False)]
            points.append(np.concatenate([[float(first)], *pieces]))
            first += len(word)
        at = np.concatenate([*marks, *points])
        piece = np.clip(np.ceil(at) - 1, 0, len(steps) - 1).astype(int)
        poses = compose(path.poses[piece], exp((at - piece)[:, None] * steps[piece]))
        parts = np.split(poses, np.cumsum([len(some) for some in (*marks, *points)])[:-1])
        traces = []
        for (number, word, *_), ghosts, way in zip(
            stretches, parts[: len(stretches)], parts[len(stretches) :], strict=True
        ):
            option = self.options[number]
            car, push = car_of(option), option.push
            flat = 0.5 * (np.asarray(car.left_centre) + np.asarray(car.right_centre))
            tips = trace.fingertips(compose(ghosts, car.pusher), fingertips(push.fingers, push.spacing))
            traces.append({
                "name": push.name, "word": word, "slides": False,
                "ghosts": plain(ghosts * [MM, MM, 1.0], 4),
                "tips": plain(MM * tips.reshape(-1, 2), 2), "flat": plain(MM * transform(way, flat), 2),
            })  # fmt: skip
        corners = [path.start, *(end for *_, end in stretches)]
        ways = [compose(pose, way.poses) for pose, way in zip(corners, self.ways, strict=True)]
        return {
            "status": "solved", "sketch": True,
            "cost": words.cost_words(scene, path.cost),
            "traces": traces,
            "transits": [plain(MM * way[:, :2], 2) for way in ways],
            "goal": plain(corners[-1] * [MM, MM, 1.0], 3),
            "ends": [
                self._end(path.start, ways[0][0], self.ways[0].heights[0], stretches[0][0]),
                self._end(corners[-1], ways[-1][-1], self.ways[-1].heights[-1], stretches[-1][0]),
            ],
        }  # fmt: skip

    def _end(self, pose: np.ndarray, hand: np.ndarray, height: float, number: int) -> dict[str, object]:
        """Where object and pusher are before the first or after the last push."""
        push = self.options[number].push
        return {
            "object": plain(pose * [MM, MM, 1.0], 5),
            "pusher": plain(hand * [MM, MM, 1.0], 5),
            "height": round(MM * float(height), 2),
            "tips": plain(MM * fingertips(push.fingers, push.spacing), 4),
        }


def _placement(option: PushOption) -> Placement:
    assert option.placement is not None
    return option.placement
