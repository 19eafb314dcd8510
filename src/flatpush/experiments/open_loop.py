"""Where open-loop single-finger plans end in the simulator, for every planning model.

Each case is planned with each model and the default margin and simulated on the exact surface of its support,
once from the plan's arcs and once straight from sample to sample. Exact plans from arcs must end within 0.05 mm
and 0.05°; the others show what a model, or a robot's interpolation, costs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..friction import Support
from ..geometry import Outline, pose_error
from ..planning import plan
from ..problem import Object, Planning, Scene
from ..problem.scene import MODELS
from ..simulation import simulate
from ..simulation.pieces import Source
from .finding import Finding, Row

SOURCES: tuple[Source, Source] = ("arcs", "samples")

RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
L_SHAPE = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.02), (0.02, 0.02), (0.02, 0.06), (0.0, 0.06)]


def cases() -> list[tuple[str, Scene]]:
    """Objects with a start each, a few centimetres before the goal."""
    feet = Support.points([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)], [1, 1, 1])
    things = {
        "rectangle, three feet": (Object(RECTANGLE, feet, 0.3), (0.01, -0.05, 0.25)),
        "rectangle, outline": (Object(RECTANGLE, "outline", 0.3), (0.01, -0.05, 0.25)),
        "triangle, uniform": (Object(TRIANGLE, "uniform", 0.3), (-0.01, -0.05, -0.2)),
        "disc, uniform": (Object(Outline.circle(0.03), "uniform", 0.3), (0.01, -0.06, 0.3)),
        "L, uniform": (Object(L_SHAPE, "uniform", 0.5), (0.01, -0.06, 0.2)),
    }
    return [(name, Scene(thing, start)) for name, (thing, start) in things.items()]


@dataclass(frozen=True)
class Ended:
    """The plan of a case under a model, and where it ends in the simulator.

    Attributes:
        case, model, words, growth: of the plan.
        distance, angle, outcome: off the goal [m, rad], from its arcs and straight between its samples.
    """

    case: str
    model: str
    words: str
    growth: float
    distance: tuple[float, float]
    angle: tuple[float, float]
    outcome: tuple[str, str]

    def text(self, way: int) -> str:
        """The end from arcs (0) or from samples (1)."""
        if self.outcome[way] != "completed":
            return self.outcome[way]
        return f"{1000 * self.distance[way]:9.4f} mm {np.rad2deg(self.angle[way]):7.4f}°"


def ends() -> Iterator[Ended]:
    """Every case under every model that has a plan for it."""
    for name, scene in cases():
        for model in MODELS:
            query = Scene(scene.object, scene.start, scene.goal, scene.pusher, planning=Planning(model=model))
            found = plan(query)
            if found.certificate is None or found.certificate.growth is None:
                continue
            rollouts = [simulate(found, source=source) for source in SOURCES]
            off = [pose_error(rollout.final_pose, scene.goal) for rollout in rollouts]
            yield Ended(
                name,
                model,
                " ".join(push.word for push in found.pushes),
                found.certificate.growth,
                (float(np.hypot(*off[0][:2])), float(np.hypot(*off[1][:2]))),
                (abs(float(off[0][2])), abs(float(off[1][2]))),
                (rollouts[0].outcome, rollouts[1].outcome),
            )


def table(found: Iterable[Ended]) -> str:
    """Case, model, end from arcs, end from samples."""
    lines = [
        "Open loop, one finger, simulated on the exact surface: distance and angle off the goal.",
        f"{'case':<24} {'model':<10} {'words':>9} {'growth':>8} {'from arcs':>22} {'from samples':>22}",
    ]
    lines += [
        f"{end.case:<24} {end.model:<10} {end.words:>9} {end.growth:8.1f} {end.text(0):>22} {end.text(1):>22}"
        for end in found
    ]
    return "\n".join(lines)


def ranges(found: Iterable[Ended]) -> dict[str, str]:
    """For each model the least and the greatest end of the runs from arcs that were completed."""
    by_model: dict[str, list[Ended]] = {}
    for end in found:
        if end.outcome[0] == "completed":
            by_model.setdefault(end.model, []).append(end)
    return {
        model: f"{1000 * min(e.distance[0] for e in some):.2g} to {1000 * max(e.distance[0] for e in some):.2g} mm,"
        f" {np.rad2deg(min(e.angle[0] for e in some)):.2g} to {np.rad2deg(max(e.angle[0] for e in some)):.2g}°"
        for model, some in by_model.items()
    }


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """A row for each model; the table has every case."""
    found = list(ends())
    why = {
        "exact": "The surface of the support itself: what is left is rounding.",
        "quartic": "A convex quartic comes near every such surface, not to it.",
        "local": "The paper's Eqs. 2 and 3, corrected: right where the push goes straight, and less so where it turns.",
        "ellipsoid": "What the paper's experiments use: one ellipsoid for all wrenches; a foot below the turn shows.",
    }
    rows = [
        Row(
            f"{model}: ends of the same five single-finger plans off the goal, open loop",
            "",
            text,
            why[model],
        )
        for model, text in ranges(found).items()
    ]
    return Finding(tuple(rows), table=table(found))


def run(folder: Path | None = None) -> str:
    """The table."""
    return table(ends())
