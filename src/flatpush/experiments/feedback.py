"""Single-finger tasks under feedback, with another table, finger and camera than the controllers believe.

The paper's four objects start up to 300 mm away from the goal, in any direction and at any angle. The simulated table
is the exact surface of a perturbed support: the weight of every foot is off by up to 20 % (a spread pressure stands on
feet every 4 mm), and the centre of friction by up to 2 % of the object's size. Friction between finger and object is
off by up to 20 %. The camera takes 30 frames a second, 100 ms late, with 0.3 mm and 0.3° of noise. Counted are the runs
that end within 2 mm and 2°; runs in which no push could be steered even by who knew all that are counted apart.
"""

import itertools
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..control import AbstractController, Camera, ControllerState, SimulatedSensor
from ..control.horizon.controller import HorizonController
from ..control.loop.closed_loop import ClosedLoopRun, drive
from ..control.tracking.plan_controller import PlanController
from ..errors import FlatpushError
from ..friction import Support
from ..friction.draws import draw_loads
from ..geometry import compose, pose_error, rotate, transform
from ..geometry.pose import Array
from ..planning import Planner
from ..planning.options import push_option
from ..problem import Object, Planning, Push, Pusher, Scene
from ..processes import processes
from ..simulation.plant import Plant, PlantState

Law = Literal["horizon", "path", "dfl"]
Disturbance = Literal["", "displaced", "lost"]

RUNS, SEED = 200, 0
START_DISTANCE = 0.3  # of the starts [m]
WEIGHTS, CENTRE, FRICTION = 0.2, 0.02, 0.2
FOOT = 0.004  # between the feet that a spread pressure is replaced by [m]
WITHIN = (0.002, float(np.deg2rad(2.0)))
PATIENCE = 240.0  # [s]
# The finger is moved along the edge by so much, or pulled back from it for so long, at its own speed.
DISPLACED, LOST = 0.005, 0.5

RECTANGLE = ((-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175))
SIDES = {"left": (-0.025, 0.0), "right": (0.025, 0.0), "bottom": (0.0, -0.0175), "top": (0.0, 0.0175)}
FEET = ((0.02, 0.0), (-0.01, 0.012), (-0.01, -0.012))
TRIANGLE = ((0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095))


def objects() -> tuple[tuple[Object, dict[str, tuple[float, float]]], ...]:
    """The paper's four, as the scenes in examples/ have them, and where they are pushed."""
    t = 2 * np.pi * (np.arange(48) + 0.5) / 48
    wing = (1 - 0.12 * np.cos(4 * t))[:, None] * np.stack([np.cos(t), np.sin(t)], axis=1)
    wing = wing * (0.01442, 0.0195) / np.max(np.abs(wing), axis=0)
    hollow = (
        float(np.max(wing[np.abs(wing[:, 1]) < 0.002, 0])),
        float(np.max(wing[np.abs(wing[:, 0]) < 0.001, 1])),
    )
    hollows = {
        "left": (-hollow[0], 0.0), "right": (hollow[0], 0.0), "bottom": (0.0, -hollow[1]), "top": (0.0, hollow[1])
    }  # fmt: skip
    edges = {"long edge": (0.0, -0.0095), "short edge": (0.019667, 0.00475), "hypotenuse": (-0.00372, 0.0077)}
    return (
        (Object(RECTANGLE, Support.points(FEET), 0.3, name="rectangle on three feet"), SIDES),
        (Object(RECTANGLE, "outline", 0.3, name="rectangle on its edge"), SIDES),
        (Object(wing, "outline", 0.25, name="butterfly"), hollows),
        (Object(TRIANGLE, "uniform", 0.3, name="triangle"), edges),
    )


@dataclass(frozen=True, eq=False)
class Task:
    """One task: what is believed, what is true, and the seed of the camera's noise."""

    scene: Scene
    truth: Object
    seed: tuple[int, ...]

    @property
    def steerable(self) -> bool:
        """Whether some push can be steered on the true table with the true friction."""
        known = replace(self.scene, object=self.truth)
        assert not isinstance(known.pushes, str)
        return any(push_option(known, push, margin=0.0).car is not None for push in known.pushes)


@dataclass(frozen=True, eq=False)
class Ended:
    """How a run ended: distance [m] and angle [rad] off the goal, what the controller said, landings and seconds."""

    distance: float
    angle: float
    outcome: str
    landings: int
    time: float

    @property
    def good(self) -> bool:
        return self.distance <= WITHIN[0] and self.angle <= WITHIN[1]


