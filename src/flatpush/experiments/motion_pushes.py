"""The recorded force pushes without their forces: loads and friction from the poses of block and finger alone.

The first contact is where the finger's straight way meets the block at rest, the last where it meets the block's final
outline. Judged on pushes left out: finger → twist (the plant moves the block as the finger goes), and wrench → twist,
beside loads fitted to the forces of the same training pushes.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..friction import Exact, Support, fit_loads
from ..friction.cross_validation import parts_of
from ..friction.pairs import Pairs
from ..friction.report import twist_angles
from ..geometry import Outline, relative, transform, wrap_angle
from ..geometry.pose import Array
from ..identification.fit import fit_seen
from ..identification.motion import PLACES, Stretches, seen_of
from ..problem import Object
from ..simulation.plant import Plant
from .force_pushes import FACE_MM, FOLDS, LENGTH, known_places

NOISE = (0.0003, float(np.deg2rad(0.3)))  # of a pose before or after a push
# Twists of real pushes scatter by 6°, whatever their length: in place, and in angle over half of the block [rad/m].
SCATTER = (0.1, 2.0)
EXPECTED_FRICTION = 0.35
NAMES = (
    *(
        "x0",
        "y0",
        "theta0",
        "x1",
        "y1",
        "theta1",
        "robot_x_first",
        "robot_y_first",
        "robot_x_last",
        "robot_y_last",
    ),
    *("Fx", "Fy", "tau", "dx_body", "dy_body", "dtheta"),
)


@dataclass(frozen=True, eq=False)
class Pushes:
    """Pushes of one experiment.

    Attributes:
        stretches: with the finger's way. ways: the finger's way as the robot went it, from the first contact on,
            (n, PLACES, 2). pairs: wrenches and twists.
    """

    stretches: Stretches
    ways: Array
    pairs: Pairs


@dataclass(frozen=True, eq=False)
class Judged:
    """Angles between predicted and measured twist of pushes left out [rad], and the friction of the finger.

    Attributes:
        finger, wrench: from loads that motion told. finger_by_forces, wrench_by_forces: from loads that forces told.
        friction: of each fold.
    """

    finger: Array
    finger_by_forces: Array
    wrench: Array
    wrench_by_forces: Array
    friction: Array


def run(_folder_of_figures: Path | None = None, data: Path = Path()) -> str:
    """The table over the experiments on three known feet; there is no figure."""
    lines = [
        "Angle between predicted and measured twist of pushes left out [°], mean (median): by motion, by forces.",
        f"{'':18}{'finger → twist':>30}{'wrench → twist':>30}{'μ':>8}",
    ]
    every = []
    for name in experiments(data):
        judged = judge_motion(read(data, name), name)
        every.append(judged)
        lines.append(_line(name.replace("_", " "), [judged]))
    lines.append(_line("mean", every))
    return "\n".join(lines)


def _line(name: str, judged: list[Judged]) -> str:
    def both(angles: list[Array]) -> str:
        mean, middle = (np.rad2deg(np.mean([f(a) for a in angles])) for f in (np.mean, np.median))
        return f"{mean:.1f} ({middle:.1f})"

    cells = [
        f"{both([j.finger for j in judged])}, {both([j.finger_by_forces for j in judged])}",
        f"{both([j.wrench for j in judged])}, {both([j.wrench_by_forces for j in judged])}",
    ]
    return (
        f"{name:18}"
        + "".join(f"{c:>30}" for c in cells)
        + f"{np.mean([j.friction.mean() for j in judged]):8.2f}"
    )


def experiments(data: Path) -> list[str]:
    """Names of the experiments on three feet."""
    files = sorted(_folder(data).glob("pushes_*_3pts*.csv"))
    if not files:
        raise InputError(
            "there are no recorded pushes", source=str(data), hint="They are files pushes_….csv."
        )
    return [path.stem.removeprefix("pushes_") for path in files]


def _folder(data: Path) -> Path:
    return data / "icra_sensor" if (data / "icra_sensor").is_dir() else data


def read(data: Path, name: str) -> Pushes:
    """The pushes of an experiment in which the finger's way meets both outlines."""
    path = _folder(data) / f"pushes_{name}.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    table = np.array([[float(row[column]) for column in NAMES] for row in rows])
    outline = _outline()
    kept, tips, ways = [], [], []
    for k, row in enumerate(table):
        begin, end = row[6:8], row[8:10]
        ahead = (end - begin) / np.hypot(*(end - begin))
        first, last = (_meets(outline, pose, begin - 0.02 * ahead, ahead) for pose in (row[:3], row[3:6]))
        if first is None or last is None or (last - first) @ ahead < 1e-3:
            continue
        kept.append(k)
        share = np.linspace(0, 1, PLACES)[:, None]
        tips.append(first + share * (last - first))
        ways.append(first + share * max(float((end - first) @ ahead), 1e-3) * ahead)
    t = table[kept]
    stretches = Stretches(t[:, :3], t[:, 3:6], np.ones((len(t), 2)), np.array(tips), np.arange(len(t)))
    return Pushes(stretches, np.array(ways), Pairs(t[:, 10:13], t[:, 13:16], name))


