"""How well models of friction predict twists that they were not fitted to, and which weights a fit should have.

Weights are chosen inside each training part, by a cross-validation of its own, so that the angles of the pairs left
out are honest: nothing of a pair has touched the fit that predicts it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array
from .exact import Exact
from .fits import fit_ellipsoid, fit_quartic
from .loads import fit_loads
from .pairs import Pairs
from .report import twist_angles

# λ and β of fit_ellipsoid among which a fit chooses.
WEIGHTS = tuple((regularisation, force) for regularisation in (0.001, 0.01) for force in (0.05, 0.2, 1.0))
_RESAMPLES = 2000


ChoiceT = TypeVar("ChoiceT")


class TwistModel(Protocol):
    """What predicts the twist of a wrench."""

    def twist(self, wrench: ArrayLike) -> Array: ...


class AbstractModel(ABC, Generic[ChoiceT]):
    """A kind of model that can be fitted to pairs, with a few choices of its weights.

    Laws: fit depends on the pairs and the choice alone; choices is not empty, its first entry is the default.
    """

    name: str
    needed: int
    choices: tuple[ChoiceT, ...]

    @abstractmethod
    def fit(self, pairs: Pairs, choice: ChoiceT) -> TwistModel:
        """The fitted model."""


@dataclass(frozen=True)
class Smooth(AbstractModel[tuple[float, float]]):
    """An ellipsoid or a convex quartic; a choice is (λ, β)."""

    name: Literal["ellipsoid", "quartic"]
    choices: tuple[tuple[float, float], ...] = WEIGHTS

    @property
    def needed(self) -> int:  # type: ignore[override]
        return 6 if self.name == "ellipsoid" else 15

    def fit(self, pairs: Pairs, choice: tuple[float, float]) -> TwistModel:
        fit = fit_ellipsoid if self.name == "ellipsoid" else fit_quartic
        return fit(pairs.wrenches, pairs.twists, regularisation=choice[0], force_weight=choice[1])


@dataclass(frozen=True, eq=False)
class Loads(AbstractModel[float]):
    """Coulomb friction at known places with fitted loads (fit_loads); a choice is the trust in the nominal ones."""

    places: Array
    parts: Array
    nominal: Array
    name: str = "loads"
    choices: tuple[float, ...] = (0.0, 0.5, 1.0)

    @property
    def needed(self) -> int:  # type: ignore[override]
        return self.parts.shape[1] + 1

    def fit(self, pairs: Pairs, choice: float) -> TwistModel:
        found = fit_loads(
            pairs.wrenches, pairs.twists, self.places, self.parts, nominal=self.nominal, trust=choice
        )
        return found.surface


@dataclass(frozen=True, eq=False)
class Known(AbstractModel[None]):
    """The exact surface of a support that no data were asked about."""

    surface: Exact
    name: str = "untrained"
    needed: int = 0
    choices: tuple[None, ...] = (None,)

    def fit(self, pairs: Pairs, choice: None = None) -> TwistModel:
        return self.surface


@dataclass(frozen=True, eq=False)
class Judgement:
    """Predictions of the pairs left out.

    Attributes:
        name: of the model.
        twists: predicted, of length 1 in the coordinates (v, length · ω), shape (seeds, n, 3).
        angles: between them and the measured ones, shape (seeds, n) [rad].
        length: the characteristic length of the angles [m].
    """

    name: str
    twists: Array
    angles: Array
    length: float

    @property
    def mean(self) -> float:
        """Mean angle [rad]."""
        return float(np.mean(self.angles))

    @property
    def median(self) -> float:
        """Median angle [rad]."""
        return float(np.median(self.angles))


def judge(
    pairs: Pairs, model: AbstractModel, *, length: float, folds: int = 5, seeds: Sequence[int] = (0, 1)
) -> Judgement:
    """Predicts every pair once per seed, by a fit to the other folds.

    Args:
        length: the characteristic length of the angles [m].
        folds: parts into which the shuffled pairs are cut, at least 2.
        seeds: of the shuffles.

    Raises:
        InputError: if there are too few pairs, with the number needed.
    """
    needed = least_pairs(model, folds)
    if len(pairs) < needed:
        raise InputError(
            f"{folds}-fold cross-validation of a {model.name} needs at least {needed} pairs",
            source=pairs.name,
            value=len(pairs),
            hint="Take more pushes or fewer folds.",
        )
    units = np.array([1.0, 1.0, length])
    predicted = np.empty((len(seeds), len(pairs), 3))
    for s, seed in enumerate(seeds):
        for left_out in parts_of(len(pairs), folds, seed):
            training = pairs[np.setdiff1d(np.arange(len(pairs)), left_out)]
            fitted = model.fit(training, choose(training, model, length=length, folds=folds, seed=seed))
            predicted[s, left_out] = fitted.twist(pairs.wrenches[left_out])
    predicted *= units
    predicted /= np.linalg.norm(predicted, axis=2, keepdims=True)
    return _judgement(model.name, predicted, pairs, length)


def blended(name: str, judgements: Sequence[Judgement], pairs: Pairs) -> Judgement:
    """What the mean of several models' unit twists predicts."""
    twists = np.sum([j.twists for j in judgements], axis=0)
    twists = twists / np.linalg.norm(twists, axis=2, keepdims=True)
    return _judgement(name, twists, pairs, judgements[0].length)