def task(number: int, seed: int = SEED, near: float = 0.0) -> Task:
    """The task of a number; the objects take turns.

    Args:
        near: starts are at least so far away [m].
    """
    rng = np.random.default_rng([seed, number])
    thing, places = objects()[number % 4]
    angle, far = rng.uniform(-np.pi, np.pi), np.sqrt(rng.uniform(near**2, START_DISTANCE**2))
    start = (far * np.cos(angle), far * np.sin(angle), rng.uniform(-np.pi, np.pi))
    pushes = tuple(Push(name, thing.outline.nearest(place)) for name, place in places.items())
    planning = Planning(friction_margin=0.4, iterations=1)
    scene = Scene(thing, start, pusher=Pusher(), pushes=pushes, planning=planning)
    friction = thing.friction * (1 + FRICTION * rng.uniform(-1, 1))
    truth = Object(thing.outline, perturbed(thing, rng), friction, name=thing.name)
    return Task(scene, truth, (seed, number, 1))


def perturbed(thing: Object, rng: np.random.Generator) -> Support:
    """A support with other weights, moved so that its centre is off by up to CENTRE of the object's size."""
    support = thing.support
    if not len(support.feet[1]):
        support = Support.points(*_feet(thing))
    drawn = draw_loads(support, rng, WEIGHTS)
    reach, angle = CENTRE * thing.outline.size * np.sqrt(rng.uniform()), rng.uniform(-np.pi, np.pi)
    centre = thing.cof + reach * np.array([np.cos(angle), np.sin(angle)])
    return drawn.translated(centre - drawn.centre)


