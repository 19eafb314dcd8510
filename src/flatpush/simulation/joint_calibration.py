"""Calibration from contacts and ends together, judged on starts that were left out.

Every run gives two kinds of residuals: the contact (each finger a tip radius from the outline, the object still in the
hand) and the measured ends of its pushes against the simulated ones. One weighted fit takes both. The derivatives of
each run are kept, so that leaving a start out costs a few rounds with these instead of a search of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..geometry import wrap_angle
from ..geometry.pose import Array
from .calibration import (
    CAMERA,
    FRICTION,
    INSET,
    SHIFT,
    STICKING,
    TAG,
    Parameters,
    Setup,
    contact_calibration,
    contact_gaps,
    contact_stretches,
    distances,
    measured_ends,
    shared_parameters,
)
from .replay import Recording, errors

# Standard deviations [mm]: of a contact over a stretch, of the end of a run, and of the ends of earlier pushes.
CONTACT, END, INNER_END = 0.25, 0.4, 0.8
# What a millimetre is held to be worth in turn: this lever [m], twice that of the ends alone, as tags see angles well.
LEVER = 0.06
# Residuals beyond so many of these count less (Cauchy).
SOFT = 2.0
# How strongly the nominal values hold, in parts of the scales of the numbers.
PULL = 0.3
_STEP, _ROUNDS, _CHORDS = 0.02, 2, 2


@dataclass(frozen=True, eq=False)
class Calibration:
    """What runs told, and how well that predicts runs from starts that it has not seen.

    Attributes:
        parameters: fitted to all runs.
        sd: standard deviations of camera (6,), each tag (3 each), inset and friction, in their units, in this order.
        left_out: distance [m] and angle [rad] at the end of each run (n, 2), predicted by the runs from other starts,
            with what the camera saw around landings; empty if all runs begin at one.
        first_pose: the same where of the camera only the first pose of each run is used.
        starts: object and start of each run.
    """

    parameters: Parameters
    sd: Array
    left_out: Array
    first_pose: Array
    starts: tuple[tuple[str, str], ...]


def calibrate(recordings: Sequence[Recording], setup: Setup) -> Calibration:
    """Camera, tags, inset of the fingers and friction from contacts and ends; the lag from the contacts alone.

    Raises:
        InputError: if a run is of an object that the setup does not know, or none is long enough.
    """
    for one in recordings:
        if one.run.object not in setup.objects:
            raise InputError(
                "a run is of an object that no scene describes",
                value=one.run.object,
                hint=f"Known: {', '.join(setup.objects)}.",
            )
    fit = _Fit(recordings, setup, contact_calibration(recordings, setup))
    every = np.ones(len(recordings), dtype=bool)
    x = fit.begin
    for _ in range(_ROUNDS):
        jacobian = fit.jacobian(x)
        x = fit.improved(x, jacobian, every)
    blocks = fit.residuals(x)
    covariance = np.linalg.inv(fit.normal(blocks, jacobian, every, x)[0])
    starts = tuple((one.run.object, one.run.start) for one in recordings)
    groups = sorted(set(starts))
    left, alone = (np.zeros((len(recordings) if len(groups) > 1 else 0, 2)) for _ in range(2))
    for group in groups if len(groups) > 1 else []:
        out = np.array([start == group for start in starts])
        p = fit.parameters(fit.chords(x, blocks, jacobian, ~out))
        for k in np.flatnonzero(out).tolist():
            one = recordings[k]
            seen = p.registration(setup, one.run.object).poses(one.final)
            left[k] = errors(p.replay(setup, one, landings=True).final, seen)
            alone[k] = errors(p.replay(setup, one).final, seen)
    return Calibration(fit.parameters(x), fit.scales * np.sqrt(np.diag(covariance)), left, alone, starts)


class _Fit:
    """Gauss and Newton's method on blocks of residuals, one for each run."""

    def __init__(self, recordings: Sequence[Recording], setup: Setup, contacts: Parameters) -> None:
        self.recordings, self.setup, self.lag = recordings, setup, contacts.lag
        self.outlines = distances(setup)
        self.stretches = [contact_stretches(one) for one in recordings]
        self.tags = setup.tag_names
        self.scales = np.concatenate(
            [[CAMERA] * 4, [SHIFT] * 2, np.tile(TAG, len(self.tags)), [INSET, FRICTION]]
        )
        self.begin = np.zeros(len(self.scales))
        self.begin[:6] = contacts.camera / self.scales[:6]
        self.begin[6:-2] = np.ravel([contacts.tags.get(tag, np.zeros(3)) / TAG for tag in self.tags])

    def parameters(self, x: Array) -> Parameters:
        friction = max(0.05, STICKING + FRICTION * float(x[-1]))
        shared = shared_parameters(x, self.tags)
        return replace(shared, inset=INSET * float(x[-2]), friction=friction, lag=self.lag)

    def residuals(self, x: Array, which: np.ndarray | None = None) -> list[Array]:
        """Of each run, in standard deviations; of the others nothing."""
        p = self.parameters(x)
        found = []
        for k, one in enumerate(self.recordings):
            if which is not None and not which[k]:
                found.append(np.empty(0))
                continue
            name = one.run.object
            parts = [contact_gaps(s, p, self.setup, self.outlines[name]) / CONTACT for s in self.stretches[k]]
            ends = np.array([poses[-1] for poses in p.replay(self.setup, one).poses])
            ends = ends - p.registration(self.setup, name).poses(measured_ends(one))
            ends[:, 2] = LEVER * wrap_angle(ends[:, 2])
            ends[:-1] /= INNER_END
            ends[-1] /= END
            found.append(np.concatenate([*parts, 1000 * np.nan_to_num(ends).ravel()]))
        return found

    def jacobian(self, x: Array) -> list[Array]:
        """Derivatives of the residuals of each run, (residuals, numbers)."""
        here, columns = self.residuals(x), []
        for k in range(len(x)):
            step = np.zeros(len(x))
            step[k] = _STEP
            columns.append([(a - b) / _STEP for a, b in zip(self.residuals(x + step), here, strict=True)])
        return [np.stack(run, axis=1) for run in zip(*columns, strict=True)]

    def normal(
        self, blocks: list[Array], jacobian: list[Array], used: np.ndarray, x: Array
    ) -> tuple[Array, Array]:
        """Normal matrix and right side of the runs used."""
        H, g = PULL**2 * np.eye(len(x)), -(PULL**2) * x
        for k in np.flatnonzero(used):
            weights = 1 / (1 + (blocks[k] / SOFT) ** 2)
            H += jacobian[k].T @ (weights[:, None] * jacobian[k])
            g -= jacobian[k].T @ (weights * blocks[k])
        return H, g

    def cost(self, blocks: list[Array], x: Array) -> float:
        lost = sum(float(np.sum(np.log1p((block / SOFT) ** 2))) for block in blocks)
        return 0.5 * SOFT**2 * lost + 0.5 * PULL**2 * float(x @ x)

    def improved(self, x: Array, jacobian: list[Array], used: np.ndarray) -> Array:
        """A step that makes the fit better; the same numbers if none does."""
        blocks = self.residuals(x)
        H, g = self.normal(blocks, jacobian, used, x)
        step = np.linalg.solve(H, g)
        before = self.cost(blocks, x)
        for share in (1.0, 0.4, 0.1):
            if self.cost(self.residuals(x + share * step), x + share * step) < before:
                return np.asarray(x + share * step)
        return x

    def chords(self, x: Array, blocks: list[Array], jacobian: list[Array], used: np.ndarray) -> Array:
        """The numbers for the runs used, from those for all, by rounds with the same derivatives."""
        for k in range(_CHORDS):
            H, g = self.normal(blocks, jacobian, used, x)
            x = x + np.linalg.solve(H, g)
            if k + 1 < _CHORDS:
                blocks = self.residuals(x, used)
        return x
