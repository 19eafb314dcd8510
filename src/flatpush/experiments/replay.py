"""The recorded two-finger runs of [Zhou2017] Figs. 6-9 through the simulator: predicted against measured poses.

Finger positions, outlines and supports are those of the paper and its public toolbox. Every second of the runs
that were given from each start is fitted, the others judged, and then the other way round.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..documents.robot_log import RobotRun, load_robot_log
from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Object
from ..simulation.calibration import Parameters, Setup, contact_calibration, fit_to_ends
from ..simulation.joint_calibration import calibrate
from ..simulation.replay import Recording, Replayed, errors, rigid, trajectory_errors

GOAL = np.array([0.0, -0.3175, 0.0])
RECTANGLE = np.array([[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]]) / 1000
TRIANGLE = np.array([[58 / 3, -27.5 / 3], [58 / 3, 55 / 3], [-116 / 3, -27.5 / 3]]) / 1000
FINGERS, TIP_RADIUS = np.array([[0.0, 0.009], [0.0, -0.009]]), 0.0025
NAMES = ("bigrect_3pts", "bigrect_ridge", "butter", "tri")
WORDS = ("rectangle on 3 points", "rectangle on a ridge", "butterfly", "triangle")
# The butterfly's outline is drawn with 636 corners; so far [m] fewer may be off.
SMOOTH = 2e-5
# Friction where none is fitted. As it is drawn, the butterfly slips off the fingers at 0.5; the robot's did not.
FRICTION = {"bigrect_3pts": 0.5, "bigrect_ridge": 0.5, "butter": 1.0, "tri": 0.5}
ASSUMED = "simulated, μ 0.5 (butterfly 1)"


@dataclass(frozen=True, eq=False)
class Case:
    """One way to predict the runs.

    Attributes:
        title: for the table. fitted: what was fitted, and on which runs.
        names: of the runs, by object. final: distance [m] and angle [rad] at the end of each run, shape (n, 2).
        way: means of the same over all rows of each run, shape (n, 2); nan where only ends are predicted.
        lost: runs in which an object left the fingers altogether, or was never touched in a stroke.
    """

    title: str
    fitted: str
    names: tuple[str, ...]
    final: Array
    way: Array
    lost: int = 0

    def of(self, names: Iterable[str]) -> Array:
        """The errors at the end of the runs of some objects."""
        return self.final[np.isin(self.names, list(names))]


def run(folder: Path | None = None, data: Path = Path()) -> str:
    """The table, and with a folder replay.svg in it."""
    recordings, setup = recorded(data)
    found = list(cases(recordings, setup))
    if folder is not None:
        draw(found, folder / "replay.svg")
    return table(found)


def draw(found: Iterable[Case], path: Path) -> None:
    """Every run of every prediction as a dot."""
    from ..view.replay_figure import ReplayRow, replay_figure

    rows = [
        ReplayRow(
            f"{case.title}\nfitted: {case.fitted}",
            tuple(WORDS[NAMES.index(name)] for name in case.names),
            np.column_stack([case.final, case.way[:, 0]]),
        )
        for case in found
    ]
    replay_figure(
        rows, WORDS, path,
        title="Recorded pushes of two fingers: predicted against measured",
        subtitle="A dot is a run. No run has a parameter of its own.",
    )  # fmt: skip


def recorded(data: Path) -> tuple[tuple[Recording, ...], Setup]:
    """The runs in the folder of recorded data, and the experiment's setup."""
    folder = data / "robot_exp_logs"
    shape = data / "plan_graph" / "shape_butterfly.csv"
    runs = {name: logged(folder, name) for name in NAMES}
    missing = [f"{folder.name}/log_{name}.csv" for name in NAMES if not runs[name]]
    missing += [] if shape.is_file() else [f"{shape.parent.name}/{shape.name}"]
    if missing:
        raise InputError(
            f"recorded runs are missing: {', '.join(missing)}",
            source=str(data),
            hint=f"Raw logs are read from {folder.name}/OBJECT/START/RUN.txt, as tri/1/1.txt.",
        )
    return tuple(Recording.of(run) for name in NAMES for run in runs[name]), setup(shape)


def logged(folder: Path, name: str) -> list[RobotRun]:
    """The runs of an object: log_NAME.csv, or raw logs NAME/.../RUN.txt, where a folder holds the runs of one start."""
    table = folder / f"log_{name}.csv"
    if table.is_file():
        return list(load_robot_log(table).runs)
    return [
        replace(run, object=name, start=str(path.parent.relative_to(folder / name)), run=path.stem)
        for path in sorted((folder / name).rglob("*.txt"))
        for run in load_robot_log(path).runs
    ]


def setup(butterfly: Path) -> Setup:
    """Objects as they are, not as they were enlarged for planning."""
    import shapely

    drawn = shapely.Polygon(np.loadtxt(butterfly, delimiter=",", skiprows=1)).simplify(SMOOTH)
    outlines = {
        "bigrect_3pts": (RECTANGLE, "outline"),
        "bigrect_ridge": (RECTANGLE, "outline"),
        "butter": (np.array(drawn.exterior.coords)[:-1], "outline"),
        "tri": (TRIANGLE, "uniform"),
    }
    things = {n: Object(o, s, friction=FRICTION[n], name=n) for n, (o, s) in outlines.items()}
    return Setup(things, FINGERS, TIP_RADIUS, GOAL[:2])


