"""What sticking and slipping tell of the friction between finger and object."""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class FrictionBounds:
    """What sticking and slipping have told of the coefficient between finger and object: low ≤ μ ≤ high."""

    low: float = 0.0
    high: float = float(np.inf)

    def stuck(self, ratio: float, doubt: float = 0.0) -> "FrictionBounds":
        """After sticking with |tangential| / normal force = ratio, known within a doubt: μ is at least that."""
        return replace(self, low=max(self.low, min(abs(ratio) - doubt, self.high)))

    def slipped(self, ratio: float, doubt: float = 0.0) -> "FrictionBounds":
        """After slipping although the ratio asked for was no more than this: μ is at most that."""
        return replace(self, high=min(self.high, max(abs(ratio) + doubt, self.low)))

    def clip(self, believed: float) -> float:
        """The believed μ, as far as the bounds allow it."""
        return float(min(max(believed, self.low), self.high))
