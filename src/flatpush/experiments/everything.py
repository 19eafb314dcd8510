"""The whole paper at once: every figure, proposition and theorem, and the comparisons, as jobs that run anywhere.

A job is a name and what it may read; its finding holds all that the report shows, so that it can be computed by any
process or machine, in any order.
"""

import time
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Protocol

import numpy as np

from ..errors import FlatpushError
from ..processes import processes
from .finding import Finding, Row, drawn


@dataclass(frozen=True)
class Section:
    """A section of the report.

    Attributes:
        name: of the job. title, about: what the report says above it.
    """

    name: str
    title: str
    about: str


SECTIONS = (
    Section(
        "duality",
        "Figs. 1 and 2, Proposition 1, Theorem 1",
        "A push of one finger: friction and motion cone, the line of rotation centres, its points as flat outputs.",
    ),
    Section("fig3", "Fig. 3: paths of a single-finger push", "Dubins curves of the flat point."),
    Section(
        "fig4",
        "Fig. 4: feedback under a wrong table",
        "Dynamic feedback linearisation with the paper's gains and matrices.",
    ),
    Section(
        "sequences",
        "Figs. 6–9: planned and simulated",
        "The paper's objects from its nominal starts: two fingers, open loop, random starts and friction.",
    ),
    *(
        Section(
            f"fig{k}",
            f"Fig. {k} in the physics cell: {what}",
            "By an IRB 120 with two fingers in MuJoCo, with the authors' recorded runs where the data are given.",
        )
        for k, what in (
            (6, "a rectangle on three feet"),
            (7, "a rectangle on its edge"),
            (8, "a butterfly"),
            (9, "a triangle"),
        )
    ),
    Section(
        "fig10", "Figs. 10 and 11: pushing among obstacles", "The second maze that the robot went through."
    ),
    Section(
        "open-loop",
        "Comparison: limit surfaces",
        "Local and global ellipsoid, quartic and exact surface, on the same pushes, open loop.",
    ),
    Section(
        "stored-graphs",
        "Comparison: stored graphs and refined plans",
        "The nine queries of the robot's runs, with the authors' own models and costs.",
    ),
    Section(
        "cone",
        "Comparison: virtual middle contact and the cone of two fingers",
        "Random queries of the paper's rectangle and triangle at the same margin.",
    ),
    Section("loops", "Comparison: open loop and feedback", "One finger, on tables other than believed."),
    Section(
        "replay",
        "Comparison: what is fitted to recorded runs",
        "The authors' robot runs through the simulator: nothing fitted, contacts, ends, and both.",
    ),
)

# What takes longest is begun first.
LONG = ("fig8", "loops", "sequences", "replay", "open-loop")


@dataclass(frozen=True)
class Job:
    """A section to compute: its name, whether quickly, and the folder of recorded data, "" for none."""

    name: str
    quick: bool = False
    data: str = ""


@dataclass(frozen=True)
class Done:
    """A job, what it found, and its CPU time [s]."""

    job: Job
    finding: Finding
    cpu: float


class Spread(Protocol):
    """Calls a function with every job, anywhere, and gives the results in the order of the jobs.

    `told` is called as soon as one is done, in any order.
    """

    def __call__(
        self, function: Callable[[Job], Done], jobs: Sequence[Job], told: Callable[[Done], None]
    ) -> list[Done]: ...


def everything(
    quick: bool, data: Path | None, spread: Spread, told: Callable[[Done], None]
) -> list[tuple[Section, Done]]:
    """All sections, in the order of the report, however they were computed."""
    ordered = sorted(SECTIONS, key=lambda section: section.name not in LONG)
    jobs = [Job(section.name, quick, "" if data is None else str(data)) for section in ordered]
    done = {one.job.name: one for one in spread(compute, jobs, told)}
    return [(section, done[section.name]) for section in SECTIONS]


def compute(job: Job) -> Done:
    """One section; what an extra or a folder is missing for, or a mistake, is told instead of ending everything."""
    began = time.process_time()
    find = _FIND.get(job.name)
    if find is None:
        find = import_module(f"flatpush.experiments.{job.name.replace('-', '_')}").find
    try:
        found = find(quick=job.quick, data=Path(job.data) if job.data else None)
    except FlatpushError as error:
        found = Finding(missing=str(error))
    except Exception as error:
        found = Finding(failed=f"{type(error).__name__}: {error}", table=traceback.format_exc())
    return Done(job, found, time.process_time() - began)


