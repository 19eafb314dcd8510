"""Receding horizon: at every tick the contact that is seen, its car, and the rest of the path planned anew."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlatpushError, InputError
from ..geometry import Outline, compose, perpendicular, pose_error, relative, transform, wrap_angle
from ..geometry.pose import Array
from ..planning import Planner
from ..problem import Plan, Scene
from .contact_car import ContactCar, contact_car
from .controller import ARRIVED, AbstractController, ControllerState
from .frames import Seen, after, predicted, refusal, with_command
from .landings import next_push
from .laws.plain import RAMP, point_velocity, wrapped
from .learning import FrictionBounds, sticking_displacement
from .measurement import STOP, Command, Measurement
from .rest_of_path import rest_of_path
from .steering import Steering, shared, steering_of

Phase = Literal["look", "transit", "push", "resume", "retreat"]

# Plans leave this share of the friction cone, feedback may use all but the second; both cover friction that is a
# fifth less than believed.
RESERVE, EDGE = 0.4, 0.2
# Of a frame, so much counts against what was expected: position, angle, and the place of the finger on the object.
POSITION_GAIN, ANGLE_GAIN, PLACE_GAIN = 0.25, 0.2, 0.15
# Frames averaged over an object at rest.
FRAMES = 10
# The share of the tolerance that an average of these frames has to keep.
INSIDE = 0.85
# A finger farther from the edge has lost it; back within NEAR it has it again [m].
LOST, NEAR = 0.0007, 0.0001
# A contact that has moved so far along the edge has slipped [m]; where its car then turns so much less tightly than
# where it landed, another landing is better.
SLIPPED, WORSE = 0.0008, 2.5
# Contacts are found again so often in one push before another landing is tried.
RESUMES = 5
# Stretches that are learned from [m], and the shortest [m]; what is not known of the ratio of the forces.
STRETCH, LEAST, DOUBT = 0.015, 0.002, 0.1
# After every failure of a push it is taken to have so much of the friction; pushes that failed so often are left out,
# and those whose straight force lies nearer to the edge of the friction cone than this share of its half angle.
LESS, FAILURES, LEEWAY = 0.85, 3, 0.15
# Bounds on the friction that were learned are believed within this share of it.
SPREAD = 0.3
# What another landing counts as at least: each begins with the errors of a look at the object [m].
SWITCHING = 0.03


@dataclass(frozen=True, eq=False)
class Mark:
    """Where a stretch began that is to be learned from, and what has happened since.

    Attributes:
        angle: of the object then [rad], with its standard deviation sd. tip: of the finger in O then.
        way: ∫ of the contact point's velocity in O since, shape (2,) [m], the drift of the flat point taken off.
        ratios: |tangential| / normal force that the turns since asked for.
        hand: X_WE at the end of the push.
    """

    angle: float
    sd: float
    tip: Array
    way: Array = field(default_factory=lambda: np.zeros(2))
    ratios: tuple[float, ...] = ()
    hand: Array | None = None


@dataclass(frozen=True, eq=False)
class HorizonState(ControllerState):
    """Of HorizonController.

    Attributes:
        phase: "look" at the object at rest, "transit" to a contact, "push", "resume" (the finger has lost the edge and
            comes back to it), "retreat".
        since: frames exposed before this do not count while looking [s]; frames: poses seen since.
        newest: the newest frame as it came. seen: what it means, with the pose as it is believed, or what was known at
            the last landing, and the commands since. expected: X_WO at the last tick, if no frame came since.
        way: poses and heights still to go to (x, y, θ, height), the next first. height: of the pusher now [m].
        push: which option; target: X_WO where it shall end. tip: centre of the finger in O, smoothed,
            and its gap to the edge [m].
        car: of the contact now; landed: the radius of that where it landed. rest: of the push [m];
            allowed: it ends after this at the latest [m].
        landings, resumes: how many there were, of the latter in this push.
        failures: how often the finger slipped, or lost the edge too often, at every option.
        steering: of every option. bounds: of the friction between finger and object. mark: see Mark.
    """

    phase: Phase = "look"
    since: float = -np.inf
    frames: tuple[Array, ...] = ()
    newest: Measurement | None = None
    expected: Array | None = None
    seen: Seen = field(default_factory=Seen)
    way: tuple[Array, ...] = ()
    height: float = 0.0
    push: int = -1
    target: Array | None = None
    tip: Array | None = None
    gap: float = 0.0
    car: ContactCar | None = None
    landed: float = np.inf
    rest: float = np.inf
    allowed: float = np.inf
    landings: int = 0
    resumes: int = 0
    failures: tuple[int, ...] = ()
    steering: tuple[Steering, ...] = ()
    bounds: FrictionBounds = field(default_factory=FrictionBounds)
    mark: Mark | None = None


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
        planner = Planner(replace(scene, planning=planning), tree=False)
        if not planner.usable:
            reasons = "; ".join(f"{name}: {why}" for name, why in planner.reasons.items())
            raise InputError(f"no push of this scene can be steered. {reasons}")
        waits = 0.5 + latency if stale is None else stale
        prior = tuple(steering_of(planner.scene, option, EDGE) for option in planner.usable)
        return cls(planner.scene, planner, prior, rate, tolerance, landings, learn, body, waits)

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
                state = self._watched(replace(state, expected=None), measurement)
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

    # What is seen ---------------------------------------------------------------------------------------------------

    def _watched(self, state: HorizonState, frame: Measurement) -> HorizonState:
        """The state after a frame that is good."""
        before = state.seen.frame
        if state.phase != "push" or state.car is None or before is None or state.tip is None:
            if state.phase == "look" and frame.time >= state.since - 1e-9:
                state = replace(state, frames=(*state.frames, np.asarray(frame.object, dtype=float)))
            if state.phase == "resume":
                # While the finger is off the object this rests: the frames are averaged.
                state = replace(state, frames=(*state.frames, np.asarray(frame.object, dtype=float)))
            return replace(state, seen=after(state.seen, frame))
        model, dt = state.car.model, frame.time - before.time
        u = (np.asarray(frame.pusher, dtype=float) - before.pusher) / dt
        x, y, turn = (float(v) for v in before.object)
        n = model.pusher[2] + turn
        if u[0] * math.cos(n) + u[1] * math.sin(n) > 0:
            x, y, turn = model.moved(x, y, turn, float(u[0]), float(u[1]), dt)
        innovation = pose_error(frame.object, [x, y, turn])
        believed = np.array([x, y, turn]) + innovation * (POSITION_GAIN, POSITION_GAIN, ANGLE_GAIN)
        believed = self._touching(state.car, believed, np.asarray(frame.pusher, dtype=float))
        tip = state.tip + PLACE_GAIN * (relative(frame.object, frame.pusher)[:2] - state.tip)
        state = replace(state, tip=tip, seen=after(state.seen, replace(frame, object=believed)))
        if state.mark is not None:
            mark = self._along(state, state.mark, before, np.asarray(frame.pusher, dtype=float), believed[2])
            state = replace(state, mark=mark)
            if float(np.hypot(*mark.way)) >= STRETCH:
                state = self.learned(state, mark, np.asarray(frame.object, dtype=float), self.sd, tip)
                state = replace(state, mark=Mark(float(frame.object[2]), self.sd, tip))
        gap = touched(self.scene.object.outline, tip)[2] - self.scene.pusher.tip_radius
        return replace(state, car=self.car(state, state.push, tip), gap=gap)

    def _touching(self, car: ContactCar, pose: Array, hand: Array) -> Array:
        """A pose moved along the normal so that the finger touches the edge, if it is near enough to do so."""
        c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
        n, p = car.normal, car.contact
        nx, ny = c * n[0] - s * n[1], s * n[0] + c * n[1]
        px, py = pose[0] + c * p[0] - s * p[1], pose[1] + s * p[0] + c * p[1]
        gap = (px - hand[0]) * nx + (py - hand[1]) * ny - self.scene.pusher.tip_radius
        if abs(gap) > LOST:
            return pose
        return np.array([pose[0] - gap * nx, pose[1] - gap * ny, pose[2]])

    def car(self, state: HorizonState, push: int, tip: ArrayLike) -> ContactCar | None:
        """Of a finger of a push whose centre is at a place in O, as far as is now known."""
        point, normal, _ = touched(self.scene.object.outline, tip)
        known, believed = state.steering[push], self.scene.object.friction
        low, high = (1 - SPREAD) * believed, (1 + SPREAD) * believed
        friction = min(max(state.bounds.clip(believed), low), high) * LESS ** state.failures[push]
        return contact_car(
            point,
            normal,
            known.cof,
            known.rho,
            friction,
            self.scene.pusher.tip_radius,
            reserve=self.scene.planning.friction_margin,
            edge=EDGE,
            sides=known.sides,
            edges=known.edges,
            drift=known.drift,
            turns=self.scene.pusher.turns,
        )

    def _along(
        self, state: HorizonState, mark: Mark, before: Measurement, pusher: Array, turned: float
    ) -> Mark:
        """The mark after the pusher has gone from a frame to X_WE, where the object is turned so far."""
        assert state.car is not None
        reach = [self.scene.pusher.tip_radius, 0.0]
        step = transform(pusher, reach) - transform(before.pusher, reach)
        middle = 0.5 * (float(before.object[2]) + turned)
        c, s = math.cos(middle), math.sin(middle)
        moved = np.array([c * step[0] + s * step[1], c * step[1] - s * step[0]])
        model = state.car.model
        speed, omega = model.motion(float(moved[0]), float(moved[1]))
        moved -= model.across(speed, omega) * perpendicular(model.direction)
        return replace(mark, way=mark.way + moved)

    def learned(self, state: HorizonState, mark: Mark, pose: Array, sd: float, tip: Array) -> HorizonState:
        """What a stretch of sticking that ends at a pose tells of the axle; sticking or slipping, of the friction."""
        if float(np.hypot(*mark.way)) < LEAST:
            return state
        ratios = mark.ratios
        if float(np.hypot(*(tip - mark.tip))) > (SLIPPED if mark.hand is None else 0.5 * SLIPPED):
            return replace(state, bounds=state.bounds.slipped(max(ratios), DOUBT)) if ratios else state
        if ratios:
            state = replace(state, bounds=state.bounds.stuck(float(np.mean(ratios)), DOUBT))
        point, _, _ = touched(self.scene.object.outline, tip)
        turn = float(wrap_angle(pose[2] - mark.angle))
        Y, S = sticking_displacement(point, mark.way, turn, math.hypot(sd, mark.sd))
        known = list(state.steering)
        known[state.push] = known[state.push].observed(point, Y, S)
        # The other pushes are told when the next of them is chosen.
        return replace(state, steering=shared(known, self.scene.object.outline.size, state.push))

    # What is done ---------------------------------------------------------------------------------------------------

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
        if state.mark is not None and state.mark.hand is not None:
            sd = self.sd / math.sqrt(len(state.frames))
            state = self.learned(state, state.mark, pose, sd, relative(pose, state.mark.hand)[:2])
            state = replace(state, mark=None)
        if self.learn:
            state = replace(state, steering=shared(state.steering, self.scene.object.outline.size))
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
            mark=None,
        )
        note = f"landing {state.landings} at {self.planner.usable[k].push.name}, {text}"
        return self._go(replace(state, note=note), time)

    def _usable(self, state: HorizonState) -> list[ContactCar | None]:
        """The cars of the pushes at their places, as far as is known now; None for those that are left out."""
        cars: list[ContactCar | None] = []
        for k, option in enumerate(self.planner.usable):
            assert option.placement is not None
            car = self.car(state, k, option.placement.tips[0]) if state.failures[k] < FAILURES else None
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
                state, mark=Mark(float(state.frames[0][2]), self.sd / math.sqrt(FRAMES), state.tip)
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
            state = replace(state, phase="resume", resumes=state.resumes + 1, frames=(), mark=None, note=note)
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
        mark = state.mark
        if mark is not None:
            mark = replace(mark, ratios=(*mark.ratios, car.ratio(rest.curvature)))
        step = slow * speed * dt
        return replace(
            state,
            mode="push",
            note=rest.how,
            rest=rest.length - step,
            allowed=state.allowed - step,
            mark=mark,
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
        _, normal, distance = touched(self.scene.object.outline, tip)
        gap = distance - self.scene.pusher.tip_radius
        if gap <= NEAR:
            seen = Seen(Measurement(time, pose, hand))
            state = replace(state, phase="push", tip=tip, gap=0.0, seen=seen, frames=(), expected=None)
            return self._push(replace(state, car=self.car(state, state.push, tip)), time)
        speed = min(self.scene.pusher.speed, gap * self.rate)
        c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
        along = np.array([c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], 0.0])
        return replace(state, mode="resume"), speed * along

    def _retreat(self, state: HorizonState, time: float, why: str) -> tuple[HorizonState, Array]:
        """Back from the object along the normal, on the table; then look."""
        assert state.tip is not None
        frame = state.seen.frame
        assert frame is not None
        _, normal, _ = touched(self.scene.object.outline, state.tip)
        angle = math.atan2(normal[1], normal[0]) + float(frame.object[2])
        hand, back = self.hand(state, time), self.scene.pusher.approach
        stop = np.array([hand[0] - back * math.cos(angle), hand[1] - back * math.sin(angle), hand[2], 0.0])
        mark = state.mark
        if mark is not None and state.car is not None:
            turned = float(predicted(state.seen, time, state.car.model)[2])
            mark = replace(self._along(state, mark, frame, hand, turned), hand=hand)
        return self._go(replace(state, phase="retreat", way=(stop,), note=why, mark=mark), time)

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


def touched(outline: Outline, tip: ArrayLike) -> tuple[Array, Array, float]:
    """The point of an outline nearest to a fingertip's centre in O, the inward normal there, and the distance."""
    p = np.asarray(tip, dtype=float)
    found = outline.nearest(p)
    normal = found.normal
    if found.corner and found.distance > 1e-9:
        normal = (found.point - p) / found.distance
    return found.point, normal, found.distance


def mean_pose(poses: Sequence[Array]) -> Array:
    """The mean of poses that lie near to each other."""
    first = np.asarray(poses[0], dtype=float)
    return np.asarray(first + np.mean([pose_error(p, first) for p in poses], axis=0))