def judge_motion(pushes: Pushes, name: str, seed: int = 0) -> Judged:
    """Every push predicted once, by what the other folds told."""
    places, parts, nominal = known_places(name.replace("_", " "))
    thing = Object(_outline(), Support.points(places, nominal), EXPECTED_FRICTION)
    n = len(pushes.ways)
    found = {key: np.zeros(n) for key in ("finger", "finger_by_forces", "wrench", "wrench_by_forces")}
    frictions = []
    for out in parts_of(n, FOLDS, seed):
        rest = np.setdiff1d(np.arange(n), out)
        train = Stretches(*(column[rest] for column in pushes.stretches))
        fit = fit_seen(seen_of(train, thing.outline, 0.0, NOISE, SCATTER), thing, 0.0)
        frictions.append(fit.thing.friction)
        forces = fit_loads(
            pushes.pairs[rest].wrenches, pushes.pairs[rest].twists, places, parts, nominal=nominal, trust=0.5
        )
        by_forces = Object(thing.outline, forces.support, 0.5)
        true = pushes.pairs.twists[out]
        for key, one in (("finger", fit.thing), ("finger_by_forces", by_forces)):
            found[key][out] = twist_angles(_moved(one, pushes, out), true, LENGTH)
        for key, support in (("wrench", fit.thing.support), ("wrench_by_forces", by_forces.support)):
            found[key][out] = twist_angles(Exact(support).twist(pushes.pairs.wrenches[out]), true, LENGTH)
    return Judged(**found, friction=np.array(frictions))


def _moved(thing: Object, pushes: Pushes, which: Array) -> Array:
    """Displacements in the first frame, as the finger goes (n, 3)."""
    starts = pushes.stretches.starts[which]
    hands = np.concatenate([pushes.ways[which], np.zeros((len(starts), PLACES, 1))], axis=2)
    final = Plant(thing, [[0.0, 0.0]], 0.0).many(starts, hands, threads=1).final
    step = relative(starts, final)
    return np.column_stack([step[:, :2], wrap_angle(step[:, 2])]) + 1e-12


def _meets(outline: Outline, pose: Array, begin: Array, ahead: Array) -> Array | None:
    """Where a straight way first meets the outline at a pose."""
    from shapely import LinearRing, LineString, Point, intersection

    corners = transform(pose, outline.vertices)
    met = intersection(LineString([begin, begin + 0.1 * ahead]), LinearRing(corners))
    points = [g for g in getattr(met, "geoms", [met]) if isinstance(g, Point) and not g.is_empty]
    if not points:
        return None
    places = np.array([[p.x, p.y] for p in points])
    return np.asarray(places[np.argmin((places - begin) @ ahead)])


def _outline() -> Outline:
    return Outline.polygon(np.array(FACE_MM) / 1000 - 0.05)
