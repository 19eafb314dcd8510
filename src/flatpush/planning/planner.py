"""Plans of one or many pushes for one object and goal, from any start."""

import time
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlatpushError
from ..geometry import pose_error
from ..geometry.pose import Array
from ..problem import Plan, Scene
from ..problem.frame import moved_inside
from ..simulation import certify
from ..steering.fleet import Fleet
from .answer import Answer
from .around import Around, Progress
from .assembly import Leg, Segments, assemble, car_of, costs, words_of
from .candidates import automatic_pushes
from .fleets import fleet_of
from .freedom import Freedom, freedom
from .obstacles import check_endpoints
from .options import PushOption, push_options
from .transits import Transits

# A round of the search counts as this many of the scene's iterations.
ROUND = 3300
# Rounds for each of many starts: more hardly lower the cost (benchmarks/many_starts.py).
ROUNDS_OF_MANY = 1


class Planner:
    """Builds once for an object, its pushes and a goal, and plans from many starts.

    Args:
        scene: its start is the default start of plan().
        progress: called among obstacles after every round of the search, some hundredths of a second, with the cost
            so far (infinite: none), the seconds since it began and the number of poses in its trees.

    Attributes:
        scene: with its pushes listed.
        options: the pushes as cars, or why they are none; left_out: automatic candidates that were dropped.
        freedom: whether the pushes move the object "free"-ly, by "detours", or not ("none").
        explored: after a search among obstacles, paths of the COF along edges of its tree, shape (m, k, 2) [m].

    >>> import flatpush as fp
    >>> thing = fp.Object([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)], "outline")
    >>> planner = fp.Planner(fp.Scene(thing, (0.06, 0.02, 2.6), pusher=fp.Pusher(fingers=2, spacing=0.018)))
    >>> [len(plan.pushes) <= 4 for plan in planner.plans([(0.06, 0.02, 2.6), (0.02, -0.03, 1.6)])]
    [True, True]
    """

    def __init__(self, scene: Scene, progress: Progress | None = None) -> None:
        self.left_out: tuple[PushOption, ...] = ()
        if scene.pushes == "auto":
            pushes, self.left_out = automatic_pushes(scene)
            scene = replace(scene, pushes=pushes or "auto")
        self.scene = scene
        self.options = () if scene.pushes == "auto" else push_options(scene)
        self.usable = tuple(option for option in self.options if option.car is not None)
        self._progress = progress
        self._around: Around | None = None

    @property
    def freedom(self) -> Freedom:
        return freedom([car_of(option) for option in self.usable])

    @property
    def reasons(self) -> dict[str, str]:
        """Why each refused push is refused."""
        return {o.push.name: o.refusal for o in (*self.left_out, *self.options) if o.car is None}

    def plan(self, start: ArrayLike | None = None) -> Plan:
        """The best plan found from a start pose X_WO (3,), by default the scene's.

        A start within the goal tolerance is a solved plan without a push. The plan keeps bounds and obstacles.
        """
        *_, best = self.answers(start)
        return best.plan()

    def plans(self, starts: Iterable[ArrayLike]) -> list[Plan]:
        """A plan from each start, after one round of the search each where nothing is in the way."""
        rounds = ROUNDS_OF_MANY * ROUND
        planning = replace(self.scene.planning, iterations=min(self.scene.planning.iterations, rounds))
        few = copy(self)
        few.scene = self.scene if _crowded(self.scene) else replace(self.scene, planning=planning)
        return [few.plan(start) for start in starts]

    def improving(self, start: ArrayLike | None = None) -> Iterator[Plan]:
        """Plans that get better, the first one at once; plan() is the last of them."""
        for answer in self.answers(start):
            yield answer.plan()

    def answers(self, start: ArrayLike | None = None) -> Iterator[Answer]:
        """Better and better answers, each as soon as it is found and certified only when its plan is called for.

        There is always one; where there is no plan, its cost is infinite. The search may be left at any answer.

        Raises:
            InputError: if the object cannot be at the start or at the goal, among what is in the way there.
        """
        began = time.perf_counter()
        scene = self.scene if start is None else replace(self.scene, start=start)
        if _crowded(scene):
            check_endpoints(scene)
        if np.all(np.abs(pose_error(scene.start, scene.goal)) <= scene.planning.goal_tolerance):
            yield Answer(0.0, partial(_solved, scene, (), began, {}))
            return
        if not self.usable:
            reason = f"no push can steer the object. {_listed(self.reasons)}"
            yield Answer(np.inf, partial(_none, scene, reason, began))
            return
        best = np.inf
        reasons, blocked = self.reasons, ""
        if _crowded(scene):
            self._around = Around(scene, self.usable, self.fleet, self.transits, self._progress)
            for cost, segments, found in self._around.answers(partial(self._unhindered, scene)):
                best = cost
                yield Answer(cost, partial(_solved, scene, segments, began, found), found)
            blocked = self._around.tried
        else:
            for cost, legs, found in self._candidates(scene):
                if cost >= best * (1 - 1e-12):
                    continue
                try:
                    segments = assemble(scene, self.transits, legs)
                except FlatpushError as error:
                    reasons.setdefault(legs[0].option.push.name, str(error))
                    continue
                best = cost
                yield Answer(cost, partial(_solved, scene, segments, began, found), found)
        if np.isinf(best):
            yield Answer(np.inf, partial(_none, scene, blocked + _listed(reasons), began))

    @property
    def explored(self) -> Array | None:
        return None if self._around is None else self._around.explored

    def _unhindered(self, scene: Scene) -> Iterator[Sequence[Leg]]:
        """What the search without obstacles finds: where it is clear of them there is nothing better."""
        for _, legs, _ in self._searched(scene, np.inf):
            yield legs

    def _candidates(self, scene: Scene) -> Iterator[tuple[float, Sequence[Leg], dict[str, Any]]]:
        """Ways with their costs: the cheapest single push, then what the search finds; all single ones if it is one."""
        singles = sorted(
            (
                (cost, i, k)
                for i, option in enumerate(self.usable)
                for k, cost in enumerate(costs(scene, option))
            ),
        )
        several = len(self.usable) > 1
        for cost, i, k in singles[:1] if several else singles:
            word = words_of(scene, self.usable[i])[k]
            leg = Leg(self.usable[i], word.word, word.parameters, scene.goal_pose)
            yield cost, (leg,), {"single_cost": singles[0][0]}
        if several:
            yield from self._searched(scene, singles[0][0])

    def _searched(self, scene: Scene, single: float) -> Iterator[tuple[float, Sequence[Leg], dict[str, Any]]]:
        from .refine import improvements

        planning = scene.planning
        search = improvements(
            self.fleet,
            scene.start_pose,
            scene.goal_pose,
            robust=planning.robust,
            seed=planning.seed,
        )
        clock = 0.0
        for done, refined in enumerate(search):
            found = {
                "single_cost": single,
                "cost_before_refinement": refined.cost_before,
                "replanning_cost": refined.replanning_cost,
                "rounds": done,
            }
            legs = [
                Leg(self.usable[int(a)], word, np.asarray(amounts), np.asarray(goal))
                for a, word, amounts, goal in zip(
                    refined.pushes, refined.words, refined.amounts, refined.poses[1:], strict=True
                )
            ]
            yield (refined.replanning_cost if planning.robust else refined.cost), legs, found
            if done == 1:
                # The first round is always finished, and what it compiles on first use is not the search's time.
                clock = time.perf_counter()
            late = done >= 1 and time.perf_counter() - clock > planning.time_limit
            if late or done >= max(1, planning.iterations // ROUND):
                return

    @cached_property
    def transits(self) -> Transits:
        return Transits(self.scene)

    @cached_property
    def fleet(self) -> Fleet:
        """The usable cars as arrays, with the switching costs, the transits' own included where they count."""
        return fleet_of(self.scene, self.usable, self.transits)


def plan(scene: Scene) -> Plan:
    """The best plan found for a scene, with its certificate; see Planner.

    An outline more than 100 of its sizes from its origin is moved there first: the plan's scene tells its poses.

    Returns:
        a Plan; where there is none, status "no_plan" and the reason of each push.
    """
    return Planner(moved_inside(scene)).plan()


def _crowded(scene: Scene) -> bool:
    return scene.workspace.bounds is not None or bool(scene.workspace.obstacles)


def _listed(reasons: dict[str, str]) -> str:
    return " · ".join(f"{name}: {reason}" for name, reason in reasons.items())


def _solved(scene: Scene, segments: Segments, began: float, found: dict[str, Any]) -> Plan:
    run = _run(began) | found
    certificate = certify(scene, segments)
    return Plan(
        "solved",
        scene,
        certificate.cost,
        certificate.duration,
        segments,
        certificate,
        run=run,
    )


def _none(scene: Scene, reason: str, began: float) -> Plan:
    return Plan("no_plan", scene, reason=reason, run=_run(began))


def _run(began: float) -> dict[str, Any]:
    from .. import __version__

    return {"version": __version__, "planning_time": time.perf_counter() - began}
