"""Where open-loop single-finger plans end in the simulator, for every planning model.

Each case is planned with each model and the default margin and simulated on the exact surface of its support,
once from the plan's arcs and once straight from sample to sample. Exact plans from arcs must end within 0.05 mm
and 0.05°; the others show what a model, or a robot's interpolation, costs.
"""

from pathlib import Path

import numpy as np

from ..friction import Support
from ..geometry import Outline, pose_error
from ..planning import plan
from ..problem import Object, Planning, Scene
from ..problem.scene import MODELS
from ..simulation import simulate

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


def run(folder: Path | None = None) -> str:
    """The table: case, model, end from arcs, end from samples."""
    lines = [
        "Open loop, one finger, simulated on the exact surface: distance and angle off the goal.",
        f"{'case':<24} {'model':<10} {'words':>9} {'growth':>8} {'from arcs':>22} {'from samples':>22}",
    ]
    for name, scene in cases():
        for model in MODELS:
            query = Scene(scene.object, scene.start, scene.goal, scene.pusher, planning=Planning(model=model))
            found = plan(query)
            if found.certificate is None:
                lines.append(f"{name:<24} {model:<10} no plan")
                continue
            ends = []
            for source in ("arcs", "samples"):
                rollout = simulate(found, source=source)
                error = pose_error(rollout.final_pose, scene.goal)
                text = f"{1000 * np.hypot(*error[:2]):9.4f} mm {np.rad2deg(abs(error[2])):7.4f}°"
                ends.append(text if rollout.outcome == "completed" else rollout.outcome)
            words = " ".join(push.word for push in found.pushes)
            lines.append(
                f"{name:<24} {model:<10} {words:>9} {found.certificate.growth:8.1f}"
                f" {ends[0]:>22} {ends[1]:>22}"
            )
    return "\n".join(lines)
