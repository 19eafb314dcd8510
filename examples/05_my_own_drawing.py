"""My own drawing: an outline from a vector editor, where it can be pushed, and a plan for it."""

from pathlib import Path

import numpy as np

import flatpush as fp

HERE = Path(__file__).parent

# bracket.yaml says `outline: {file: bracket.svg}`; a drawing is read as it is seen, in its own units.
scene = fp.load_scene(HERE / "bracket.yaml")
x, y = np.ptp(scene.object.outline.vertices, axis=0)
print(
    f"{scene.object.name}: {1000 * x:.1f} × {1000 * y:.1f} mm, {len(scene.object.outline.vertices)} corners"
)

# Without `pushes:` the places are found: where a push can steer, and what it costs to turn there.
planner = fp.Planner(scene)
for option in planner.usable:
    print(f"push {option.push.name:<14} turns on {1000 * option.car.radius:.0f} mm or more")

plan = planner.plan()
print(" – ".join(push.push for push in plan.pushes), f"{1000 * plan.cost:.0f} mm")
assert plan.status == "solved"
assert fp.verify(plan).ok
