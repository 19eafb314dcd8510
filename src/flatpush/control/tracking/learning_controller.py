"""A controller whose model follows what is learned of the push while it runs."""

from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...geometry import log, relative
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..laws.steering_model import SteeringModel
from ..learning.belief import SteeringBelief
from ..loop.controller import AbstractController, ControllerState
from ..loop.measurement import Command, Measurement


@dataclass(frozen=True, eq=False)
class LearningState(ControllerState):
    """Of LearningController: the inner controller's state, the belief, and the frame a stretch began with."""

    inner: Any = None
    belief: SteeringBelief | None = None
    since: Measurement | None = None
    model: SteeringModel | None = None


@dataclass(frozen=True, eq=False)
class LearningController(AbstractController[LearningState]):
    """Runs another controller with the model that the motion seen so far makes likely.

    The estimate is used once it knows the heading of the axle clearly better than the prior did, unless it lies far
    outside that.

    Args:
        inner: a TrackingController or PathController.
        prior: what is believed before, in O.
        sd: standard deviations of a frame's position and angle [m, rad].
        stretch: the object moves at least so far between two observations [m].
    """

    inner: TrackingController | PathController
    prior: SteeringBelief
    sd: tuple[float, float] = (1e-5, 1e-4)
    stretch: float = 0.002
    rate: float = field(init=False)

    def __post_init__(self) -> None:
        if not (min(self.sd) > 0 and self.stretch > 0):
            raise InputError("standard deviations and stretch are positive", value=(self.sd, self.stretch))
        object.__setattr__(self, "rate", self.inner.rate)

    @property
    def model(self) -> SteeringModel:
        return self.inner.model

    def start(self, time: float = 0.0) -> LearningState:
        return LearningState(inner=self.inner.start(time), belief=self.prior, model=self.inner.model)

    def step(
        self, state: LearningState, measurement: Measurement | None, time: float
    ) -> tuple[LearningState, Command]:
        assert state.belief is not None
        assert state.model is not None
        inner = copy(self.inner)
        object.__setattr__(inner, "model", state.model)
        below, command = inner.step(state.inner, measurement, time)
        state = replace(state, inner=below, mode=below.mode, note=below.note, outcome=below.outcome)
        used = measurement is not None and below.mode != "held" and measurement.finite
        return (self._learned(state, measurement) if used and measurement is not None else state), command

    def _learned(self, state: LearningState, frame: Measurement) -> LearningState:
        if state.since is None or frame.time <= state.since.time:
            return replace(state, since=frame)
        moved = relative(state.since.object, frame.object)
        contact_moved = np.hypot(*(moved[:2]))
        if contact_moved < self.stretch or state.belief is None:
            return state
        # A finger that slipped is not where it was on the object: the stretch tells nothing of the axle.
        slip = relative(frame.object, frame.pusher)[:2] - relative(state.since.object, state.since.pusher)[:2]
        if np.hypot(*slip) > max(0.25 * contact_moved, 6 * self.sd[0]):
            return replace(state, since=frame)
        p, a = 2 * self.sd[0] ** 2, 2 * self.sd[1] ** 2
        belief = state.belief.observed(self.inner.model.contact, log(moved), np.diag([p, p, a]))
        model = self.inner.model
        estimate = belief.estimate()
        if belief.better_than_prior(model.contact) and estimate.believable(self.prior.estimate()):
            model = model.about(estimate)
        return replace(state, belief=belief, since=frame, model=model)
