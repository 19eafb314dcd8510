"""One answer of an anytime search."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..problem import Plan
from .path import Path


@dataclass(frozen=True, eq=False)
class Answer:
    """A plan that was found, or that there is none.

    Attributes:
        cost: in the unit of the scene's cost; infinite where there is no plan.
        plan: makes the plan with its certificate, or the one that says why there is none.
        found: what the search tells about it, as in the plan's run entry.
        path: of a plan of pushes that stick, before it is timed; None for others.
    """

    cost: float
    plan: Callable[[], Plan]
    found: dict[str, Any] = field(default_factory=dict)
    path: Path | None = None
