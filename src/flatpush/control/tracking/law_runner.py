"""What runs the law of one push and knows more than the law: a place in the hand, or a model that is learned."""

from dataclasses import dataclass, replace
from typing import TypeVar

from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..laws.steering_model import SteeringModel
from ..loop.controller import AbstractController, ControllerState
from ..loop.limits import Limits
from ..loop.measurement import Command


@dataclass(frozen=True, eq=False, kw_only=True)
class RunnerState(ControllerState):
    """With the state of the law."""

    inner: ControllerState


RunnerStateT = TypeVar("RunnerStateT", bound=RunnerState)


class AbstractLawRunner(AbstractController[RunnerStateT]):
    """Runs a law, at its rate and within its limits.

    Attributes:
        inner: the law.
    """

    inner: TrackingController | PathController

    @property
    def rate(self) -> float:  # type: ignore[override]
        return self.inner.rate

    @property
    def limits(self) -> Limits | None:  # type: ignore[override]
        return self.inner.limits

    @property
    def model(self) -> SteeringModel:
        return self.inner.model

    @staticmethod
    def ran(state: RunnerStateT, below: ControllerState, command: Command) -> tuple[RunnerStateT, Command]:
        """The state after a tick of the law, and its command."""
        return replace(state, inner=below, mode=below.mode, note=below.note, outcome=below.outcome), command