def halves(recordings: tuple[Recording, ...]) -> tuple[list[Recording], list[Recording]]:
    """Every second run from each start, and the others."""
    parts: tuple[list[Recording], list[Recording]] = ([], [])
    count: dict[tuple[str, str], int] = {}
    for one in recordings:
        key = (one.run.object, one.run.start)
        parts[count.get(key, 0) % 2].append(one)
        count[key] = count.get(key, 0) + 1
    return parts


def cases(recordings: tuple[Recording, ...], given: Setup) -> Iterable[Case]:
    """All rows of the table, from what knows least to what was fitted."""
    nothing = Parameters()
    yield judged("the plan: it ends at the goal", "nothing", recordings, given, nothing, _at_goal)
    yield judged("rigid once held", "nothing", recordings, given, nothing, rigid)
    yield judged(ASSUMED, "nothing", recordings, given, nothing)
    camera = contact_calibration(recordings, given, tags=False)
    yield judged(ASSUMED, "camera, from contacts", recordings, given, camera)
    contact = contact_calibration(recordings, given)
    what = "camera and tags, from contacts"
    yield judged("rigid once held", what, recordings, given, contact, rigid)
    yield judged(ASSUMED, what, recordings, given, contact)
    one, other = halves(recordings)
    for fitted, tested, name in (
        (one, other, "all, on even runs; judged on odd"),
        (other, one, "all, on odd runs; judged on even"),
    ):
        best = fitted_on(fitted, given)
        title = f"simulated, μ {best.friction:.2f}"
        yield judged(title, name, tested, given, best)
    yield from starts_left_out(recordings, given)


def starts_left_out(recordings: tuple[Recording, ...], given: Setup) -> tuple[Case, Case]:
    """Contacts and ends in one fit; each start is predicted by the runs from the others. One block is both rectangles,
    with one tag. First from the first pose of each run, then with what the camera saw around its landings."""
    found = calibrate(recordings, replace(given, tags=dict.fromkeys(NAMES[:2], "rectangle")))
    names = tuple(one.run.object for one in recordings)
    title, nan = f"simulated, μ {found.parameters.friction:.2f}", np.full((len(names), 2), np.nan)
    fitted = "all, other starts"
    return (
        Case(title, fitted, names, found.first_pose, nan),
        Case(title, f"{fitted}; landings seen", names, found.left_out, nan),
    )


def fitted_on(recordings: list[Recording], given: Setup) -> Parameters:
    """Everything, from the contacts first and then from the ends of the pushes."""
    return fit_to_ends(recordings, given, contact_calibration(recordings, given))


def judged(
    title: str,
    fitted: str,
    recordings: Iterable[Recording],
    given: Setup,
    parameters: Parameters,
    how: Callable[..., Replayed] | None = None,
) -> Case:
    """What a way to predict makes of some runs."""
    names, final, way, lost = [], [], [], 0
    plants = {name: parameters.plant(given, name) for name in given.objects}
    for one in recordings:
        name = one.run.object
        registration = parameters.registration(given, name)
        if how is None:
            predicted = parameters.replay(given, one)
        else:
            predicted = how(one, plants[name], registration)
        names.append(name)
        final.append(errors(predicted.final, registration.poses(one.final)))
        apart = trajectory_errors(one, predicted, registration, parameters.lag)
        way.append(np.full(2, np.nan) if how is _at_goal else np.mean(apart, axis=0))
        lost += any(predicted.outcomes)
    return Case(title, fitted, tuple(names), np.array(final), np.array(way), lost)


def table(found: Iterable[Case]) -> str:
    """Mean and worst error at the end, by object and over all, in mm and degrees, and the mean over the whole way."""
    lines = [
        "Recorded two-finger runs: predicted against measured final pose, mean / worst in mm (mean angle in °).",
        f"{'prediction':<33}{'fitted':<34}{'runs':>4}"
        + "".join(f"{name:>21}" for name in (*NAMES, "all", "mean over the way")),
    ]
    for case in found:
        cells = [_cell(case.of([name])) for name in NAMES] + [_cell(case.final)]
        mean = np.mean(case.way, axis=0)
        whole = f"{1000 * mean[0]:.2f} ({np.degrees(mean[1]):.2f}°)" if np.isfinite(mean[0]) else "—"
        lines.append(
            f"{case.title:<33}{case.fitted:<34}{len(case.final):>4}"
            + "".join(f"{c:>21}" for c in (*cells, whole))
        )
    lines.append(
        "All: one affine map of the camera, one tag offset for each object, one inset of the fingers, one μ; no run has"
        " a parameter of its own. Even: every second run from each start, from its first. Outlines are the true ones."
    )
    return "\n".join(lines)


def _cell(final: Array) -> str:
    if not len(final):
        return "—"
    d, a = 1000 * final[:, 0], np.degrees(final[:, 1])
    return f"{d.mean():.2f} / {d.max():.2f} ({a.mean():.2f}°)"


def _at_goal(recording: Recording, _plant: object, _registration: object) -> Replayed:
    return Replayed(tuple(np.tile(GOAL, (b - a, 1)) for a, b in recording.strokes), ("",))
