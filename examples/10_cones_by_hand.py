"""Limit surface and cones by hand: from where an object presses to how tightly a push turns it."""

import numpy as np

import flatpush as fp

# Three feet; everything below is about their centre of friction (COF).
feet = fp.Support.points([(-0.02, -0.012), (0.02, -0.012), (0.0, 0.018)], [1, 1, 1]).centred()
surface = fp.Exact(feet)

# The wrench with which the table resists a twist, for friction = load = 1, and the twist that belongs to it.
wrench = feet.wrench([0.0, 0.01, 0.2])
twist = surface.twist(wrench)
print("wrench", np.round(wrench, 4), "twist (up to scale)", np.round(twist / twist[1] * 0.01, 4))

# One finger from below: the edges of the friction cone and the directions of its own motion that they allow.
contact = fp.PointContact(point=[0.0, -0.014], normal=[0.0, 1.0], friction=0.4)
for side, u in zip(("left", "right"), contact.motion_cone(surface), strict=True):
    print(f"{side} edge of the motion cone: {np.degrees(np.arctan2(-u[0], u[1])):+.1f}° from the normal")
for u in ([0.0, 0.02], [0.02, 0.01], [0.0, -0.02]):
    motion = contact.motion(surface, u)
    print(f"finger moves {u}: {motion.mode.name.lower()}, object turns at {motion.twist[2]:+.2f} rad/s")

# Under an ellipsoid the rotation centres lie on a line, and the middle of the two extreme ones drives like a car.
directions = np.random.default_rng(0).normal(size=(200, 3)) * [1.0, 1.0, 60.0]
wrenches = np.array([feet.wrench(v) for v in directions])
ellipsoid = fp.fit_ellipsoid(wrenches, directions)
flat = fp.flat_output(contact, ellipsoid)
print(
    f"flat point {np.round(1000 * flat.flat_point, 1)} mm, turns on {1000 * flat.min_radius:.1f} mm or more"
)
path = fp.dubins.shortest_path((0, 0, 0), (0.1, 0.05, 1.57), radius=flat.min_radius)
print(f"shortest path: {path.word}, {1000 * path.length:.0f} mm")
