"""How far a plan may be from the cheapest one: a lower bound by branch and bound over the switch poses."""

from .bound import Bound, bounds, check_bound
from .planned import bounded

__all__ = ["Bound", "bounded", "bounds", "check_bound"]
