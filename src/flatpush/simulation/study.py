"""Many disturbed runs of one plan, and how their ends are distributed."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..geometry import wrap_angle
from ..geometry.pose import Array
from ..problem import Plan
from ..problem.scene import Model
from .noise import Disturbances, Noise
from .pieces import Source
from .rollout import roll

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_CHUNK = 50  # runs; how a study is cut up changes no number of it
Spread = Callable[[Callable[["Chunk"], "Runs"], Sequence["Chunk"]], Iterable["Runs"]]


@dataclass(frozen=True, eq=False)
class Chunk:
    """Some runs of a study, by their numbers; all that a worker needs."""

    plan: Plan
    numbers: range
    seed: int
    noise: Noise
    model: Model
    source: Source
    record: bool


@dataclass(frozen=True, eq=False)
class Runs:
    """Disturbed runs of one plan.

    Attributes:
        plan: the plan.
        seed: number behind all draws; run k draws from the stream (seed, k), however many runs there are and wherever
            they run.
        noise: how much was drawn.
        starts: X_WO where each run began, shape (n, 3).
        frictions: coefficients between finger and object, shape (n,).
        centres: of friction, in O, shape (n, 2) [m].
        final: X_WO where each run ended, shape (n, 3).
        outcomes: as of a rollout, n words.
        sticking: whether all fingers stuck from the first touch of each push to its end, shape (n,).
        object: X_WO at the samples of the plan, shape (n, m, 3), nan after the end of a run; None if not recorded.
    """

    plan: Plan
    seed: int
    noise: Noise
    starts: Array
    frictions: Array
    centres: Array
    final: Array
    outcomes: tuple[str, ...]
    sticking: Array
    object: Array | None = None

    def __len__(self) -> int:
        return len(self.final)

    @property
    def mean(self) -> Array:
        """Mean final pose, shape (3,); the angle's mean direction."""
        angle = np.arctan2(np.mean(np.sin(self.final[:, 2])), np.mean(np.cos(self.final[:, 2])))
        return np.array([*np.mean(self.final[:, :2], axis=0), angle])

    @property
    def covariance(self) -> Array:
        """Of the final poses (x, y, θ about the mean direction), shape (3, 3); of one run zeros."""
        away = self.final - self.mean
        away[:, 2] = wrap_angle(away[:, 2])
        return away.T @ away / max(1, len(away) - 1)

    @property
    def sticking_share(self) -> float:
        """The share of runs in which nothing slid, 0 to 1."""
        return float(np.mean(self.sticking))

    @property
    def errors(self) -> Array:
        """Distance and angle off the goal, shape (n, 2) [m, rad]."""
        errors = np.array([self.plan.scene.goal_error(pose) for pose in self.final])
        return np.stack([np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])], axis=1)

    def quantiles(self, shares: Sequence[float] = QUANTILES) -> dict[str, Array]:
        """Of x, y, θ (about the mean direction), and of distance and angle off the goal, each shape (len(shares),)."""
        mean = self.mean
        angles = mean[2] + wrap_angle(self.final[:, 2] - mean[2])
        columns = {"x": self.final[:, 0], "y": self.final[:, 1], "angle": angles}
        columns |= {"distance": self.errors[:, 0], "turn": self.errors[:, 1]}
        return {name: np.quantile(column, shares) for name, column in columns.items()}


def study(
    plan: Plan,
    runs: int,
    seed: int = 0,
    *,
    noise: Noise | None = None,
    model: Model = "exact",
    source: Source = "arcs",
    record: bool = False,
    spread: Spread = map,
) -> Runs:
    """Rolls a plan out many times, each time a little different from what it assumed.

    Args:
        runs: how many, at least 1.
        seed: the number that all draws follow from; run k draws from the stream (seed, k) alone.
        noise: what is drawn; default: Noise().
        model, source: as of simulate.
        record: keep the whole way of the object.
        spread: applies a function to a list of chunks, here or on other processes; the numbers are the same.

    Raises:
        InputError: for no run at all, for a plan without a solution, or noise that this object has not.
    """
    if runs < 1:
        raise InputError("a study has at least 1 run", value=runs)
    if seed < 0:
        raise InputError("a seed is 0 or more", value=seed)
    plan.check_motion()
    chosen = Noise() if noise is None else noise
    Disturbances(plan.scene, chosen, model)  # refuses here what no worker should be asked
    chunks = [
        Chunk(plan, range(k, min(k + _CHUNK, runs)), seed, chosen, model, source, record)
        for k in range(0, runs, _CHUNK)
    ]
    return together(plan, list(spread(run_chunk, chunks)))


def run_chunk(chunk: Chunk) -> Runs:
    """The runs of a chunk."""
    disturbances = Disturbances(chunk.plan.scene, chunk.noise, chunk.model)
    scenes = [disturbances.scene_of(chunk.seed, k) for k in chunk.numbers]
    rolled = roll(chunk.plan, scenes, disturbances.model_of(), chunk.source)
    return Runs(
        chunk.plan,
        chunk.seed,
        chunk.noise,
        np.array([scene.start for scene in scenes], dtype=float),
        np.array([scene.object.friction for scene in scenes]),
        np.array([scene.object.cof for scene in scenes]),
        rolled.final,
        rolled.outcomes,
        rolled.sticking,
        rolled.object if chunk.record else None,
    )


def together(plan: Plan, parts: Sequence[Runs]) -> Runs:
    """The runs of several chunks, recorded if those of the first are."""

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    arrays = {name: joined(name) for name in ("starts", "frictions", "centres", "final", "sticking")}
    return Runs(
        plan,
        parts[0].seed,
        parts[0].noise,
        outcomes=tuple(outcome for part in parts for outcome in part.outcomes),
        object=None if parts[0].object is None else joined("object"),
        **arrays,
    )
