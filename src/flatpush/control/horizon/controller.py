"""Receding horizon: at every tick the contact that is seen, its car, and the rest of the path planned anew."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...errors import FlatpushError, InputError
from ...geometry import compose, pose_error, relative
from ...geometry.pose import Array
from ...planning import Planner
from ...problem import Plan, Scene
from ..laws.formulas import RAMP, point_velocity, wrapped
from ..laws.push_controller import pusher_velocity
from ..laws.rest_of_path import Rest, rest_of_path
from ..learning.friction_bounds import FrictionBounds
from ..loop.controller import ARRIVED, AbstractController
from ..loop.frames import hand, mean_pose, predicted
from ..loop.limits import Limits, braking
from ..loop.measurement import Command, Measurement
from .contact_car import ContactCar
from .contact_observer import LOST, ContactObserver, nearest_contact
from .landings import Landing, next_push
from .push_knowledge import Steering, shared, steering_of
from .push_path import PushPath
from .state import HorizonState, LearningWindow
from .surroundings import GUARD, Surroundings, Thoughts, crowded, way_over

# Plans leave this share of the friction cone, feedback may use more of it (contact_observer.EDGE); both cover
# friction that is a fifth less than believed.
RESERVE = 0.4
# The share of the acceleration that is planned with for coming to rest.
BRAKE = 0.6
# Frames averaged over an object at rest.
FRAMES = 10
# The share of the tolerance that an average of these frames has to keep.
GOAL_SHARE = 0.85
# A finger that had lost the edge has it again when it is as near as this [m].
REGAINED = 0.0001
# Where the car of a contact that slipped turns so much less tightly than where it landed, another landing is better;
# where what was learned makes it so much worse than was believed, another push.
WORSE = 2.5
# Contacts are found again so often in one push before another landing is tried.
RESUMES = 5
# Pushes that failed so often are left out, and those whose straight force lies nearer to the edge of the friction cone
# than this share of its half angle.
FAILURES, LEEWAY = 3, 0.15
# Among things the last stretch of the last push, so many radii long, is planned anew at every tick. Before it the
# finger keeps to its path; a push ends that is off it by so many radii, or by so much of its heading [rad].
LAST, ASTRAY, SKEWED = 1.5, 0.5, 0.7
# So often it looks where no path is found, before it gives up.
LOOKS = 3
# What another landing counts as at least: each begins with the errors of a look at the object [m].
SWITCHING = 0.03


@dataclass(frozen=True, eq=False)
class HorizonController(AbstractController[HorizonState]):
    """Brings an object to its goal with one finger and any number of landings. Build with HorizonController.of.

    While the pusher rests beside the object, frames are averaged and the multi-push planner plans from there. It lands
    at the first push of that plan. During the push every tick finds the contact where it now is, makes the car of it,
    plans the rest of the push anew, and does its first part. Then it looks again.

    Attributes:
        scene: with one finger, and the reserve as friction margin.
        rate: of the ticks [Hz].
        tolerance: it arrives within this distance [m] and angle [rad] of the goal.
        landings: their number is at most this, then it gives up and says how far off it is.
        learn: whether the steering is learned while the finger sticks.
        body, stale, noise: see AbstractController.
        sd: standard deviation of a frame's angle [rad], for learning.
        surroundings: what paths, landings and retreats keep clear of; None where nothing is in the way.

    Raises:
        InputError: for a rate, tolerance or number of landings that is not positive.
    """

    scene: Scene
    planner: Planner
    prior: tuple[Steering, ...]
    rate: float = 60.0
    tolerance: tuple[float, float] = (0.002, float(np.deg2rad(2.0)))
    landings: int = 25
    learn: bool = True
    body: str = ""
    stale: float = 0.5
    sd: float = float(np.deg2rad(0.3))
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))
    surroundings: Surroundings | None = None

    @cached_property
    def limits(self) -> Limits:  # type: ignore[override]
        return Limits.of(self.scene.pusher, np.zeros((1, 2)), self.scene.object.outline.size)

    def __post_init__(self) -> None:
        for name in ("rate", "stale", "sd"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError("a positive, finite number is needed", key=name, value=value)
        if self.landings < 1:
            raise InputError("there is at least one landing", key="landings", value=self.landings)
        if len(self.tolerance) != 2 or not all(np.isfinite(t) and t > 0 for t in self.tolerance):
            raise InputError(
                "a tolerance is a distance and an angle, both positive", key="tolerance", value=self.tolerance
            )

    @classmethod
    def of(
        cls,
        plan: Plan | Scene,
        rate: float = 60.0,
        latency: float = 0.1,
        learn: bool = True,
        *,
        tolerance: tuple[float, float] = (0.002, float(np.deg2rad(2.0))),
        landings: int = 25,
        body: str = "",
        stale: float | None = None,
    ) -> "HorizonController":
        """The controller for the scene of a plan: its object, goal and pushes.

        Args:
            plan: a plan, or its scene; its own path does not matter, since it is planned anew from what is seen.
            latency: of the camera that is expected [s]; frames older than this and half a second, or than `stale` [s],
                stop the pusher.
            rate, tolerance, landings, body: see the attributes.

        Raises:
            InputError: for two fingers, no push that steers, or what surroundings.crowded refuses.
        """
        scene = plan.scene if isinstance(plan, Plan) else plan
        if not (np.isfinite(latency) and latency >= 0):
            raise InputError("a latency is 0 or more", key="latency", value=latency)
        among = crowded(scene)
        if scene.pusher.fingers != 1:
            raise InputError(
                "the horizon controller steers with one finger",
                value=scene.pusher.fingers,
                hint="ReplanningController is that of two.",
            )
        planning = replace(
            scene.planning, friction_margin=max(RESERVE, scene.planning.friction_margin), iterations=1
        )
        planner = Planner(replace(scene, planning=planning))
        if not planner.usable:
            reasons = "; ".join(f"{name}: {why}" for name, why in planner.reasons.items())
            raise InputError(f"no push of this scene can be steered. {reasons}")
        waits = 0.5 + latency if stale is None else stale
        prior = tuple(steering_of(planner.scene, option) for option in planner.usable)
        around = Surroundings(planner.scene, planner.usable) if among else None
        return cls(
            planner.scene, planner, prior, rate, tolerance, landings, learn, body, waits, surroundings=around
        )

    @cached_property
    def observer(self) -> ContactObserver:
        """What makes sense of the frames."""
        return ContactObserver(self.scene, self.sd)

    @property
    def _switching(self) -> float:
        planning = self.scene.planning
        return max(SWITCHING, planning.switching) if planning.cost == "flat" else SWITCHING

    def start(self, time: float = 0.0) -> HorizonState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return HorizonState(since=time, steering=self.prior, failures=(0,) * len(self.prior))

    def noticed(self, state: HorizonState, frame: Measurement) -> HorizonState:
        # At a landing all is known as of then; what was exposed before and comes late is no news.
        if state.believed is not None and frame.time <= state.believed.time:
            return state
        return self.observer.seen(replace(state, expected=None), frame)

    def act(self, state: HorizonState, time: float) -> tuple[HorizonState, Command]:
        told = state.seen.told
        if told and time - told[-1][0] > 1.5 / self.rate:
            state = replace(state, expected=None)
        act = {
            "look": self._look,
            "transit": self._go,
            "push": self._push,
            "resume": self._resume,
            "retreat": self._go,
        }[state.phase]
        return act(state, time)

    def _look(self, state: HorizonState, time: float) -> tuple[HorizonState, Command]:
        if state.thoughts is not None:
            return self._think(state, state.thoughts, time)
        state = replace(state, mode="look", note="")
        if len(state.frames) < FRAMES:
            return state, self._standing(state)
        pose = mean_pose(state.frames)
        pose[2] = wrapped(float(pose[2]))
        if state.window is not None and state.window.hand is not None:
            sd = self.sd / math.sqrt(len(state.frames))
            state = self.observer.learned(
                state, state.window, pose, sd, relative(pose, state.window.hand)[:2]
            )
            state = replace(state, window=None)
        if self.learn:
            state = replace(state, steering=shared(state.steering))
        error = self.scene.goal_error(pose)
        off = float(np.hypot(error[0], error[1])), abs(float(error[2]))
        inside = max(off[0] / self.tolerance[0], off[1] / self.tolerance[1])
        text = f"{1000 * off[0]:.2f} mm and {np.rad2deg(off[1]):.2f}° off the goal"
        if inside <= GOAL_SHARE:
            return replace(state, mode="done", note=text, outcome=ARRIVED), self._standing(state)
        if state.landings >= self.landings:
            why = ARRIVED if inside <= 1 else f"still {text} after {state.landings} landings"
            if state.stopped and why != ARRIVED:
                why += f"; {state.stopped} of the pushes came too near to something"
            return replace(state, mode="done", note=text, outcome=why), self._standing(state)
        cars = self._usable(state)
        if not any(cars):
            state = self._forgotten(state)
            cars = self._usable(state)
        if not any(cars) and state.forgiven:
            state = self._forgotten(state)
            cars = self._usable(state)
        if self.surroundings is not None:
            seed = state.landings + LOOKS * state.stuck
            search = self.surroundings.next_push(cars, pose, self.scene.goal_pose, self._switching, seed)
            thoughts: Thoughts[Landing | str] = Thoughts(search)
            return self._think(replace(state, thoughts=thoughts, thought=0, note=text), thoughts, time)
        found = next_push(cars, pose, self.scene.goal_pose, self._switching, state.landings)
        if found is None:
            return replace(state, mode="done", outcome="no push can be steered"), self._standing(state)
        place, hand = self.planner.usable[found.push].placement, self.hand(state, time)
        assert place is not None
        try:
            here = relative(pose, hand)
            way = self.planner.transits.between(replace(place, pose=here, tips=here[None, :2]), place)
        except FlatpushError as error_found:
            return replace(state, mode="done", outcome=f"no way on from here: {error_found}"), self._standing(
                state
            )
        stops = np.column_stack([compose(pose, way.poses), way.heights])[1:]
        stops[:, 2] = hand[2] + pose_error(stops[:, :3], hand)[:, 2]
        return self._land(state, found, cars[found.push], pose, stops, text, time)

    def _think(
        self, state: HorizonState, thoughts: Thoughts[Landing | str], time: float
    ) -> tuple[HorizonState, Command]:
        """A tick's part of the search for a path among things; then up, over and down to the push that was found.

        It looks again, a few times, where there is none.
        """
        found, text = thoughts.part(state.thought), state.note
        if found is None:
            return replace(state, thought=state.thought + 1), self._standing(state)
        state = replace(state, thoughts=None)
        if isinstance(found, str):
            if state.stuck + 1 >= LOOKS:
                return replace(state, mode="done", outcome=f"stopped, {text}: {found}"), self._standing(state)
            again = replace(self._forgotten(state), stuck=state.stuck + 1, frames=(), since=time, note=found)
            return again, self._standing(state)
        place, hand = self.planner.usable[found.push].placement, self.hand(state, time)
        assert place is not None
        assert found.path is not None
        pose, car = found.path.poses[0], self._usable(state)[found.push]
        return self._land(
            state, found, car, pose, way_over(self.scene.pusher, place.pose, pose, hand), text, time
        )

    def _land(
        self,
        state: HorizonState,
        found: Landing,
        car: ContactCar | None,
        pose: Array,
        stops: Array,
        text: str,
        time: float,
    ) -> tuple[HorizonState, Command]:
        """On the way to the contact of a push, by stops X_WE and height, shape (n, 4)."""
        option = self.planner.usable[found.push]
        assert car is not None
        assert option.placement is not None
        state = replace(
            state,
            phase="transit",
            stops=tuple(stops),
            push=found.push,
            target=found.target,
            path=found.path,
            passed=0,
            stuck=0,
            frames=(pose,),
            tip=option.placement.tips[0],
            gap=0.0,
            car=car,
            landed=car.radius,
            rest=found.length,
            allowed=found.length + car.radius,
            landings=state.landings + 1,
            resumes=0,
            window=None,
        )
        note = f"landing {state.landings} at {option.push.name}, {text}"
        return self._go(replace(state, note=note), time)

    def _forgotten(self, state: HorizonState) -> HorizonState:
        """Better what failed than nothing: it may go well from here. Where it did not, or nothing failed, what was
        learned may be wrong."""
        none = (0,) * len(self.prior)
        if any(state.failures) and not state.forgiven:
            return replace(state, failures=none, forgiven=True)
        return replace(state, failures=none, forgiven=False, steering=self.prior, bounds=FrictionBounds())

    def _usable(self, state: HorizonState) -> list[ContactCar | None]:
        """The cars of the pushes at their places, as far as is known now; None for those that are left out."""
        fresh = replace(state, failures=(0,) * len(self.prior), steering=self.prior, bounds=FrictionBounds())
        cars: list[ContactCar | None] = []
        for k, option in enumerate(self.planner.usable):
            assert option.placement is not None
            tip = option.placement.tips[0]
            car = self.observer.landing(state, k, tip) if state.failures[k] < FAILURES else None
            hoped = self.observer.landing(fresh, k, tip)
            widest = math.inf if hoped is None else WORSE * hoped.radius
            good = car is not None and car.leeway >= LEEWAY and car.radius <= widest
            cars.append(car if good else None)
        return cars

    def _go(self, state: HorizonState, time: float) -> tuple[HorizonState, Command]:
        """To the next stop; then to what comes after it."""
        hand, stops, seen = self.hand(state, time), state.stops, state.seen
        still = not np.any(seen.last.velocity) and seen.climb == 0
        while stops and still and np.max(np.abs(stops[0] - [*hand, seen.height])) < 1e-6:
            stops = stops[1:]
        if stops:
            table = bool(stops[0][3] == 0 and seen.height == 0)
            moved = replace(state, mode=state.phase, stops=stops)
            return moved, self.limits.towards(
                stops[0], hand, seen.height, seen.last, seen.climb, 1 / self.rate, table
            )
        if state.phase == "retreat":
            looking = replace(state, phase="look", mode="look", stops=(), since=time, frames=())
            return looking, self._standing(state)
        # The object rests where it was seen; the push begins from there.
        assert state.tip is not None
        if self.learn:
            window = LearningWindow(float(state.frames[0][2]), self.sd / math.sqrt(FRAMES), state.tip)
            state = replace(state, window=window)
        landed = Measurement(time, state.frames[0], hand)
        pushing = replace(state, expected=None, phase="push", stops=(), believed=landed, frames=())
        return self._push(pushing, time)

    def _push(self, state: HorizonState, time: float) -> tuple[HorizonState, Command]:
        assert state.tip is not None
        target = state.target
        assert target is not None
        car = state.car
        if car is None:
            return self._retreat(self._failed(state), time, "the contact cannot be steered from where it is")
        if car.radius > WORSE * state.landed:
            return self._retreat(self._failed(state), time, "the finger slipped to where it steers worse")
        gap = state.gap
        if gap > LOST:
            if state.resumes >= RESUMES:
                return self._retreat(self._failed(state), time, "the contact was lost too often")
            note = f"the finger is {1000 * gap:.1f} mm from the edge"
            state = replace(
                state, phase="resume", resumes=state.resumes + 1, frames=(), window=None, note=note
            )
            return self._resume(state, time)
        m, dt = car.model, 1 / self.rate
        pose = self._expected(state, time)
        flat, goal = m.flat_of(pose), m.flat_of(target)
        driven = self._driven(state, float(pose[2]), time)
        allowed = state.allowed - driven
        before = state.rest - driven
        rest: Rest | None = None
        if state.path is not None:
            progress = state.path.progress(m, pose, state.passed)
            if abs(progress.off) > ASTRAY * car.radius or abs(progress.skew) > SKEWED:
                return self._retreat(state, time, f"{1000 * abs(progress.off):.1f} mm off its path")
            if not state.path.last or progress.left > LAST * car.radius:
                kappa = min(max(progress.curvature(car.radius), -m.right), m.left)
                rest = Rest(kappa, max(progress.left, 0.0), "path" if progress.left > 0 else "past")
                before = progress.left
            state = replace(state, passed=progress.passed)
        if rest is None:
            rest = rest_of_path(
                flat,
                goal,
                car.radius,
                m.left,
                m.right,
                before,
                self.scene.pusher.speed * dt,
                float(m.flat_point @ m.direction),
                self.tolerance,
            )
        if rest.how == "past" or allowed < 0:
            return self._retreat(replace(state, forgiven=False), time, "the end of this push")
        arm = m.arm
        # The finger runs as fast as it may; it comes to rest at the end.
        ratio = math.hypot(
            *point_velocity(0.0, 1.0, rest.curvature, float(arm[0]), float(arm[1]), -m.heading, dt, RAMP)
        )
        end = braking(rest.length, BRAKE * self.scene.pusher.acceleration / ratio, dt)
        speed = min(self.scene.pusher.speed / max(1.0, ratio), end + 1e-9)
        omega = rest.curvature * speed
        velocity = pusher_velocity(m, pose, speed, omega, dt)
        if state.path is not None and not self._free(state, state.path, pose, speed, omega):
            ended = replace(state, stopped=state.stopped + 1)
            return self._retreat(ended, time, "the push would come too near to something")
        window = state.window
        if window is not None:
            window = replace(window, ratios=(*window.ratios, car.ratio(rest.curvature)))
        return replace(
            state,
            mode="push",
            note=rest.how,
            rest=before if rest.how == "path" else rest.due(before),
            allowed=allowed,
            window=window,
            expected=pose,
        ), Command(velocity)

    def _free(self, state: HorizonState, path: PushPath, pose: Array, speed: float, omega: float) -> bool:
        """Whether object and finger stay clear until a hand comes to rest that goes on from X_WO like this."""
        assert state.car is not None
        assert state.tip is not None
        assert self.surroundings is not None
        rests = 1 / self.rate + 0.5 * speed / (BRAKE * self.scene.pusher.acceleration)
        twist = rests * state.car.model.twist(speed, omega)
        return self.surroundings.free(state.tip[None], pose, twist, GUARD * path.margin)

    def _driven(self, state: HorizonState, turn: float, time: float) -> float:
        """How far the flat point has come in the last tick [m]."""
        assert state.car is not None
        if state.mode != "push" or not state.seen.told:
            return 0.0
        begun, u = state.seen.told[-1]
        c, s = math.cos(turn), math.sin(turn)
        speed, _ = state.car.model.motion(
            c * float(u[0]) + s * float(u[1]), c * float(u[1]) - s * float(u[0])
        )
        return max(0.0, speed) * (time - begun)

    def _expected(self, state: HorizonState, time: float) -> Array:
        """X_WO now, as the finger sticks: from the newest frame, or one command on from the last tick."""
        assert state.car is not None
        if state.expected is None:
            assert state.believed is not None
            return predicted(state.believed, state.seen.told, time, state.car.model)
        begun, u = state.seen.told[-1]
        x, y, turn = (float(v) for v in state.expected)
        return np.array(state.car.model.moved(x, y, turn, float(u[0]), float(u[1]), time - begun))

    def _failed(self, state: HorizonState) -> HorizonState:
        counts = list(state.failures)
        counts[state.push] += 1
        return replace(state, failures=tuple(counts))

    def _resume(self, state: HorizonState, time: float) -> tuple[HorizonState, Command]:
        """Along the normal, back to the edge where the finger is; the object rests."""
        if not state.frames:
            return replace(state, mode="resume"), self._standing(state)
        pose = mean_pose(state.frames)
        hand = self.hand(state, time)
        tip = relative(pose, hand)[:2]
        _, normal, distance = nearest_contact(self.scene.object.outline, tip)
        gap = distance - self.scene.pusher.tip_radius
        if gap <= REGAINED:
            back = Measurement(time, pose, hand)
            state = replace(state, phase="push", tip=tip, gap=0.0, believed=back, frames=(), expected=None)
            return self._push(replace(state, car=self.observer.car(state, state.push, tip)), time)
        speed = min(
            self.scene.pusher.speed, braking(gap, BRAKE * self.scene.pusher.acceleration, 1 / self.rate)
        )
        c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
        along = np.array([c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], 0.0])
        return replace(state, mode="resume"), Command(speed * along)

    def _retreat(self, state: HorizonState, time: float, why: str) -> tuple[HorizonState, Command]:
        """Back from the object along the normal, on the table; then look."""
        assert state.tip is not None
        frame = state.believed
        assert frame is not None
        _, normal, _ = nearest_contact(self.scene.object.outline, state.tip)
        angle = math.atan2(normal[1], normal[0]) + float(frame.object[2])
        hand, back = self.hand(state, time), self.scene.pusher.approach
        stop = np.array([hand[0] - back * math.cos(angle), hand[1] - back * math.sin(angle), hand[2], 0.0])
        stops: tuple[Array, ...] = (stop,)
        if self.surroundings is not None:
            away = self.surroundings.back(hand, angle)
            stops = (np.array([*away, 0.0]), np.array([*away, self.scene.pusher.lift]))
        window = state.window
        if window is not None and state.car is not None:
            turned = float(predicted(frame, state.seen.told, time, state.car.model)[2])
            window = replace(self.observer.along(state, window, frame, hand, turned), hand=hand)
        return self._go(replace(state, phase="retreat", stops=stops, note=why, window=window), time)

    def hand(self, state: HorizonState, time: float) -> Array:
        """X_WE at a `time` [s]: where the newest frame's log has it, and the commands since."""
        assert state.seen.frame is not None
        return hand(state.seen.frame, state.seen.told, time)
