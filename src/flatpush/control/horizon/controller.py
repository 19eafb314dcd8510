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
from ..learning.friction_bounds import FrictionBounds
from ..loop.controller import ARRIVED, AbstractController
from ..loop.frames import Seen, predicted, refusal, with_command
from ..loop.measurement import STOP, Command, Measurement
from .contact_car import ContactCar
from .contact_observer import EDGE, LOST, ContactObserver, mean_pose, nearest_contact
from .landings import next_push
from .push_knowledge import Steering, shared, steering_of
from .rest_of_path import rest_of_path
from .state import HorizonState, LearningWindow

# Plans leave this share of the friction cone, feedback may use more of it (contact_observer.EDGE); both cover
# friction that is a fifth less than believed.
RESERVE = 0.4
# Frames averaged over an object at rest.
FRAMES = 10
# The share of the tolerance that an average of these frames has to keep.
INSIDE = 0.85
# A finger that had lost the edge has it again when it is as near as this [m].
NEAR = 0.0001
# Where the car of a contact that slipped turns so much less tightly than where it landed, another landing is better.
WORSE = 2.5
# Contacts are found again so often in one push before another landing is tried.
RESUMES = 5
# Pushes that failed so often are left out, and those whose straight force lies nearer to the edge of the friction cone
# than this share of its half angle.
FAILURES, LEEWAY = 3, 0.15
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
        landings: at most so many, then it gives up and says how far off it is.
        learn: whether the steering is learned while the finger sticks.
        body, stale: as for PathController.
        sd: standard deviation of a frame's angle [rad], for learning.
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
            plan: a plan, or its scene; its own way does not matter, since it is planned anew from what is seen.
            latency: of the camera that is expected [s]; frames older than this and half a second stop the pusher.

        Raises:
            InputError: for two fingers, obstacles or bounds (replanning does not see them), or no push that steers.
        """
        scene = plan.scene if isinstance(plan, Plan) else plan
        if not (np.isfinite(latency) and latency >= 0):
            raise InputError("a latency is 0 or more", key="latency", value=latency)
        if scene.workspace.bounds is not None or scene.workspace.obstacles:
            raise InputError(
                "the horizon controller plans anew without regard to obstacles and bounds, and this scene has some",
                hint="Follow the plan with the path controller.",
            )
        if scene.pusher.fingers != 1:
            raise InputError(
                "the horizon controller steers with one finger",
                value=scene.pusher.fingers,
                hint="Two fingers do not need it: follow the plan with the path controller.",
            )
        planning = replace(
            scene.planning, friction_margin=max(RESERVE, scene.planning.friction_margin), iterations=1
        )
        planner = Planner(replace(scene, planning=planning))
        if not planner.usable:
            reasons = "; ".join(f"{name}: {why}" for name, why in planner.reasons.items())
            raise InputError(f"no push of this scene can be steered. {reasons}")
        waits = 0.5 + latency if stale is None else stale
        prior = tuple(steering_of(planner.scene, option, EDGE) for option in planner.usable)
        return cls(planner.scene, planner, prior, rate, tolerance, landings, learn, body, waits)

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

    def step(
        self, state: HorizonState, measurement: Measurement | None, time: float
    ) -> tuple[HorizonState, Command]:
        if state.outcome:
            return state, STOP
        if not np.isfinite(time):
            return replace(state, mode="held", note="the time is not finite"), STOP
        if measurement is not None:
            wrong = refusal(measurement, Seen(state.newest), time, self.body, self.stale)
            if wrong:
                return self._stopped(state, time, "held", wrong)
            state = replace(state, newest=measurement)
            # At a landing all is known as of then; what was exposed before and comes late is no news.
            if state.seen.frame is None or measurement.time > state.seen.frame.time:
                state = self.observer.seen(replace(state, expected=None), measurement)
        frame = state.newest
        if frame is None:
            return self._stopped(state, time, "waiting", "no measurement yet")
        if time - frame.time > self.stale:
            return self._stopped(
                state, time, "waiting", f"the last measurement is {time - frame.time:.3g} s old"
            )
        act = {
            "look": self._look,
            "transit": self._go,
            "push": self._push,
            "resume": self._resume,
            "retreat": self._go,
        }[state.phase]
        state, velocity = act(state, time)
        if not np.all(np.isfinite(velocity)):
            return replace(state, mode="done", outcome="the law gave no finite command"), STOP
        seen = with_command(state.seen, time, velocity)
        return replace(state, seen=seen), Command(velocity, state.height)

    def _stopped(
        self, state: HorizonState, time: float, mode: str, note: str
    ) -> tuple[HorizonState, Command]:
        seen = with_command(state.seen, time, np.zeros(3))
        return (
            replace(state, mode=mode, note=note, seen=seen, expected=None),
            Command(np.zeros(3), state.height),
        )

    def _look(self, state: HorizonState, time: float) -> tuple[HorizonState, Array]:
        state = replace(state, mode="look", note="")
        if len(state.frames) < FRAMES:
            return state, np.zeros(3)
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
        error = pose_error(pose, self.scene.goal)
        off = float(np.hypot(error[0], error[1])), abs(float(error[2]))
        inside = max(off[0] / self.tolerance[0], off[1] / self.tolerance[1])
        text = f"{1000 * off[0]:.2f} mm and {np.rad2deg(off[1]):.2f}° off the goal"
        if inside <= INSIDE:
            return replace(state, mode="done", note=text, outcome=ARRIVED), np.zeros(3)
        if state.landings >= self.landings:
            why = ARRIVED if inside <= 1 else f"still {text} after {state.landings} landings"
            return replace(state, mode="done", note=text, outcome=why), np.zeros(3)
        cars = self._usable(state)
        if not any(cars):
            # Better what failed than nothing: it may go well from here, and what was learned may be wrong.
            state = replace(state, failures=(0,) * len(cars), steering=self.prior, bounds=FrictionBounds())
            cars = self._usable(state)
        found = next_push(cars, pose, self.scene.goal_pose, self._switching, state.landings)
        if found is None:
            why = "no push can be steered"
            return replace(state, mode="done", outcome=why), np.zeros(3)
        k, target, length = found
        place, car, hand = self.planner.usable[k].placement, cars[k], self.hand(state, time)
        assert place is not None
        assert car is not None
        try:
            here = relative(pose, hand)
            way = self.planner.transits.between(replace(place, pose=here, tips=here[None, :2]), place)
        except FlatpushError as error_found:
            return replace(state, mode="done", outcome=f"no way on from here: {error_found}"), np.zeros(3)
        stops = np.column_stack([compose(pose, way.poses), way.heights])[1:]
        stops[:, 2] = hand[2] + pose_error(stops[:, :3], hand)[:, 2]
        state = replace(
            state,
            phase="transit",
            way=tuple(stops),
            push=k,
            target=target,
            frames=(pose,),
            tip=place.tips[0],
            gap=0.0,
            car=car,
            landed=car.radius,
            rest=length,
            allowed=length + car.radius,
            landings=state.landings + 1,
            resumes=0,
            window=None,
        )
        note = f"landing {state.landings} at {self.planner.usable[k].push.name}, {text}"
        return self._go(replace(state, note=note), time)

    def _usable(self, state: HorizonState) -> list[ContactCar | None]:
        """The cars of the pushes at their places, as far as is known now; None for those that are left out."""
        cars: list[ContactCar | None] = []
        for k, option in enumerate(self.planner.usable):
            assert option.placement is not None
            car = (
                self.observer.car(state, k, option.placement.tips[0])
                if state.failures[k] < FAILURES
                else None
            )
            cars.append(car if car is not None and car.leeway >= LEEWAY else None)
        return cars

    def _go(self, state: HorizonState, time: float) -> tuple[HorizonState, Array]:
        """Along the way to its next stop; then to what comes after it."""
        dt, pusher = 1 / self.rate, self.scene.pusher
        hand, way, height = self.hand(state, time), state.way, state.height
        while way:
            target = way[0]
            delta = target[:3] - hand
            rise = float(target[3]) - height
            distance = math.sqrt(float(delta[0]) ** 2 + float(delta[1]) ** 2 + rise * rise)
            if distance < 1e-7 and abs(float(delta[2])) < 1e-6:
                way = way[1:]
                continue
            gently = len(way) == 1 and target[3] == 0 and height == 0
            share = min(1.0, (pusher.speed if gently else 5 * pusher.speed) * dt / max(distance, 1e-12))
            moved = replace(state, mode=state.phase, way=way, height=height + share * rise)
            return moved, share * delta / dt
        if state.phase == "retreat":
            return replace(state, phase="look", mode="look", way=(), since=time, frames=()), np.zeros(3)
        # The object rests where it was seen; the push begins from there.
        seen = Seen(Measurement(time, state.frames[0], hand))
        assert state.tip is not None
        if self.learn:
            state = replace(
                state,
                window=LearningWindow(float(state.frames[0][2]), self.sd / math.sqrt(FRAMES), state.tip),
            )
        pushing = replace(state, expected=None, phase="push", way=(), height=0.0, seen=seen, frames=())
        return self._push(pushing, time)

    def _push(self, state: HorizonState, time: float) -> tuple[HorizonState, Array]:
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
        rest = rest_of_path(
            flat,
            goal,
            car.radius,
            m.left,
            m.right,
            state.rest,
            self.scene.pusher.speed * dt,
            float(m.flat_point @ m.direction),
            self.tolerance,
        )
        if rest.how == "past" or state.allowed < 0:
            return self._retreat(state, time, "the end of this push")
        speed = min(self.scene.pusher.speed, rest.length / dt + 1e-9)
        omega = rest.curvature * speed
        arm = m.arm
        u = point_velocity(flat[2], speed, omega, float(arm[0]), float(arm[1]), float(pose[2]), dt, RAMP)
        slow = min(1.0, self.scene.pusher.speed / max(math.hypot(*u), 1e-300))
        velocity = slow * np.array([u[0], u[1], omega if m.turns else 0.0])
        window = state.window
        if window is not None:
            window = replace(window, ratios=(*window.ratios, car.ratio(rest.curvature)))
        step = slow * speed * dt
        return replace(
            state,
            mode="push",
            note=rest.how,
            rest=rest.length - step,
            allowed=state.allowed - step,
            window=window,
            expected=pose,
        ), velocity

    def _expected(self, state: HorizonState, time: float) -> Array:
        """X_WO now, as the finger sticks: from the newest frame, or one command on from the last tick."""
        assert state.car is not None
        if state.expected is None:
            return predicted(state.seen, time, state.car.model)
        begun, u = state.seen.told[-1]
        x, y, turn = (float(v) for v in state.expected)
        return np.array(state.car.model.moved(x, y, turn, float(u[0]), float(u[1]), time - begun))

    def _failed(self, state: HorizonState) -> HorizonState:
        counts = list(state.failures)
        counts[state.push] += 1
        return replace(state, failures=tuple(counts))

    def _resume(self, state: HorizonState, time: float) -> tuple[HorizonState, Array]:
        """Along the normal, back to the edge where the finger is; the object rests."""
        if not state.frames:
            return replace(state, mode="resume"), np.zeros(3)
        pose = mean_pose(state.frames)
        hand = self.hand(state, time)
        tip = relative(pose, hand)[:2]
        _, normal, distance = nearest_contact(self.scene.object.outline, tip)
        gap = distance - self.scene.pusher.tip_radius
        if gap <= NEAR:
            seen = Seen(Measurement(time, pose, hand))
            state = replace(state, phase="push", tip=tip, gap=0.0, seen=seen, frames=(), expected=None)
            return self._push(replace(state, car=self.observer.car(state, state.push, tip)), time)
        speed = min(self.scene.pusher.speed, gap * self.rate)
        c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
        along = np.array([c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], 0.0])
        return replace(state, mode="resume"), speed * along

    def _retreat(self, state: HorizonState, time: float, why: str) -> tuple[HorizonState, Array]:
        """Back from the object along the normal, on the table; then look."""
        assert state.tip is not None
        frame = state.seen.frame
        assert frame is not None
        _, normal, _ = nearest_contact(self.scene.object.outline, state.tip)
        angle = math.atan2(normal[1], normal[0]) + float(frame.object[2])
        hand, back = self.hand(state, time), self.scene.pusher.approach
        stop = np.array([hand[0] - back * math.cos(angle), hand[1] - back * math.sin(angle), hand[2], 0.0])
        window = state.window
        if window is not None and state.car is not None:
            turned = float(predicted(state.seen, time, state.car.model)[2])
            window = replace(self.observer.along(state, window, frame, hand, turned), hand=hand)
        return self._go(replace(state, phase="retreat", way=(stop,), note=why, window=window), time)

    def hand(self, state: HorizonState, time: float) -> Array:
        """X_WE now: where the newest frame's log has it, and the commands since."""
        frame = state.seen.frame
        assert frame is not None
        hand = np.array(frame.pusher, dtype=float)
        told = state.seen.told
        for k, (begun, velocity) in enumerate(told):
            ended = told[k + 1][0] if k + 1 < len(told) else time
            dt = min(ended, time) - max(begun, frame.time)
            if dt > 0:
                hand += dt * velocity
        return hand