def _feet(thing: Object) -> tuple[Array, Array]:
    """Feet and weights that a spread pressure is replaced by."""
    corners = thing.outline.vertices
    if thing.support_word == "outline":
        steps = np.roll(corners, -1, axis=0) - corners
        lengths = np.hypot(*steps.T)
        counts = np.maximum(1, np.round(lengths / FOOT)).astype(int)
        feet = [
            a + ((np.arange(n) + 0.5) / n)[:, None] * d
            for a, d, n in zip(corners, steps, counts, strict=True)
        ]
        return np.concatenate(feet), np.repeat(lengths / counts, counts)
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = (np.arange(a + FOOT / 2, b, FOOT) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = np.array([p for p in grid if thing.outline.contains(p)])
    return inside, np.ones(len(inside))


class DisturbedPlant(Plant):
    """A plant whose hand is disturbed once, after the finger has pushed for a time [s].

    Args:
        kind: "displaced": 5 mm along the edge at once, to a side; "lost": pulled back from it for half a second.
    """

    def __init__(self, truth: Object, radius: float, kind: Disturbance, after: float, side: float) -> None:
        super().__init__(truth, [[0.0, 0.0]], radius)
        self.kind, self.after, self.side = kind, after, side
        self.pushed, self.left = 0.0, LOST

    def step(self, state: PlantState, velocity: ArrayLike, dt: float) -> PlantState:
        touching = state.modes[0] not in ("separation", "rest")
        self.pushed += dt if touching else 0.0
        if not self.kind or self.pushed < self.after or self.left <= 0 or not (touching or self.left < LOST):
            return super().step(state, velocity, dt)
        tip = rotate(-state.object[2], state.hand[:2] - state.object[:2])
        found = self.thing.outline.nearest(tip)
        if self.kind == "lost":
            self.left -= dt
            away = -rotate(state.object[2], found.normal) * float(np.hypot(*np.asarray(velocity)[:2]))
            return super().step(state, [*away, 0.0], dt)
        self.left = 0.0
        along = self.side * np.array([-found.normal[1], found.normal[0]])
        there = self.thing.outline.nearest(found.point + DISPLACED * along)
        moved = transform(state.object, there.point - self.tip_radius * there.normal)
        return super().step(self.start(state.object, [*moved, state.hand[2]]), velocity, dt)


def controlled(law: Law, learn: bool, scene: Scene, rate: float) -> AbstractController:
    """The controller of a law for a task."""
    if law == "horizon":
        return HorizonController.of(scene, rate=rate, learn=learn)
    plan = Planner(scene).plan()
    return PlanController.of(plan, law, rate, learn=learn)


def attempt(
    given: Task, law: Law = "horizon", learn: bool = True, disturbance: Disturbance = "", rate: float = 60.0
) -> tuple[Ended, ClosedLoopRun | None]:
    """Runs one task; without a run if the controller refuses it or breaks off with an error."""
    scene = given.scene
    try:
        controller = controlled(law, learn, scene, rate)
    except FlatpushError as error:
        return Ended(np.inf, np.inf, f"refused: {error}", 0, 0.0), None
    rng = np.random.default_rng(given.seed)
    far = float(np.hypot(*scene.start_pose[:2]))
    after, side = rng.uniform(0.2, 0.8) * far / scene.pusher.speed, rng.choice([-1.0, 1.0])
    plant = DisturbedPlant(given.truth, scene.pusher.tip_radius, disturbance, after, side)
    hand = compose(scene.start_pose, [-2 * scene.object.outline.size, 0.0, 0.0])
    landings = 0

    def told(time: float, state: ControllerState) -> None:
        nonlocal landings
        landings = max(landings, getattr(state, "landings", 1))

    sensor = SimulatedSensor(Camera(), rng)
    try:
        run = drive(controller, plant, scene.start_pose, hand, sensor, PATIENCE, told=told)
    except FlatpushError as error:
        return Ended(np.inf, np.inf, f"broke off: {error}", landings, 0.0), None
    off = pose_error(run.object[-1], scene.goal)
    ended = Ended(float(np.hypot(*off[:2])), abs(float(off[2])), run.outcome, landings, float(run.times[-1]))
    return ended, run


def line(name: str, ends: Sequence[Ended]) -> str:
    """A row of the table."""
    good = sum(end.good for end in ends)
    off = np.array([[1000 * end.distance, np.rad2deg(end.angle)] for end in ends])
    median = np.median(off, axis=0)
    return (
        f"{name:<24} {good:>4} of {len(ends):<4} {100 * good / len(ends):6.1f} % {median[0]:8.2f} mm {median[1]:6.2f}°"
        f" {np.mean([end.landings for end in ends]):9.1f} {np.mean([end.time for end in ends]):8.1f} s"
    )


def reasons(name: str, ends: Sequence[tuple[int, Ended]]) -> list[str]:
    """A line for each reason why runs failed, with the numbers of the first of them."""
    failed = [(number, end) for number, end in ends if not end.good]
    words = Counter(_kind(end) for _, end in failed)
    lines = []
    for word, count in words.most_common():
        which = [str(number) for number, end in failed if _kind(end) == word]
        more = " …" if len(which) > 8 else ""
        lines.append(f"  {name}: {count} × {word} (task {', '.join(which[:8])}{more})")
    return lines


def _kind(end: Ended) -> str:
    if end.outcome == "arrived":
        return "ended its pushes, but off the goal"
    if end.outcome.startswith("still "):
        return "still off the goal after its landings"
    return end.outcome.split(":")[0]


@dataclass(frozen=True)
class _Job:
    """One run of a study, small enough to be sent to another process."""

    number: int
    seed: int
    near: float
    law: Law
    learn: bool
    disturbance: Disturbance

    def ended(self) -> Ended | None:
        """None where no push can be steered."""
        given = task(self.number, self.seed, self.near)
        return attempt(given, self.law, self.learn, self.disturbance)[0] if given.steerable else None


def _ended(job: _Job) -> Ended | None:
    return job.ended()


def run(
    folder: Path | None = None, runs: int | None = None, seed: int | None = None, workers: int | None = None
) -> str:
    """The tables; each disturbance takes half as many runs as each controller.

    Args:
        runs: of each controller. seed: of the tasks. workers: processes; default: one for each core.
    """
    count, first = RUNS if runs is None else runs, SEED if seed is None else seed
    laws: tuple[Law, ...] = ("horizon", "path", "dfl")
    kinds: tuple[tuple[Disturbance, str], ...] = (
        ("displaced", "finger moved by 5 mm"),
        ("lost", "contact lost for 0.5 s"),
    )
    groups = {
        f"{law}{', learning' if learn else ''}": [_Job(k, first, 0.0, law, learn, "") for k in range(count)]
        for law in laws
        for learn in (True, False)
    }
    groups |= {
        name: [_Job(k, first + 1, 0.1, "horizon", True, kind) for k in range(max(1, count // 2))]
        for kind, name in kinds
    }
    ends = dict(zip(groups, _all(list(groups.values()), workers), strict=True))
    left_out = sum(end is None for end in ends["horizon"])
    lines = [
        f"Random tasks of one finger, seed {first}: {count}, of which {left_out} have no push that can be steered and"
        " are left out.",
        f"{'controller':<24} {'within 2 mm and 2°':>21} {'median off the goal':>20} {'landings':>9} {'time':>10}",
    ]
    failures: list[str] = []
    for name, found in ends.items():
        usable = [(k, end) for k, end in enumerate(found) if end is not None]
        if usable:
            lines.append(line(name, [end for _, end in usable]))
            failures += reasons(name, usable)
    return "\n".join([*lines, "failures:" if failures else "no failures", *failures])


def _all(groups: list[list[_Job]], workers: int | None) -> list[list[Ended | None]]:
    """The ends of all jobs, group by group; in other processes if there is more than one worker."""
    jobs = [job for group in groups for job in group]
    count = min(workers or os.cpu_count() or 1, len(jobs))
    if count <= 1:
        found = [_ended(job) for job in jobs]
    else:
        with processes(count) as pool:
            found = list(pool.map(_ended, jobs, chunksize=max(1, len(jobs) // (8 * count))))
    sizes = np.cumsum([0, *(len(group) for group in groups)])
    return [found[a:b] for a, b in itertools.pairwise(sizes)]
