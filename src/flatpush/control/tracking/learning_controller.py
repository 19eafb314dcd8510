"""A controller whose model follows what is learned of the push while it runs."""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...geometry import log, relative
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..learning.belief import SteeringBelief
from ..loop.measurement import Command, Measurement
from .law_runner import AbstractLawRunner, RunnerState


@dataclass(frozen=True, eq=False, kw_only=True)
class LearningState(RunnerState):
    """Of LearningController.

    Attributes:
        controller: the law with the model as it is known now.
        belief: what was learned. since: the frame that the stretch to be learned from began with.
    """

    controller: TrackingController | PathController
    belief: SteeringBelief
    since: Measurement | None = None


@dataclass(frozen=True, eq=False)
class LearningController(AbstractLawRunner[LearningState]):
    """Runs another controller with the model that the motion seen so far makes likely.

    The estimate is used once it knows the heading of the axle clearly better than the prior did, unless it lies far
    outside that.

    Args:
        inner: a TrackingController or PathController.
        prior: what is believed before, in O.
        sd: standard deviations of a frame's position and angle [m, rad].
        stretch: the object moves at least so far between two observations [m].

    Raises:
        InputError: for standard deviations or a stretch that are not positive.
    """

    inner: TrackingController | PathController
    prior: SteeringBelief
    sd: tuple[float, float] = (1e-5, 1e-4)
    stretch: float = 0.002

    def __post_init__(self) -> None:
        if not (min(self.sd) > 0 and self.stretch > 0):
            raise InputError("standard deviations and stretch are positive", value=(self.sd, self.stretch))

    def start(self, time: float = 0.0) -> LearningState:
        return LearningState(inner=self.inner.start(time), controller=self.inner, belief=self.prior)

    def act(self, state: LearningState, time: float) -> tuple[LearningState, Command]:
        below = replace(state.inner, seen=state.seen)
        return self.ran(state, *state.controller.act(below, time))  # type: ignore[arg-type]

    def noticed(self, state: LearningState, frame: Measurement) -> LearningState:
        if state.since is None:
            return replace(state, since=frame)
        moved = relative(state.since.object, frame.object)
        far = float(np.hypot(*moved[:2]))
        if far < self.stretch:
            return state
        # A finger that slipped is not where it was on the object: the stretch tells nothing of the axle.
        slip = relative(frame.object, frame.pusher)[:2] - relative(state.since.object, state.since.pusher)[:2]
        if np.hypot(*slip) > max(0.25 * far, 6 * self.sd[0]):
            return replace(state, since=frame)
        p, a = 2 * self.sd[0] ** 2, 2 * self.sd[1] ** 2
        model = self.model
        belief = state.belief.observed(model.contact, log(moved), np.diag([p, p, a]))
        estimate = belief.estimate()
        controller = state.controller
        if belief.better_than_prior(model.contact) and estimate.believable(self.prior.estimate()):
            with suppress(InputError):  # gains that are not stable with that model: go on with the last
                controller = replace(controller, model=model.about(estimate))
        return replace(state, belief=belief, since=frame, controller=controller)