def in_processes(count: int) -> Spread:
    """Jobs in so many processes of this machine."""

    def spread(
        function: Callable[[Job], Done], jobs: Sequence[Job], told: Callable[[Done], None]
    ) -> list[Done]:
        with processes(count) as pool:
            futures = {pool.submit(function, job): job for job in jobs}
            done = {}
            for future in as_completed(futures):
                done[futures[future]] = one = _ended(future, futures[future])
                told(one)
            return [done[job] for job in jobs]

    return spread


def _ended(future: "Future[Done]", job: Job) -> Done:
    """What a process made of a job, also if it did not live to tell."""
    error = future.exception()
    return (
        future.result()
        if error is None
        else Done(job, Finding(failed=f"its process ended: {error or type(error).__name__}"), 0.0)
    )


def _fig3(quick: bool, data: Path | None) -> Finding:
    from . import fig3

    def draw(folder: Path) -> None:
        lines.append(fig3.run(folder))

    lines: list[str] = []
    figures = drawn(draw)
    found = fig3.plans()
    rows = [
        Row(
            f"Fig. 3, pair {k + 1}: word and length of the flat path",
            "drawn; pair, word and length are not printed",
            f"{one.pushes[0].word}, {1000 * one.cost:.1f} mm",
            "Pairs of the authors' demonstrations; which two were printed is not recorded.",
        )
        for k, one in enumerate(found)
    ]
    return Finding(tuple(rows), figures, lines[0])


def _fig4(quick: bool, data: Path | None) -> Finding:
    from ..control.laws.gains import Gains
    from . import fig4

    paper = Gains(*map(np.array, fig4.PAPER_GAINS))
    perturbed, nominal = (fig4.tracked(paper, surface) for surface in (fig4.PERTURBED, fig4.NOMINAL))
    strong = [fig4.tracked(Gains.of(2.0), surface) for surface in (fig4.NOMINAL, fig4.PERTURBED)]
    found, closed = fig4.bias(fig4.R / fig4.UNIT)

    def words(e: np.ndarray) -> str:
        return f"({1000 * e[0]:.2f}, {1000 * e[1]:.2f}) mm, {np.degrees(e[2]):.2f}°"

    rows = (
        Row(
            "Fig. 4: end off the goal with the perturbed matrix and the paper's gains",
            "(3.4, 1.2) mm, 2.55° (printed in metres and called mm)",
            words(perturbed),
            "The run is cut off after 30 s, on the way: those gains leave 22 % and 47 % of the start error by then,"
            " and the start and the draw of the matrix that were drawn are only known as they are printed.",
        ),
        Row(
            "the paper's gains, nominal matrix",
            "",
            f"flat point {1000 * fig4.flat_error(nominal):.2f} mm off, heading {np.degrees(nominal[2]):.2f}°",
            "What the gains leave by themselves.",
        ),
        Row(
            "kp = kd = 4, nominal matrix",
            "",
            f"flat point {1000 * fig4.flat_error(strong[0]):.4f} mm off, heading {np.degrees(strong[0][2]):.4f}°",
            "Critically damped gains end where the paper's text says that the law ends.",
        ),
        Row(
            "kp = kd = 4, perturbed matrix",
            "",
            f"flat point {1000 * fig4.flat_error(strong[1]):.2f} mm off, heading {np.degrees(strong[1][2]):.2f}°",
            "Better gains do not make up for a wrong matrix: its flat point is elsewhere.",
        ),
        Row(
            "settled heading on a straight line, perturbed matrix",
            "0 is implied (exponential stability)",
            f"{np.degrees(found):.2f}° simulated, {np.degrees(closed):.2f}° in closed form",
            "Feedback of the flat point does not integrate: a wrong matrix leaves a heading. An estimator removes it.",
        ),
    )
    if quick:
        return Finding(rows, drawn(lambda folder: fig4.draw(folder / "fig4.svg")))
    lines: list[str] = []
    figures = drawn(lambda folder: lines.append(fig4.run(folder)))
    return Finding(rows, figures, lines[0])


