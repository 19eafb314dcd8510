"""The judge: rolls a plan out under quasi-static contact mechanics and recomputes what it claims.

Nothing here imports steering or planning: a mistake there shows as a failed claim or a missed goal.
"""

from .claims import certify, clearance_of
from .rollout import Perturbation, simulate
from .verify import Claim, Report, verify

__all__ = ["Claim", "Perturbation", "Report", "certify", "clearance_of", "simulate", "verify"]
