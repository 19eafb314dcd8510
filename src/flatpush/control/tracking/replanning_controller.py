"""Two fingers to a goal, by as many landings as it takes: plans anew from where the object is, push by push."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from ...errors import InputError
from ...geometry import compose, log, pose_error, relative
from ...geometry.pose import Array
from ...planning import Planner
from ...planning.assembly import assemble
from ...planning.path import Path
from ...planning.query import Query
from ...problem import Plan, Scene
from ..horizon.landings import free_path
from ..horizon.surroundings import GUARD, RoomyPath, Surroundings, Thoughts, crowded
from ..loop.controller import ARRIVED, AbstractController, ControllerState
from ..loop.frames import hand, mean_pose
from ..loop.limits import Limits
from ..loop.measurement import Command, Measurement
from .carried import CarriedState
from .plan_controller import BRAKE, FRAMES, LOOK, Looking, PlanController, PlanState, Pushing, Travelling

# The share of the tolerance that the mean of a look has to keep.
GOAL_SHARE = 0.85
# It looks so often where no plan is found, before it gives up.
LOOKS = 3
# An object that has turned in the hand by more than this has slipped [rad]. Along the line of the fingers it has when
# it moved by more than the part of their spacing that the plan keeps in reserve at each side.
TURNED = float(np.deg2rad(2.0))


@dataclass(frozen=True, eq=False)
class ReplanningState(ControllerState):
    """Of ReplanningController.

    Attributes:
        looking: at the object at rest. inner, below: what runs the push, and its state; None while it looks.
        margin: beyond the clearance that the plan of this push keeps [m].
        thoughts, thought: of where to land next, and how many parts of that are done.
        landings: how many there were; stuck: how often no plan was found since the last; slips, stopped: how many
            pushes ended because the object slipped in the hand, or something was too near.
    """

    looking: Looking = field(default_factory=lambda: Looking(-np.inf))
    inner: PlanController | None = None
    below: PlanState | None = None
    margin: float = 0.0
    landings: int = 0
    thoughts: Thoughts[RoomyPath | str] | None = None
    thought: int = 0
    stuck: int = 0
    slips: int = 0
    stopped: int = 0


@dataclass(frozen=True, eq=False)
class ReplanningController(AbstractController[ReplanningState]):
    """Brings an object that two fingers hold to its goal. Build with ReplanningController.of.

    It looks at the object at rest, plans from there, lands and runs the first push of the plan under feedback; then it
    looks again. A push ends where the object has slipped in the hand by more than the plan has in reserve, or where
    something is too near.

    Attributes:
        planner: of the scene's pushes. rate: of the ticks [Hz].
        tolerance: it arrives within this distance [m] and angle [rad] of the goal.
        landings: their number is at most this.
        surroundings: what is kept clear of; None where nothing is in the way.
        limits, stale, noise: see AbstractController.
    """

    planner: Planner
    tolerance: tuple[float, float]
    limits: Limits
    rate: float = 60.0
    landings: int = 12
    stale: float = 0.6
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    @classmethod
    def of(
        cls,
        plan: Plan | Scene,
        rate: float = 60.0,
        latency: float = 0.1,
        *,
        tolerance: tuple[float, float] = (0.001, float(np.deg2rad(1.0))),
        landings: int = 12,
        sd: tuple[float, float] = (0.0003, float(np.deg2rad(0.3))),
    ) -> "ReplanningController":
        """The controller for the scene of a plan: its object, goal and pushes.

        Args:
            latency: of the camera that is expected [s]. sd: of a frame's position and angle [m, rad].
            rate, tolerance, landings: see the attributes.

        Raises:
            InputError: for other than two fingers, no push that can be steered, or what surroundings.crowded refuses.
        """
        scene = plan.scene if isinstance(plan, Plan) else plan
        if scene.pusher.fingers != 2:
            raise InputError("this controller carries the object with two fingers", key="pusher.fingers")
        if not all(np.isfinite(t) and t > 0 for t in tolerance):
            raise InputError(
                "a tolerance is a distance and an angle, both positive", key="tolerance", value=tolerance
            )
        known = scene.object.uncertainty
        if known is not None and known.start is not None:  # it is looked at where it starts
            scene = replace(scene, object=replace(scene.object, uncertainty=replace(known, start=None)))
        crowded(scene)  # refuses what is not done among things
        planner = Planner(scene)
        if not planner.usable:
            reasons = "; ".join(f"{name}: {why}" for name, why in planner.reasons.items())
            raise InputError(f"no push of this scene can be steered. {reasons}")
        place = planner.usable[0].placement
        assert place is not None
        tips = np.array([relative(place.pose, [*tip, 0.0])[:2] for tip in place.tips])
        limits = Limits.of(scene.pusher, tips, scene.object.outline.size)
        return cls(planner, tolerance, limits, rate, landings, 0.5 + latency, sd)

    def with_yaws(self, yaws: tuple[float, float], alike: tuple[float, ...]) -> Self:
        return replace(self, limits=replace(self.limits, yaws=yaws, alike=alike))

    @property
    def scene(self) -> Scene:
        """The scene with its pushes listed."""
        return self.planner.scene

    @cached_property
    def surroundings(self) -> Surroundings | None:
        return Surroundings(self.scene, self.planner.usable) if crowded(self.scene) else None

    def start(self, time: float = 0.0) -> ReplanningState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return ReplanningState(looking=Looking(time))

    def noticed(self, state: ReplanningState, frame: Measurement) -> ReplanningState:
        if state.inner is not None and state.below is not None:
            below = state.inner.noticed(replace(state.below, seen=state.seen), frame)
            return replace(state, below=below)
        looking = state.looking
        if frame.time < looking.since - 1e-9:
            return state
        first = looking.first if looking.poses else frame.time
        poses = (*looking.poses, np.asarray(frame.object, dtype=float))
        return replace(state, looking=replace(looking, poses=poses, first=first))

    def act(self, state: ReplanningState, time: float) -> tuple[ReplanningState, Command]:
        if state.inner is not None and state.below is not None:
            return self._follow(state, state.inner, state.below, time)
        if state.thoughts is not None:
            return self._think(state, state.thoughts, time)
        looking, frame = state.looking, state.seen.frame
        assert frame is not None
        state = replace(state, mode="looking", note="")
        if len(looking.poses) < FRAMES or frame.time - looking.first < LOOK:
            return state, self._standing(state)
        pose = mean_pose(looking.poses)
        error = self.scene.goal_error(pose)
        off = float(np.hypot(error[0], error[1])), abs(float(error[2]))
        inside = max(off[0] / self.tolerance[0], off[1] / self.tolerance[1])
        text = f"{1000 * off[0]:.2f} mm and {np.rad2deg(off[1]):.2f}° off the goal"
        if inside <= GOAL_SHARE:
            return replace(state, mode="done", note=text, outcome=ARRIVED), self._standing(state)
        if state.landings >= self.landings:
            why = ARRIVED if inside <= 1 else f"still {text} after {state.landings} landings"
            return replace(state, mode="done", note=text, outcome=why), self._standing(state)
        thoughts: Thoughts[RoomyPath | str] = Thoughts(self._ways(pose, state.landings + LOOKS * state.stuck))
        return self._think(replace(state, thoughts=thoughts, thought=0, note=text), thoughts, time)

    def _ways(self, pose: Array, seed: int) -> Iterator[RoomyPath | str | None]:
        """In parts, the path from X_WO to the goal, and the margin that it keeps; or why there is none."""
        goal, fleet = self.scene.goal_pose, self.planner.fleet
        if self.surroundings is not None:
            return self.surroundings.paths(fleet, self.planner.usable, pose, goal, seed)
        query = Query(fleet, pose, np.nan_to_num(goal), free=bool(np.isnan(goal[2])))
        return iter([RoomyPath(free_path(query, seed), 0.0)])

    def _think(
        self, state: ReplanningState, thoughts: Thoughts[RoomyPath | str], time: float
    ) -> tuple[ReplanningState, Command]:
        """A tick's part of the search for a path; then to the first push of what was found.

        It looks again, a few times, where there is none.
        """
        found, text = thoughts.part(state.thought), state.note
        if found is None:
            return replace(state, thought=state.thought + 1), self._standing(state)
        state = replace(state, thoughts=None)
        if isinstance(found, str):
            if state.stuck + 1 >= LOOKS:
                return replace(state, mode="done", outcome=f"stopped, {text}: {found}"), self._standing(state)
            again = replace(state, stuck=state.stuck + 1, looking=Looking(time), note=found)
            return again, self._standing(state)
        path, begin = found.path, found.path.start
        count = next((i for i, p in enumerate(path.pieces) if p[0] != path.pieces[0][0]), len(path.pieces))
        first = Path.of(path.fleet, begin, path.pieces[:count])
        scene = replace(self.scene, start=begin)
        segments = assemble(scene, self.planner.transits, self.planner.usable, first)
        plan = Plan("solved", scene, first.cost, segments=segments)
        inner = PlanController.of(
            plan, "path", self.rate, sd=self.noise, stale=self.stale, tolerance=self.tolerance
        ).with_yaws(self.limits.yaws, self.limits.alike)
        # It has been looked at: the push begins with a landing.
        below = replace(inner.start(time), phase=state.looking, turned=state.turned)
        landing = state.landings + 1
        state = replace(state, inner=inner, below=below, margin=found.margin, landings=landing, stuck=0)
        state, command = self._follow(state, inner, below, time)
        return replace(state, note=f"landing {landing} at {plan.pushes[0].push}, {text}"), command

    def _follow(
        self, state: ReplanningState, inner: PlanController, below: PlanState, time: float
    ) -> tuple[ReplanningState, Command]:
        """On with the push, and with what leads to it and away from it."""
        below, command = inner.act(replace(below, seen=state.seen), time)
        state = replace(state, seen=below.seen, turned=below.turned)
        why, slips, stopped = below.outcome, state.slips, state.stopped
        if isinstance(below.phase, Pushing) and not why:
            if self._slipped(inner, below.phase):
                why, slips = "the object slipped in the hand", slips + 1
            elif not self._free(state, inner, below.phase, command, time):
                why, stopped = "the push would come too near to something", stopped + 1
        if why and below.push == 0 and not isinstance(below.phase, Looking):
            back = Travelling(self._back(state, time), False)
            below, command = inner.act(replace(below, seen=state.seen, push=1, phase=back, outcome=""), time)
            below = replace(below, note=why)
        if below.push == 1 and isinstance(below.phase, Looking):
            looking = replace(state, mode="looking", note="", looking=Looking(time), inner=None, below=None)
            return replace(looking, slips=slips, stopped=stopped), self._standing(state)
        return replace(
            state, mode=below.mode, note=below.note, below=below, slips=slips, stopped=stopped
        ), command

    def _slipped(self, inner: PlanController, phase: Pushing) -> bool:
        """Whether the object is elsewhere in the hand than planned, by more than the plan has in reserve."""
        carried = phase.inner
        if not isinstance(carried, CarriedState):
            return False
        planned = relative(inner.inner[0].model.pusher, np.zeros(3))
        spacing = float(np.ptp(self.limits.tips[:, 1]))
        most = 0.5 * max(self.scene.planning.friction_margin, 0.1) * spacing
        moved = pose_error(carried.late, planned)
        # Turns are about the hand: where it turned, the object's origin has moved by as much as it is away.
        return abs(float(moved[2])) > TURNED or float(math.hypot(*moved[:2])) > most + TURNED * float(
            np.hypot(*planned[:2])
        )

    def _free(
        self, state: ReplanningState, inner: PlanController, phase: Pushing, command: Command, time: float
    ) -> bool:
        """Whether object and fingers stay clear until the hand comes to rest, if it goes on as commanded."""
        carried = phase.inner
        if self.surroundings is None or not isinstance(carried, CarriedState):
            return True
        assert state.seen.frame is not None
        speed = float(np.hypot(*command.velocity[:2]))
        rests = 1 / self.rate + 0.5 * speed / (BRAKE * self.scene.pusher.acceleration)
        here = hand(state.seen.frame, state.seen.told, time)
        there = here + rests * command.velocity
        pose = compose(here, carried.touching)
        twist = log(relative(pose, compose(there, carried.touching)))
        tips = np.array([relative(carried.touching, [*tip, 0.0])[:2] for tip in self.limits.tips])
        return self.surroundings.free(tips, pose, twist, GUARD * state.margin)

    def _back(self, state: ReplanningState, time: float) -> tuple[Array, ...]:
        """Stops that lead away from the object: straight back, as far as is free, and up among things."""
        assert state.seen.frame is not None
        here, pusher = hand(state.seen.frame, state.seen.told, time), self.scene.pusher
        if self.surroundings is None:
            return (np.array([*compose(here, [-pusher.approach, 0.0, 0.0]), 0.0]),)
        away = self.surroundings.back(here, float(here[2]), self.limits.tips)
        return np.array([*away, 0.0]), np.array([*away, pusher.lift])