def choose(
    pairs: Pairs, model: AbstractModel[ChoiceT], *, length: float, folds: int = 5, seed: int = 0
) -> ChoiceT:
    """The choice of a model's weights with the least mean angle in a cross-validation of these pairs."""
    if len(model.choices) == 1:
        return model.choices[0]
    errors = np.zeros(len(model.choices))
    for left_out in parts_of(len(pairs), folds, seed + 1_000_003):
        training = pairs[np.setdiff1d(np.arange(len(pairs)), left_out)]
        for k, choice in enumerate(model.choices):
            twists = model.fit(training, choice).twist(pairs.wrenches[left_out])
            errors[k] += np.sum(twist_angles(twists, pairs.twists[left_out], length))
    return model.choices[int(np.argmin(errors))]


def least_pairs(model: AbstractModel, folds: int) -> int:
    """How many pairs leave the model enough of them in the training part of a training part."""
    if folds < 2:
        raise InputError("a cross-validation has at least 2 folds", value=folds)
    levels = 2 if len(model.choices) > 1 else 1
    n = folds
    while True:
        left = n
        for _ in range(levels):
            left -= -(-left // folds)
        if left >= model.needed:
            return n
        n += 1


def parts_of(n: int, folds: int, seed: int) -> list[Array]:
    """The numbers below n, shuffled and cut into parts of nearly equal size."""
    return np.array_split(np.random.default_rng(seed).permutation(n), folds)


def interval(judgements: Sequence[Judgement], statistic: Callable[..., Array]) -> tuple[float, float]:
    """95 % confidence interval of a statistic, averaged over experiments [rad].

    Percentiles over resampled pairs, each experiment for itself; a pair keeps the angles of all its seeds.
    """
    rng = np.random.default_rng(0)
    total = np.zeros(_RESAMPLES)
    for judgement in judgements:
        n = judgement.angles.shape[1]
        drawn = judgement.angles[:, rng.integers(n, size=(_RESAMPLES, n))]  # (seeds, resamples, n)
        total += statistic(drawn, axis=(0, 2))
    low, high = np.percentile(total / len(judgements), [2.5, 97.5])
    return float(low), float(high)


def _judgement(name: str, twists: Array, pairs: Pairs, length: float) -> Judgement:
    units = np.array([1.0, 1.0, length])
    angles = np.array([twist_angles(one / units, pairs.twists, length) for one in twists])
    return Judgement(name, twists, angles, length)
