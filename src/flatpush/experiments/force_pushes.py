"""Limit surfaces fitted to the recorded force pushes, judged on pushes left out.

Each experiment is fifty pushes of one triangular block (legs 150 mm) on hardboard or plywood, on three feet or on
its whole face, with the force measured at the pusher. Weights are chosen inside every training part.
"""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..friction import Exact, LimitSurface, Support
from ..friction.cross_validation import Judgement, Known, Loads, Smooth, blended, choose, judge
from ..friction.loads import equilibrium, radial_parts
from ..friction.pairs import Pairs
from ..geometry import Outline
from ..geometry.pose import Array

LENGTH = 0.05 * np.sqrt(2)  # [m], the one with which these data were published
# Feet in mm from the right-angle corner, along the legs; the centre of mass is at (50, 50).
FEET_MM = {
    "3pts1": [(30, 30), (63.33, 43.33), (43.33, 63.33)],
    "3pts2": [(10, 10), (10, 130), (130, 10)],
    "3pts3": [(30, 30), (90, 30), (30, 90)],
    "3pts4": [(10, 10), (90, 30), (10, 130)],
}
FACE_MM = [(0, 0), (150, 0), (0, 150)]
SEEDS = (0, 1)
FOLDS = 5


def run(folder: Path | None = None, data: Path = Path()) -> str:
    """The table, and with a folder force_pushes.svg, force_pushes_surface.svg in it."""
    from ..view.angle_table import angle_table

    judged = {pairs.name: judgements(pairs) for pairs in recorded(data)}
    wins = sum(row["quartic"].mean < row["ellipsoid"].mean for row in judged.values())
    power = sum(pairs.against for pairs in recorded(data))
    lines = [
        f"Angle between predicted and measured twist, ω times {1000 * LENGTH:.1f} mm; {FOLDS} folds, seeds"
        f" {', '.join(map(str, SEEDS))}, weights chosen inside each training part.",
        angle_table(judged),
        f"quartic better than ellipsoid in {wins} of {len(judged)}; wrenches that oppose their twist: {power}",
        "loads: Coulomb friction at the known feet (face: radial density), loads fitted; untrained: the same feet with"
        " the loads of static equilibrium, no data; mean: of the unit twists of quartic and loads.",
    ]
    if folder is not None:
        _draw(folder, data, judged)
    return "\n".join(lines)


def recorded(data: Path) -> tuple[Pairs, ...]:
    """The experiments in the folder of recorded data, in the order of their names."""
    from ..documents import load_pairs

    folder = data / "icra_sensor" if (data / "icra_sensor").is_dir() else data
    files = [path for path in sorted(folder.glob("pushes_*.csv")) if path.stem != "pushes_all"]
    if not files:
        raise InputError(
            "there are no recorded force pushes", source=str(folder), hint="They are files pushes_….csv."
        )
    return tuple(pairs for path in files for pairs in load_pairs(path).experiments)


def judgements(pairs: Pairs, seeds: tuple[int, ...] = SEEDS) -> dict[str, Judgement]:
    """What every model predicts for the pushes of one experiment that it was not fitted to."""
    places = known_places(pairs.name)
    models: tuple[Smooth | Loads, ...] = (Smooth("ellipsoid"), Smooth("quartic"), Loads(*places))
    found = {model.name: judge(pairs, model, length=LENGTH, folds=FOLDS, seeds=seeds) for model in models}
    found["mean"] = blended("mean", [found["quartic"], found["loads"]], pairs)
    if not pairs.name.endswith("patch"):
        model = Known(Exact(Support.points(places[0], places[2])))
        found[model.name] = judge(pairs, model, length=LENGTH, folds=FOLDS, seeds=seeds[:1])
    return found


def known_places(name: str) -> tuple[Array, Array, Array]:
    """Places about the centre of mass, parts and nominal shares of an experiment, by its pressure's name."""
    pressure = name.split()[-1]
    if pressure in FEET_MM:
        places = np.array(FEET_MM[pressure]) / 1000 - 0.05
        return places, np.eye(3), equilibrium(places)
    return radial_parts(Outline.polygon(np.array(FACE_MM) / 1000 - 0.05))


def _draw(folder: Path, data: Path, judged: dict[str, dict[str, Judgement]]) -> None:
    from ..friction import fit_ellipsoid, fit_loads, fit_quartic, sized
    from ..view.angle_figure import angle_figure
    from ..view.surface_figure import surface_figure

    angle_figure(
        judged,
        folder / "force_pushes.svg",
        title="Recorded force pushes: how far predicted twists are off",
        subtitle=f"pushes left out in {FOLDS}-fold cross-validation, seeds {', '.join(map(str, SEEDS))};"
        " weights chosen inside each training part",
    )
    for pairs in recorded(data):
        if pairs.name != "hardboard 3pts2":
            continue
        places, parts, nominal = known_places(pairs.name)
        smooth: dict[str, tuple[LimitSurface, float]] = {}
        for model in (Smooth("quartic"), Smooth("ellipsoid")):
            lam, beta = choose(pairs, model, length=LENGTH, folds=FOLDS)
            fit = fit_quartic if model.name == "quartic" else fit_ellipsoid
            fitted = fit(pairs.wrenches, pairs.twists, regularisation=lam, force_weight=beta)
            smooth[model.name] = (sized(fitted, pairs.wrenches), 1.0)
        loads = fit_loads(pairs.wrenches, pairs.twists, places, parts, nominal=nominal, trust=0.5)
        surface_figure(
            {**smooth, "loads": (loads.surface, loads.resistance)},
            pairs,
            LENGTH,
            folder / "force_pushes_surface.svg",
            title=f"Limit surfaces of {pairs.name}, {len(pairs)} pushes",
            subtitle="in space: the quartic with all pushes; ℓ = 70.7 mm",
        )
