"""Fig. 3: two paths of a square pushed by one finger, by flatness and Dubins curves.

Which two start-goal pairs the paper drew is not recorded. Here: the square of ±20 mm with the pairs (-80 mm, 0,
0) → 0 and (0, 0, 0) → (0, 20 mm, 180°), friction 0.3, uniform support, and the ellipsoid model, without margin.
"""

from pathlib import Path

import numpy as np

from ..friction import Ellipsoid
from ..geometry import Outline
from ..planning import plan
from ..problem import Object, Plan, Planning, Push, Pusher, Scene
from ..steering import dubins, flat_output

HALF = 0.02
PAIRS = (
    ((-4 * HALF, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (0.0, HALF, np.pi)),
)


def scenes() -> tuple[Scene, ...]:
    """The two scenes, pushed at the middle of the lower side."""
    square = Outline.polygon([(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)])
    thing = Object(square, "uniform", friction=0.3, name="square")
    push = Push("lower side", square.at(0, 0.5))
    planning = Planning(model="ellipsoid", friction_margin=0.0)
    pusher = Pusher(tip_radius=HALF / 10)
    return tuple(Scene(thing, start, goal, pusher, (push,), planning=planning) for start, goal in PAIRS)


def plans() -> tuple[Plan, ...]:
    return tuple(plan(scene) for scene in scenes())


def run(folder: Path | None = None) -> str:
    """The table; with a folder, also fig3a.svg and fig3b.svg."""
    from ..problem.mechanics import placement_of, surface_of, virtual_contact

    lines = [
        "Fig. 3: one finger at the middle of a square's lower side, ellipsoid model, μ = 0.3.",
        "The paper's own pairs are not recorded; these are ours.",
        f"{'start [mm, mm, °]':>24} {'goal':>20} {'word':>5} {'flat path':>10} {'Dubins':>10} {'R':>8}",
    ]
    for k, found in enumerate(plans()):
        scene = found.scene
        contact = virtual_contact(scene, placement_of(scene, scene.pushes[0]))  # type: ignore[arg-type]
        surface = surface_of(scene.object, "ellipsoid", np.array([0.0, 1.0]))
        assert isinstance(surface, Ellipsoid)
        flat = flat_output(contact, surface)

        def car(pose, flat=flat):  # type: ignore[no-untyped-def]
            return [*flat.position(pose), pose[2] + flat.heading_offset]

        path = dubins.shortest_path(car(scene.start_pose), car(scene.goal_pose), flat.min_radius)
        lines.append(
            f"{_pose(scene.start_pose):>24} {_pose(scene.goal_pose):>20} {found.pushes[0].word:>5}"
            f" {1000 * found.cost:7.2f} mm {1000 * path.length:7.2f} mm {1000 * flat.min_radius:5.1f} mm"
        )
        if folder is not None:
            from ..view import save_figure

            save_figure(found, folder / f"fig3{'ab'[k]}.svg")
    return "\n".join(lines)


def _pose(pose) -> str:  # type: ignore[no-untyped-def]
    return f"({1000 * pose[0]:.0f}, {1000 * pose[1]:.0f}, {np.rad2deg(pose[2]):.0f})"