def _cell(quick: bool, data: Path | None, figure: str) -> Finding:
    from . import robot_runs

    found = list(robot_runs.cases(figure, 2 if quick else robot_runs.RUNS))
    logged = robot_runs.recorded(data, figure) if data is not None else {}
    rows = []
    for start, case, printed in zip(
        robot_runs.STARTS[figure], found, robot_runs.PRINTED[figure], strict=True
    ):
        errors = logged.get(tuple(float(v) for v in start))
        of_robot = "" if errors is None else f"; {len(errors)} recorded runs: {_mean(errors)}"
        rows.append(
            Row(
                f"start ({', '.join(f'{v:g}' for v in start)}°): signed error (x [mm], y [mm], θ [°]) at the end,"
                " mean ± 95 % interval",
                "(" + ", ".join(f"{m:+.2f} ± {h:.2f}" for m, h in printed) + ")" + of_robot,
                f"{len(case.ends)} runs: {_mean(case.errors * [1000, 1000, 180 / np.pi])};"
                f" pushes: {' – '.join(case.pushes)}",
                "The last push goes straight to the goal here, and no camera adds its error; the robot's runs include"
                " the map from camera to robot, 1.7 mm at the goal.",
            )
        )
    draw = drawn(lambda folder: robot_runs.draw(figure, found, folder / f"{figure}.svg"))
    return Finding(tuple(rows), draw, robot_runs.table(figure, found, logged))


def _mean(errors: np.ndarray) -> str:
    """Of errors in mm and degrees; of three and more with halves of their 95 % intervals."""
    from .robot_runs import half_widths

    few = len(errors) < 3
    pairs = zip(errors.mean(axis=0), half_widths(errors), strict=True)
    return "(" + ", ".join(f"{mean:+.2f}" + ("" if few else f" ± {half:.2f}") for mean, half in pairs) + ")"


def _cone(quick: bool, data: Path | None) -> Finding:
    from . import cone

    lines: list[str] = []
    figures = drawn(lambda folder: lines.append(cone.run(folder, 5 if quick else cone.QUERIES)))
    rows = tuple(
        Row(
            f"{case.name}: way of the pusher and switching, mean over random queries",
            "virtual contact in the middle",
            _shorter(lines[0], case.name),
            "Two fingers can turn the object about centres that no single contact reaches.",
        )
        for case in cone.CASES
    )
    return Finding(rows, figures, lines[0])


def _shorter(table: str, name: str) -> str:
    """From the row of an object: middle, cone, shorter, kept."""
    row = next(line for line in table.splitlines() if line.startswith(name))
    words = row.split()
    share = words.index("%")
    middle, cone, percent = words[share - 3 : share]
    return (
        f"{cone} mm with the cone, {middle} mm with the middle: {percent} % less;"
        f" {words[-1]} plans keep both contacts"
    )


def _replay(quick: bool, data: Path | None) -> Finding:
    from ..simulation.calibration import Parameters, contact_calibration, fit_to_ends
    from . import replay

    if data is None:
        return Finding(missing="The recorded runs are in the folder of recorded data (--data).")
    recordings, given = replay.recorded(data)
    contacts = contact_calibration(recordings, given)
    found = [
        replay.judged(
            "the plan: it ends at the goal", "nothing", recordings, given, Parameters(), replay._at_goal
        ),
        replay.judged(replay.ASSUMED, "nothing", recordings, given, Parameters()),
        replay.judged(replay.ASSUMED, "contacts", recordings, given, contacts),
    ]
    if not quick:
        even, odd = replay.halves(recordings)
        halves = {"even → odd": (even, odd), "odd → even": (odd, even)}
        for words, start in (("ends", Parameters()), ("contacts and ends", contacts)):
            for name, (fitted, tested) in halves.items():
                best = fit_to_ends(
                    fitted, given, start if words == "ends" else contact_calibration(fitted, given)
                )
                found.append(
                    replay.judged(
                        f"simulated, μ {best.friction:.2f}", f"{words}, {name}", tested, given, best
                    )
                )
        found.extend(replay.starts_left_out(recordings, given))
    rows = []
    for case in found:
        mean, worst = case.final.mean(axis=0), case.final.max(axis=0)
        rows.append(
            Row(
                f"fitted: {case.fitted} ({case.title})",
                "2.26 mm and 1.41° off the goal, mean of 61 logs",
                f"predicted within {1000 * mean[0]:.2f} mm {np.degrees(mean[1]):.2f}°, worst {1000 * worst[0]:.2f} mm,"
                f" {len(case.final)} runs",
                "The paper plans, it does not predict; 41 of its runs are in this copy of the data.",
            )
        )
    return Finding(
        tuple(rows), drawn(lambda folder: replay.draw(found, folder / "replay.svg")), replay.table(found)
    )


_FIND: dict[str, Callable[..., Finding]] = {
    "fig3": _fig3,
    "fig4": _fig4,
    **{f"fig{k}": partial(_cell, figure=f"fig{k}") for k in (6, 7, 8, 9)},
    "cone": _cone,
    "replay": _replay,
}
