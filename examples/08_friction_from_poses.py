"""Friction from poses: seven filmed pushes of one finger tell where an object presses, and its friction."""

import numpy as np

import flatpush as fp
from flatpush.documents.motion_file import Motion
from flatpush.geometry import rotate, transform
from flatpush.identification import fit_motion
from flatpush.simulation.plant import Plant

TIP, RATE, SPEED, LENGTH = 0.0025, 30, 0.02, 0.08  # [m], [Hz], [m/s], [m]
corners = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)]
feet = [(-0.02, -0.01), (0.025, -0.012), (0.0, 0.015)]
true = fp.Object(corners, fp.Support.points(feet, [2, 4, 3]), friction=0.3)
believed = fp.Object(corners, fp.Support.points(feet), friction=0.4)  # feet are seen, their loads are not

# In a laboratory these come from a file: flatpush.documents.load_motions("pushes.csv").motions
rng, plant, motions = np.random.default_rng(5), Plant(true, [[0.0, 0.0]], TIP), []
for k, (edge, along, degrees) in enumerate(
    [(0, 0.3, 25), (0, 0.7, -25), (1, 0.4, 20), (2, 0.3, -30), (2, 0.6, 30), (3, 0.5, -15), (3, 0.7, 0)]
):
    at, frames = true.outline.at(edge, along), int(LENGTH / SPEED * RATE)
    pose = np.array([0.1, -0.05, rng.uniform(-3, 3)])
    way = np.outer(np.linspace(-0.002, LENGTH, frames), rotate(np.deg2rad(degrees), at.normal))
    tips = transform(pose, at.point - TIP * at.normal + way)
    poses = plant.follow(pose, np.column_stack([tips, np.zeros(frames)])).object
    seen = poses + rng.normal(size=poses.shape) * [1e-4, 1e-4, 1.7e-3]  # 0.1 mm and 0.1° of noise
    motions.append(Motion(f"push {k}", np.arange(frames) / RATE, seen, tips, np.arange(frames)))

fitted = fit_motion(motions, believed, TIP)
loads = fitted.pressure.at(fitted.numbers).loads
print("loads of the feet:", np.round(loads, 3), "true:", np.round(np.array([2, 4, 3]) / 9, 3))
print(f"friction {fitted.thing.friction:.3f}, true 0.300")
assert np.allclose(loads, np.array([2, 4, 3]) / 9, atol=0.01)
