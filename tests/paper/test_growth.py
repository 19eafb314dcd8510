"""Errors of a single finger grow e-fold per L = r + ρ/r of travel, with the local ρ = nᵀΣn (methods 1.9, 1.17)."""

from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.geometry import transform
from flatpush.problem.mechanics import divergence_length


@pytest.mark.parametrize("support", ["uniform", "outline"])
def test_a_small_error_of_the_bearing_grows_e_fold_per_length(support):
    """A straight push of a rectangle that is turned a little about the contact: the bearing grows as e^(ℓ/L)."""
    thing = fp.Object([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)], support, 0.8)
    push = fp.Push("below", thing.outline.at(3, 0.5))
    scene = fp.Scene(thing, (0.0, -0.16, 0.0), pushes=(push,), pusher=fp.Pusher(tip_radius=0.0))
    plan = fp.plan(scene)
    contact = np.array([0.0, -0.0175])
    length = divergence_length(thing, fp.PointContact(contact, [0.0, 1.0], 0.8))
    error = 1e-5
    turned = np.array([0.0, 0.0, error])
    # Turn the object about the contact, so that only the bearing of its centre is off.
    start = scene.start_pose + np.array([*(contact - transform(turned, contact)), error])
    rollout = fp.simulate(replace(plan, scene=replace(scene, start=start)))
    bearing = np.array(
        [np.arctan2(*(pose[:2] - tip[:2])) for pose, tip in zip(rollout.object, rollout.pusher, strict=True)]
    )
    travel = rollout.pusher[:, 1] - rollout.pusher[0, 1]
    sticks = [i for i, mode in enumerate(rollout.modes) if mode == "sticking"]
    first, last = sticks[0], next(i for i in sticks if abs(bearing[i]) > 30 * error)
    measured = (travel[last] - travel[first]) / np.log(bearing[last] / bearing[first])
    assert measured == pytest.approx(length, rel=0.02)
