"""Obstacles: a first plan at once, better ones while there is time; object and fingers keep their clearance."""

from dataclasses import replace
from pathlib import Path

import flatpush as fp

HERE = Path(__file__).parent

scene = fp.load_scene(HERE / "maze.yaml")
# The search ends after so many iterations, so that the same plan comes out everywhere; a time limit cuts it short.
scene = replace(scene, planning=replace(scene.planning, iterations=300, time_limit=30.0))

planner = fp.Planner(scene)
for answer in planner.answers():
    print(f"{1000 * answer.cost:.0f} mm")
plan = answer.plan()  # made, with its certificate, when it is asked for
print(" – ".join(push.push for push in plan.pushes))

certificate = plan.certificate
print(f"clearance {1000 * certificate.clearance:.2f} mm, asked for {1000 * scene.planning.clearance:.2f} mm")
assert certificate.clearance >= scene.planning.clearance
assert fp.verify(plan).ok
