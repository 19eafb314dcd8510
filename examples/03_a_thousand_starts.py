"""A thousand starts: what does not depend on the start is built once, and then every plan takes milliseconds."""

import time

import numpy as np

import flatpush as fp

corners = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
two = fp.Pusher(fingers=2, spacing=0.018)
planner = fp.Planner(fp.Scene(fp.Object(corners, "outline"), (0.06, 0.02, 2.6), pusher=two))
planner.plan()  # loads the compiled kernels

starts = np.random.default_rng(0).uniform(-1, 1, (1000, 3)) * [0.15, 0.15, np.pi]
began = time.process_time()
plans = planner.plans(starts)
each = (time.process_time() - began) / len(plans)

pushes = np.array([len(plan.pushes) for plan in plans])
costs = np.array([plan.cost for plan in plans])
print(f"{len(plans)} plans, {1000 * each:.1f} ms of CPU each")
print(f"pushes: {', '.join(f'{n} in {np.sum(pushes == n)}' for n in np.unique(pushes))}")
print(f"cost: median {1000 * np.median(costs):.0f} mm, most {1000 * costs.max():.0f} mm")
worst = plans[int(np.argmax(costs))]
assert all(plan.status == "solved" for plan in plans)
assert fp.verify(worst).ok
