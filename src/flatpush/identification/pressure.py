"""Families of pressures with free numbers, among which the one behind recorded motion is sought."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import lgamma
from typing import NamedTuple

import numpy as np

from ..friction import Support
from ..friction.patches import patches
from ..geometry import Outline
from ..geometry.pose import Array

# Standard deviation of the logarithm of a load on a known foot (statics tells it that well), of one anywhere, of a
# density, and of the shares of face and rim.
SD_FOOT, SD_FREE, SD_DENSITY, SD_RIM = 0.4, 1.0, 1.0, 3.0
# A density is alike over so much of the object's size; so many ways in which it may differ are kept.
ALIKE, WAYS = 0.3, 18
# Places of the face and of the rim on which a density is spread.
FACE, RIM = 150, 60
# Feet that may stand anywhere: standard deviation from the middle of the outline, by its size.
SD_PLACE = 0.35


class Spread(NamedTuple):
    """Loads at places, and how they depend on the free numbers; k places, p numbers.

    Attributes:
        places: (k, 2) [m]. loads: of sum 1, (k,). by_loads: (k, p). by_places: (k, 2, p).
    """

    places: Array
    loads: Array
    by_loads: Array
    by_places: Array | None


class AbstractPressure(ABC):
    """A family of pressures.

    Laws: at(mean) is what is expected without data; precision > 0; loads are not negative, of sum 1.
    """

    name: str

    @property
    def ways(self) -> float:
        """The logarithm of the number of ways in which the numbers can be written for one pressure."""
        return 0.0

    @property
    @abstractmethod
    def mean(self) -> Array:
        """What is expected of the numbers, shape (p,)."""

    @property
    @abstractmethod
    def precision(self) -> Array:
        """Inverse variances of the numbers about their mean, shape (p,)."""

    @abstractmethod
    def at(self, x: Array) -> Spread:
        """The loads for the numbers."""

    def support(self, x: Array) -> Support:
        spread = self.at(x)
        return Support.points(spread.places, np.maximum(spread.loads, 1e-9))


def _shares(logs: Array, by: Array) -> tuple[Array, Array]:
    """Loads in proportion to exp(logs), and their derivatives, given those of the logs (k, p)."""
    loads = np.exp(logs - logs.max())
    loads /= loads.sum()
    return loads, loads[:, None] * (by - loads @ by)


@dataclass(frozen=True, eq=False)
class KnownFeet(AbstractPressure):
    """Feet whose places are known, and loads within a standard deviation of their logarithms."""

    places: Array
    expected: Array
    sd: float = SD_FOOT
    name: str = "feet"

    @property
    def mean(self) -> Array:
        return np.log(self.expected / self.expected.sum())

    @property
    def precision(self) -> Array:
        return np.full(len(self.expected), self.sd**-2)

    def at(self, x: Array) -> Spread:
        loads, by = _shares(x, np.eye(len(x)))
        return Spread(self.places, loads, by, None)


@dataclass(frozen=True, eq=False)
class Density(AbstractPressure):
    """A smooth density over the face and along the rim: a Gaussian process of its logarithm, and how much the rim
    bears. The first numbers are along the process' widest ways, the last is the logarithm of rim by face."""

    outline: Outline
    name: str = "density"

    @property
    def mean(self) -> Array:
        return np.zeros(self._ways.shape[1] + 1)

    @property
    def precision(self) -> Array:
        return np.append(np.ones(self._ways.shape[1]), SD_RIM**-2)

    def at(self, x: Array) -> Spread:
        face = len(self._base[1]) - self._rim
        by = np.column_stack([self._ways, np.arange(len(self._ways)) >= face])
        loads, slopes = _shares(np.log(self._base[1]) + by @ x, by)
        return Spread(self._base[0], loads, slopes, None)

    @cached_property
    def _base(self) -> tuple[Array, Array]:
        """Places, and loads of a uniform face beside a uniform rim of the same load."""
        solid, rim = (support.pressure for support in (_face(self.outline), _edge(self.outline)))
        centres = _face(self.outline).centre, _edge(self.outline).centre
        parts = patches(solid, FACE), patches(rim, RIM)
        places = np.concatenate([p.points + c for p, c in zip(parts, centres, strict=True)])
        return places, np.concatenate([p.loads for p in parts])

    @cached_property
    def _rim(self) -> int:
        return len(patches(_edge(self.outline).pressure, RIM).loads)

    @cached_property
    def _ways(self) -> Array:
        p = self._base[0]
        apart = np.linalg.norm(p[:, None] - p[None], axis=2) / (ALIKE * self.outline.size)
        values, vectors = np.linalg.eigh(SD_DENSITY**2 * np.exp(-0.5 * apart**2))
        return vectors[:, -WAYS:][:, ::-1] * np.sqrt(np.maximum(values[-WAYS:][::-1], 0.0))


@dataclass(frozen=True, eq=False)
class FreeFeet(AbstractPressure):
    """So many feet anywhere; the numbers are the logarithms of their loads, then x and y of each by the size."""

    outline: Outline
    count: int

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"{self.count} feet"

    @property
    def ways(self) -> float:
        return lgamma(self.count + 1)  # feet in any order

    @property
    def mean(self) -> Array:
        return np.concatenate([np.full(self.count, -np.log(self.count)), np.tile(self._middle, self.count)])

    @property
    def precision(self) -> Array:
        return np.repeat([SD_FREE**-2, SD_PLACE**-2], [self.count, 2 * self.count])

    @property
    def _middle(self) -> Array:
        return np.asarray(self.outline.centroid / self.outline.size)

    def at(self, x: Array) -> Spread:
        k, size = self.count, self.outline.size
        loads, by = _shares(x[:k], np.eye(k))
        moves = np.zeros((k, 2, 3 * k))
        for i in range(k):
            moves[i, 0, k + 2 * i] = moves[i, 1, k + 2 * i + 1] = size
        by = np.column_stack([by, np.zeros((k, 2 * k))])
        return Spread(size * x[k:].reshape(k, 2), loads, by, moves)

    def numbers(self, places: Array, loads: Array) -> Array:
        """The numbers of given feet."""
        return np.concatenate([np.log(np.maximum(loads, 1e-3)), (places / self.outline.size).ravel()])


def _face(outline: Outline) -> Support:
    if outline.is_circle:
        return Support.disc(outline.radius, outline.centre)
    return Support.polygon(outline.vertices)


def _edge(outline: Outline) -> Support:
    if outline.is_circle:
        return Support.ring(outline.radius, outline.centre)
    return Support.outline(outline.vertices)
