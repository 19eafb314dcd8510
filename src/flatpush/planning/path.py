"""A path of one or many pushes, piece by piece: what every strategy of the search gives."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry import compose, exp
from ..geometry.pose import Array
from ..steering.fleet import Fleet
from ..steering.time_law import rest_to_rest

NOTHING = 1e-10  # an amount below this is nothing [rad, m]
Piece = tuple[int, int, float]


@dataclass(frozen=True, eq=False)
class Path:
    """From a start on, pieces of constant twist.

    Attributes:
        fleet: what the pieces belong to.
        start: pose X_WO, shape (3,).
        pieces: (push, letter, amount): letter 0 left, 1 straight, 2 right; amount an angle [rad] or a length [m].
    """

    fleet: Fleet
    start: Array
    pieces: tuple[Piece, ...]

    @classmethod
    def of(cls, fleet: Fleet, start: Array, pieces: Sequence[Piece]) -> "Path":
        """Leaves out what is nothing and joins equal neighbours."""
        kept: list[Piece] = []
        for push, letter, amount in pieces:
            if amount <= NOTHING:
                continue
            if kept and kept[-1][:2] == (push, letter):
                kept[-1] = (push, letter, kept[-1][2] + amount)
            else:
                kept.append((push, letter, amount))
        return cls(fleet, np.array(start, dtype=float), tuple(kept))

    def step(self, push: int, letter: int, amount: float) -> Array:
        """The displacement of a piece as a body twist, shape (3,)."""
        if letter == 1:
            return amount * np.array([*self.fleet.direction[push], 0.0])
        centre = (self.fleet.left if letter == 0 else self.fleet.right)[push]
        turn = amount if letter == 0 else -amount
        return turn * np.array([centre[1], -centre[0], 1.0])

    @cached_property
    def poses(self) -> Array:
        """Poses at the start and after every piece, shape (n + 1, 3)."""
        poses = [self.start]
        for piece in self.pieces:
            poses.append(compose(poses[-1], exp(self.step(*piece))))
        return np.array(poses)

    @cached_property
    def cost(self) -> float:
        """Of the pieces and the changes between pushes, in the fleet's unit."""
        total = 0.0
        for i, (push, letter, amount) in enumerate(self.pieces):
            if i and self.pieces[i - 1][0] != push:
                total += self.fleet.switching[self.pieces[i - 1][0], push]
            way, speed = self.fleet.rates[push, letter] * amount, self.fleet.speeds[push, letter]
            if np.isinf(speed):
                total += way
                continue
            total += rest_to_rest(way, speed, self.fleet.accelerations[push, letter])
        return float(total)

    def backwards(self, fleet: Fleet, start: Array) -> "Path":
        """The path of a reversed query (Query.reversed) as one of the query itself."""
        return Path.of(
            fleet, start, [(push, 2 - letter, amount) for push, letter, amount in self.pieces[::-1]]
        )

    @property
    def pushes(self) -> tuple[int, ...]:
        """The push of every stretch between changes."""
        found = [piece[0] for piece in self.pieces]
        return tuple(p for i, p in enumerate(found) if i == 0 or found[i - 1] != p)

    @property
    def stretches(self) -> list[tuple[int, str, Array, Array]]:
        """Push, word, amounts and last pose of every stretch between changes."""
        found: list[tuple[int, str, Array, Array]] = []
        begin = 0
        for i in range(1, len(self.pieces) + 1):
            if i == len(self.pieces) or self.pieces[i][0] != self.pieces[begin][0]:
                some = self.pieces[begin:i]
                word = "".join("LSR"[letter] for _, letter, _ in some)
                found.append((some[0][0], word, np.array([x for *_, x in some]), self.poses[i]))
                begin = i
        return found


def pieces_of(push: int, word: np.void) -> list[Piece]:
    """The pieces of a word of a push, a record of six_words.WORD."""
    return [
        (push, letter, amount)
        for letter, amount in zip(word["letter"].tolist(), word["amount"].tolist(), strict=True)
    ]
