"""One push: a triangle is pushed to its goal by two fingers at one side. Lengths in metres, angles in radians."""

import numpy as np

import flatpush as fp

triangle = fp.Object(
    [(0.0197, -0.0095), (0.0197, 0.019), (-0.0393, -0.0095)],  # corners [m], in the frame O of the drawing
    support="uniform",  # it presses on the table evenly
    friction=0.3,  # between fingertip and object
    name="triangle",
)
long_edge = fp.Push("long edge", triangle.outline.nearest((0.0, -0.0095)), fingers=2, spacing=0.018)
scene = fp.Scene(
    triangle,
    start=(-0.06, -0.12, np.deg2rad(20)),  # x, y, θ of O on the table
    goal=(0.0, 0.0, 0.0),
    pusher=fp.Pusher(fingers=2, spacing=0.018, tip_radius=0.0025),
    pushes=(long_edge,),
)

plan = fp.plan(scene)
(push,) = plan.pushes
print(f"{push.push}: {push.word}, {1000 * plan.cost:.1f} mm of path, {plan.duration:.1f} s")
print(f"friction margin {100 * plan.certificate.friction_margin:.0f} % of μ")

assert fp.verify(plan).ok  # every claim, recomputed from the scene
x, y, angle = fp.simulate(
    plan
).final_pose  # rolled out in a contact simulator that knows nothing of the planner
print(f"simulated: {1000 * np.hypot(x, y):.4f} mm and {abs(np.rad2deg(angle)):.4f}° off the goal")
assert np.hypot(x, y) < 5e-5
