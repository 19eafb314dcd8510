"""Two-finger stability: which turns two fingers can hold, and whether a plan holds on every table of a set."""

import numpy as np

import flatpush as fp

# A rectangle of 50 × 35 mm, in a frame with its origin at the centre of friction; pushed upwards by two fingertips.
corners = [(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)]
surface = fp.Exact(fp.Support.polygon(corners))
fingers = [fp.PointContact([x, -0.0175], [0.0, 1.0], friction=0.3) for x in (-0.009, 0.009)]
middle = fp.PointContact([0.0, -0.0175], [0.0, 1.0], friction=0.3)

for radius in (0.2, 0.1, 0.05, 0.03, 0.02):
    # A left turn about a point beside the centre of friction, so that the centre moves straight ahead at 1 m/s.
    twist = np.array([0.0, 1.0, 1.0 / radius])
    held = fp.two_point_sticks(fingers, surface, twist)
    u = twist[:2] + twist[2] * np.array([0.0175, 0.0])  # what one finger in the middle would have to do
    V = middle.motion(surface, u).twist
    told = "hold it" if held else "lose it"
    print(f"radius {1000 * radius:3.0f} mm: two {told}; one would turn it on {1000 * V[1] / V[2]:.0f} mm")

thing = fp.Object(corners, friction=0.3)
push = fp.Push("side", thing.outline.nearest((0.0, -0.0175)), fingers=2, spacing=0.018)
pusher = fp.Pusher(fingers=2, spacing=0.018)
scene = fp.Scene(thing, (-0.03, -0.1, -0.3), pusher=pusher, pushes=(push,))
proof = fp.prove(fp.plan(scene), loads=0.05)
print(
    f"held on every table whose pressure differs by 5 %: {proof.proved}; the most it may differ: {proof.loads:.2f}"
)
assert proof.proved
