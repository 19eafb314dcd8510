"""Many pushes: a rectangle is turned round by pushing it from several sides, planned from a scene file."""

from dataclasses import replace
from pathlib import Path

import flatpush as fp

HERE = Path(__file__).parent

scene = fp.load_scene(HERE / "rectangle_boundary.yaml")
plan = fp.plan(scene)
for push in plan.pushes:
    print(
        f"{push.push:<8} {push.word:<4} {1000 * push.arcs[0].cost:6.1f} mm in its first arc, {len(push.arcs)} arcs"
    )
print(f"cost {1000 * plan.cost:.1f} mm, of which {scene.planning.switch_cost * 1000:.0f} mm for each change")

# The same with a single push, for every side that can do it alone.
for push in scene.pushes:
    alone = fp.plan(replace(scene, pushes=(push,)))
    told = f"{1000 * alone.cost:.1f} mm" if alone.status == "solved" else alone.reason
    print(f"only {push.name:<8} {told}")
    assert alone.status != "solved" or plan.cost <= alone.cost + 1e-9
