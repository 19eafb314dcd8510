"""What the horizon controller makes of what it sees: the contact and its car, where the object is, what steers it."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ...geometry import Outline, perpendicular, pose_error, relative, transform, wrap_angle
from ...geometry.pose import Array
from ...problem import Scene
from ..learning.belief import sticking_displacement
from ..loop.measurement import Measurement
from .contact_car import ContactCar, contact_car
from .push_knowledge import shared
from .state import HorizonState, LearningWindow

# Feedback may use all but this share of the friction cone.
EDGE = 0.2
# Of a frame, so much counts against what was expected: position, angle, and the place of the finger on the object.
POSITION_GAIN, ANGLE_GAIN, PLACE_GAIN = 0.25, 0.2, 0.15
# Of the reserve of plans and the edge of feedback, plans keep the share that is listed first and makes the turns no
# wider than so many times those at the edge; with the force for straight on in the middle of the cone that is all.
SHARES, WIDER = (1.0, 0.5, 0.0), 1.6
# A finger farther from the edge has lost it [m].
LOST = 0.0007
# A contact that has moved so far along the edge has slipped [m].
SLIPPED = 0.0008
# Stretches that are learned from [m], and the shortest [m]; what is not known of the ratio of the forces.
STRETCH, LEAST, DOUBT = 0.015, 0.002, 0.1
# After every failure of a push it is taken to have so much of the friction.
LESS = 0.85
# Bounds on the friction that were learned are believed within this share of it.
SPREAD = 0.3


@dataclass(frozen=True, eq=False)
class ContactObserver:
    """Follows the contact of one finger through a push, frame by frame.

    Attributes:
        scene: with the reserve of plans as friction margin.
        sd: standard deviation of a frame's angle [rad], for learning.
    """

    scene: Scene
    sd: float

    def seen(self, state: HorizonState, frame: Measurement) -> HorizonState:
        """The state after a frame that is good."""
        before = state.believed
        if state.phase != "push" or state.car is None or before is None or state.tip is None:
            if state.phase == "look" and frame.time >= state.since - 1e-9:
                state = replace(state, frames=(*state.frames, np.asarray(frame.object, dtype=float)))
            if state.phase == "resume":
                # While the finger is off the object this rests: the frames are averaged.
                state = replace(state, frames=(*state.frames, np.asarray(frame.object, dtype=float)))
            return replace(state, believed=frame)
        model, reserve, dt = state.car.model, state.car.reserve, frame.time - before.time
        u = (np.asarray(frame.pusher, dtype=float) - before.pusher) / dt
        x, y, turn = (float(v) for v in before.object)
        n = model.pusher[2] + turn
        if u[0] * math.cos(n) + u[1] * math.sin(n) > 0:
            x, y, turn = model.moved(x, y, turn, float(u[0]), float(u[1]), dt)
        innovation = pose_error(frame.object, [x, y, turn])
        believed = np.array([x, y, turn]) + innovation * (POSITION_GAIN, POSITION_GAIN, ANGLE_GAIN)
        believed = self._at_edge(state.car, believed, np.asarray(frame.pusher, dtype=float))
        tip = state.tip + PLACE_GAIN * (relative(frame.object, frame.pusher)[:2] - state.tip)
        state = replace(state, tip=tip, believed=replace(frame, object=believed))
        if state.window is not None:
            window = self.along(
                state, state.window, before, np.asarray(frame.pusher, dtype=float), believed[2]
            )
            state = replace(state, window=window)
            if float(np.hypot(*window.way)) >= STRETCH:
                state = self.learned(state, window, np.asarray(frame.object, dtype=float), self.sd, tip)
                state = replace(state, window=LearningWindow(float(frame.object[2]), self.sd, tip))
        gap = nearest_contact(self.scene.object.outline, tip)[2] - self.scene.pusher.tip_radius
        car = self.car(state, state.push, tip, reserve) or self.car(state, state.push, tip, EDGE)
        return replace(state, car=car, gap=gap)

    def _at_edge(self, car: ContactCar, pose: Array, hand: Array) -> Array:
        """A pose moved along the normal so that the finger touches the edge, if it is near enough to do so."""
        c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
        n, p = car.normal, car.contact
        nx, ny = c * n[0] - s * n[1], s * n[0] + c * n[1]
        px, py = pose[0] + c * p[0] - s * p[1], pose[1] + s * p[0] + c * p[1]
        gap = (px - hand[0]) * nx + (py - hand[1]) * ny - self.scene.pusher.tip_radius
        if abs(gap) > LOST:
            return pose
        return np.array([pose[0] - gap * nx, pose[1] - gap * ny, pose[2]])

    def landing(self, state: HorizonState, push: int, tip: ArrayLike) -> ContactCar | None:
        """Of a finger that lands there, with as much reserve as leaves it turns that are worth it.

        Where the force for straight on lies near an edge of the cone, the whole reserve leaves no turn to that side, or
        one so wide that every way is a long one.
        """
        widest = self.car(state, push, tip, EDGE)
        if widest is None:
            return None
        for share in SHARES:
            car = self.car(state, push, tip, EDGE + share * (self._reserve - EDGE))
            if car is not None and car.radius <= WIDER * widest.radius:
                return car
        return widest

    @property
    def _reserve(self) -> float:
        return max(EDGE, self.scene.planning.friction_margin)

    def car(
        self, state: HorizonState, push: int, tip: ArrayLike, reserve: float | None = None
    ) -> ContactCar | None:
        """Of a finger of a push whose centre is at a place in O, as far as is now known; None: with all the reserve."""
        point, normal, _ = nearest_contact(self.scene.object.outline, tip)
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
            reserve=self._reserve if reserve is None else reserve,
            edge=EDGE,
            turning=known.turning,
            turns=self.scene.pusher.turns,
        )

    def along(
        self, state: HorizonState, window: LearningWindow, before: Measurement, pusher: Array, turned: float
    ) -> LearningWindow:
        """The window after the pusher has gone from a frame to X_WE, where the object is turned so far."""
        assert state.car is not None
        reach = [self.scene.pusher.tip_radius, 0.0]
        step = transform(pusher, reach) - transform(before.pusher, reach)
        middle = 0.5 * (float(before.object[2]) + turned)
        c, s = math.cos(middle), math.sin(middle)
        moved = np.array([c * step[0] + s * step[1], c * step[1] - s * step[0]])
        model = state.car.model
        speed, omega = model.motion(float(moved[0]), float(moved[1]))
        moved -= model.across(speed, omega) * perpendicular(model.direction)
        return replace(window, way=window.way + moved)

    def learned(
        self, state: HorizonState, window: LearningWindow, pose: Array, sd: float, tip: Array
    ) -> HorizonState:
        """What a stretch of sticking that ends at a pose tells of the axle; sticking or slipping, of the friction."""
        if float(np.hypot(*window.way)) < LEAST:
            return state
        ratios = window.ratios
        if float(np.hypot(*(tip - window.tip))) > (SLIPPED if window.hand is None else 0.5 * SLIPPED):
            return replace(state, bounds=state.bounds.slipped(max(ratios), DOUBT)) if ratios else state
        if ratios:
            state = replace(state, bounds=state.bounds.stuck(float(np.mean(ratios)), DOUBT))
        point, _, _ = nearest_contact(self.scene.object.outline, tip)
        turn = float(wrap_angle(pose[2] - window.angle))
        Y, S = sticking_displacement(point, window.way, turn, math.hypot(sd, window.sd))
        known = list(state.steering)
        known[state.push] = known[state.push].observed(point, Y, S)
        # The other pushes are told when the next of them is chosen.
        return replace(state, steering=shared(known, state.push))


def nearest_contact(outline: Outline, tip: ArrayLike) -> tuple[Array, Array, float]:
    """The point of an outline nearest to a fingertip's centre in O, the inward normal there, and the distance."""
    p = np.asarray(tip, dtype=float)
    found = outline.nearest(p)
    normal = found.normal
    if found.corner and found.distance > 1e-9:
        normal = (found.point - p) / found.distance
    return found.point, normal, found.distance
