"""The judge: rolls a plan out under quasi-static contact mechanics and recomputes what it claims.

Nothing here imports steering or planning: a mistake there shows as a failed claim or a missed goal.
"""

from .claims import certify, clearance_of
from .noise import Noise
from .proof import Proof, prove
from .rollout import simulate
from .study import Runs, study
from .verify import Claim, Report, verify

__all__ = [
    "Claim",
    "Noise",
    "Proof",
    "Report",
    "Runs",
    "certify",
    "clearance_of",
    "prove",
    "simulate",
    "study",
    "verify",
]
