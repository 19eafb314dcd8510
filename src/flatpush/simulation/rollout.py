"""Quasi-static motion of the object under the planned motion of the pusher."""

from dataclasses import dataclass, replace

import numpy as np

from ..contact import ContactMode, PointContact, two_point_sticks
from ..contact.placement import SMOOTH_CORNER
from ..errors import InputError
from ..friction.surface import LimitSurface
from ..geometry import compose, exp, inverse, perpendicular, relative, rotate, shift_twist, transform
from ..geometry.pose import Array
from ..problem import Object, Plan, Rollout, Scene
from ..problem.mechanics import contacts_of, named, placement_of, surface_of, virtual_contact
from ..problem.scene import Model
from .pieces import Piece, Source, pieces

# Longest travel of the pusher in one integration step [m]; the error of a step is its fifth power over L⁴.
STEP = 0.001
# A gap up to this counts as touching [m]; the simulation removes what drift leaves.
TOUCHING = 1e-9


@dataclass(frozen=True)
class Perturbation:
    """What differs from the plan in a perturbed run: standard deviations of the start pose and of friction.

    Attributes:
        position: of the start, each axis [m] (one finger only; two would need the landing's two-contact motion).
        angle: of the start [rad] (one finger only).
        friction: of the coefficient, relative.
    """

    position: float = 0.0005
    angle: float = float(np.deg2rad(0.5))
    friction: float = 0.1

    def __post_init__(self) -> None:
        for name in ("position", "angle", "friction"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError("noise is a finite number, 0 or more", key=name, value=value)


def simulate(
    plan: Plan,
    seed: int = 0,
    *,
    model: Model = "exact",
    source: Source = "arcs",
    perturbation: Perturbation | None = None,
) -> Rollout:
    """Rolls a plan out.

    One finger: stick, slide left, slide right, separation, touching again, and rolling of the round tip on the outline.
    Two fingers: the object keeps the hand's motion while the twist lies in the composite cone; leaving it ends the run
    as "left the cone".

    Args:
        seed: of the perturbation; without one the run is the nominal one.
        model: limit surface under which the object moves; "exact" is the support's own, or the known one.
        source: the pusher's way: the plan's "arcs" exactly, or straight between its "samples".

    Raises:
        InputError: for a plan without a solution.
    """
    if plan.status != "solved":
        raise InputError("there is no plan to roll out", hint=plan.reason)
    scene = plan.scene
    start = np.asarray(scene.start, dtype=float)
    if perturbation is not None:
        rng = np.random.default_rng(seed)
        noise, relative_friction = rng.standard_normal(3), rng.standard_normal()
        scale = np.array([perturbation.position, perturbation.position, perturbation.angle])
        if all(len(p.fingers) == 1 for p in plan.pushes):
            start = start + scale * noise
        mu = scene.object.friction * max(0.0, 1 + perturbation.friction * relative_friction)
        scene = replace(scene, object=_with_friction(scene, mu))
    run = _Run(scene, plan, model, start)
    for piece in pieces(plan.segments, np.asarray(plan.scene.start, dtype=float), source):
        if not run.advance(piece):
            break
    return run.rollout(None if perturbation is None else seed)


class _Run:
    """The state of one rollout: pose of the object, contact, and what was recorded."""

    def __init__(self, scene: Scene, plan: Plan, model: Model, start: Array) -> None:
        self.scene, self.plan, self.model = scene, plan, model
        self.q = start
        self.touching = False
        self.outcome = "completed"
        self.push: int | None = None  # of the segment under way, None in a transit
        self.fingers = 1
        self.X_OE = np.zeros(3)
        self.last_twist: Array | None = None
        first = plan.segments[0].pusher[0] if plan.segments else start
        self.times, self.object, self.pusher = [0.0], [start], [np.asarray(first)]
        self.modes: list[str] = [ContactMode.REST.value]
        self.surface: LimitSurface
        self.contacts: tuple[PointContact, ...]
        if plan.pushes:
            self._prepare(0)

    def rollout(self, seed: int | None) -> Rollout:
        times, poses, pusher = (np.array(x) for x in (self.times, self.object, self.pusher))
        return Rollout(self.q, times, poses, pusher, tuple(self.modes), self.outcome, seed)

    def advance(self, piece: Piece) -> bool:
        """Moves on by one piece; False when the run has ended."""
        if piece.push != self.push:
            if self.push is not None:
                if not self.touching:
                    self.outcome = "lost contact"
                    return False
                self.touching = False
            self.push = piece.push
            if piece.push is not None:
                self._prepare(piece.push)
                self.X_OE = relative(self.q, piece.pusher)
        mode, going = ContactMode.REST, True
        if self.fingers == 2 and piece.push is not None:
            mode, going = self._carry(piece)
        elif self.fingers == 1 and not piece.lifted:
            mode = self._press(piece)
        self.times.append(piece.time + piece.duration)
        self.object.append(self.q)
        self.pusher.append(piece.pusher_at(1.0))
        self.modes.append(mode.value)
        return going

    def _prepare(self, index: int) -> None:
        """Fingers, contacts and limit surface of a push."""
        push = named(self.scene, self.plan.pushes[index].push)
        placement = placement_of(self.scene, push)
        p = virtual_contact(self.scene, placement).point
        self.fingers = push.fingers
        self.surface = surface_of(self.scene.object, self.model, -p / np.hypot(*p))
        self.contacts = contacts_of(self.scene, placement)
        self.last_twist = None

    def _carry(self, piece: Piece) -> tuple[ContactMode, bool]:
        """Two fingers: the object keeps its pose in the hand while the composite cone holds its wrench."""
        twist = piece.object_step
        if not piece.body:
            twist = np.array([*rotate(-piece.object[2] - 0.5 * twist[2], twist[:2]), twist[2]])
        size = float(np.linalg.norm(twist))
        if size > 0:
            direction = twist / size
            if self.last_twist is None or np.max(np.abs(direction - self.last_twist)) > 1e-9:
                V = shift_twist(twist, self.scene.object.cof)
                if not two_point_sticks(self.contacts, self.surface, V):
                    self.outcome = "left the cone"
                    return ContactMode.SEPARATION, False
                self.last_twist = direction
        self.q = compose(piece.pusher_at(1.0), inverse(self.X_OE))
        self.touching = True
        return ContactMode.STICKING, True

    def _press(self, piece: Piece) -> ContactMode:
        """One finger: classical Runge-Kutta steps while it touches, a search for the touch while it does not."""
        travel = (
            float(np.hypot(*piece.pusher_step[:2]))
            + abs(piece.pusher_step[2]) * self.scene.object.outline.size
        )
        n = max(1, int(np.ceil(travel / STEP)))
        mode = ContactMode.REST
        for i in range(n):
            low, high = i / n, (i + 1) / n
            if not self.touching:
                touch = self._touch(piece, low, high)
                if touch is None:
                    mode = ContactMode.SEPARATION
                    continue
                self.touching, low = True, touch
            mode = self._step(piece, low, high)
            if mode is ContactMode.SEPARATION:
                self.touching = False
        return mode

    def _touch(self, piece: Piece, low: float, high: float) -> float | None:
        """When the finger touches the resting object, by bisection; None if it does not."""
        if self._gap(piece, high)[0] > TOUCHING:
            return None
        if self._gap(piece, low)[0] <= TOUCHING:
            return low
        a, b = low, high
        for _ in range(50):
            middle = 0.5 * (a + b)
            a, b = (middle, b) if self._gap(piece, middle)[0] > 0 else (a, middle)
        return b

    def _gap(self, piece: Piece, fraction: float) -> tuple[float, Array, Array, Array]:
        return self._contact(self.q, piece.pusher_at(fraction)[:2])

    def _contact(self, q: Array, tip_W: Array) -> tuple[float, Array, Array, Array]:
        """Gap, contact point and inward normal in O, and the tip's centre in O."""
        tip = transform(inverse(q), tip_W)
        found = self.scene.object.outline.nearest(tip)
        normal, point = found.normal, found.point
        if found.corner and found.distance > 1e-9 * self.scene.object.outline.size:
            normal = (point - tip) / np.hypot(*(point - tip))
            if np.arccos(np.clip(normal @ found.normal, -1.0, 1.0)) > SMOOTH_CORNER and self.touching:
                self.outcome = "passed a corner"
        return found.distance - self.scene.pusher.tip_radius, point, normal, tip

    def _twist(self, q: Array, piece: Piece, fraction: float) -> tuple[Array, ContactMode]:
        """Body twist of the object in O per whole piece, and the contact mode."""
        pusher, velocity = piece.pusher_at(fraction), piece.pusher_velocity(fraction)
        _, point, normal, tip = self._contact(q, pusher[:2])
        lever = rotate(q[2], point - tip)
        u = rotate(-q[2], velocity[:2] + velocity[2] * perpendicular(lever))
        cof = self.scene.object.cof
        contact = PointContact(point - cof, normal, self.scene.object.friction, hook=True)
        motion = contact.motion(self.surface, u)
        return shift_twist(motion.twist, -cof), motion.mode

    def _step(self, piece: Piece, low: float, high: float) -> ContactMode:
        """A step of the fourth-order Runge-Kutta-Munthe-Kaas method: exact where the twist is constant."""
        h, q = high - low, self.q
        twist, mode = self._twist(q, piece, low)
        if mode is ContactMode.SEPARATION or mode is ContactMode.REST:
            return mode
        slopes = [twist]
        for part in (0.5, 0.5, 1.0):
            moved = part * h * slopes[-1]
            twist, mode_end = self._twist(compose(q, exp(moved)), piece, low + part * h)
            slopes.append(_slope(moved, twist))
        k1, k2, k3, k4 = slopes
        self.q = compose(q, exp(h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)))
        gap, _, normal, _ = self._gap(piece, high)
        if mode_end is not ContactMode.SEPARATION and abs(gap) < 0.1 * STEP:
            # Remove the drift off the outline that the step's error leaves.
            self.q = self.q - np.array([*(gap * rotate(self.q[2], normal)), 0.0])
        return mode


def _slope(moved: Array, twist: Array) -> Array:
    """Rate of the displacement's logarithm when the body, displaced by exp(moved), has a body twist."""
    first = _bracket(moved, twist)
    return twist + 0.5 * first + _bracket(moved, first) / 12


def _bracket(a: Array, b: Array) -> Array:
    """The Lie bracket of two plane twists."""
    return np.array([*(a[2] * perpendicular(b[:2]) - b[2] * perpendicular(a[:2])), 0.0])


def _with_friction(scene: Scene, friction: float) -> Object:
    return replace(scene.object, friction=friction)
