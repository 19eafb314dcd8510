"""Pairs of the wrench that a pusher applied and the twist that the object made."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import numbers
from ..errors import InputError
from ..geometry.pose import Array


@dataclass(frozen=True, eq=False)
class Pairs:
    """Measured pairs of one object on one table, all about one point fixed in the object.

    Attributes:
        wrenches: (fx, fy, τ) that the pusher applied, shape (n, 3) [N, N m].
        twists: (vx, vy, ω) of the object, or its displacement in a short time; shape (n, 3) [m, rad], per any time.
        name: of the experiment.
        rows: where each pair stands in its file, shape (n,); counted from 1.
    """

    wrenches: Array
    twists: Array
    name: str = ""
    rows: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(self.wrenches)

    def __getitem__(self, chosen: Array) -> "Pairs":
        """Some of the pairs, by an array of numbers or of truth values."""
        rows = tuple(np.array(self.rows)[chosen].tolist()) if self.rows else ()
        return Pairs(self.wrenches[chosen], self.twists[chosen], self.name, rows)

    @property
    def against(self) -> int:
        """How many wrenches oppose their twist (F·V < 0), which no friction allows."""
        return int(np.count_nonzero(np.sum(self.wrenches * self.twists, axis=1) < 0))


def checked_pairs(wrenches: ArrayLike, twists: ArrayLike, needed: int, what: str) -> tuple[Array, Array]:
    """The wrenches and twists (n, 3) as arrays of at least so many finite rows, none of them zero."""
    F, V = (numbers(rows, "wrenches and twists are numbers") for rows in (wrenches, twists))
    if F.ndim != 2 or F.shape[1:] != (3,) or V.shape != F.shape:
        raise InputError("wrenches and twists have the same shape (n, 3)", value=(F.shape, V.shape))
    if not (np.isfinite(F).all() and np.isfinite(V).all()):
        raise InputError("wrenches and twists are finite")
    if len(F) < needed:
        raise InputError(f"{what} needs at least {needed} pairs", value=len(F))
    if not (np.all(np.any(F != 0, axis=1)) and np.all(np.any(V != 0, axis=1))):
        raise InputError("no wrench and no twist of a pair is zero", hint="Leave out the pairs at rest.")
    return F, V


def typical_length(F: Array, V: Array) -> float:
    """The median over pairs (n, 3) of √(|τ||v| / |f||ω|) [m], for a round ellipsoid its √(a/b)."""
    f, v = np.hypot(F[:, 0], F[:, 1]), np.hypot(V[:, 0], V[:, 1])
    turning = (np.abs(F[:, 2]) > 0) & (np.abs(V[:, 2]) > 0) & (f > 0) & (v > 0)
    if np.any(turning):
        squares = np.abs(F[turning, 2]) * v[turning] / (f[turning] * np.abs(V[turning, 2]))
        return float(np.sqrt(np.median(squares)))
    if not np.any(f > 0) or not np.any(F[:, 2]):
        raise InputError("pairs for a fit have forces as well as torques")
    return float(np.sqrt(np.mean(F[:, 2] ** 2) / np.mean(f**2)))
