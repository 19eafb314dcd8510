"""What a proof for a set of tables buys: python benchmarks/proved_tables.py [OBJECTS] [DRAWS] [SEED].

Random objects on three to six feet, pushed by two fingers; loads within ± 20 %, finger friction from 80 % up, which is
the reserve that every plan keeps. For each object a plan that is proved for the set and one that holds on the nominal
table only are rolled out in the plant, with the exact surface of the drawn loads: first the vertices of the polytope of
loads, then loads and friction from inside the set. Counted are runs in which a finger slides or lets go after it first
held. A third plan, of a wider hand, is for a start within 1 mm and 1° of its place as well: of its runs, from the
corners of that region first, those are counted that end outside of the region that it states, or do not end. Printed
beside it: what the proof costs in length, against the nominal plan of the same reserve and that of the paper's middle
contact, and in CPU time.
"""

import sys
import time
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

import flatpush as fp
from flatpush.simulation.proof import proof_of
from flatpush.simulation.rollout import roll

SHARE, LEAST = 0.2, 0.8  # of the loads; of the friction between finger and object
REGION = fp.StartRegion(0.001, float(np.deg2rad(1.0)))
WIDER = {"approach": 0.003, "spacing": 0.024}  # the hand of plans for such starts [m]
LIMIT = 0.05  # a start is within so many metres of the goal in x and in y


def thing(rng: np.random.Generator) -> fp.Object:
    """A polygon with feet on it."""
    angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
    while np.max(np.diff(angles, append=angles[0] + 2 * np.pi)) > 2.6:
        angles = np.sort(rng.uniform(0, 2 * np.pi, len(angles)))
    outline = 0.035 * np.stack([np.cos(angles), np.sin(angles)], axis=1) * rng.uniform(0.8, 1.2, 2)
    count = int(rng.integers(3, 7))
    feet = np.array([rng.dirichlet(np.ones(len(outline))) @ outline for _ in range(count)])
    support = fp.Support.points(feet, rng.uniform(0.7, 1.3, count))
    return fp.Object(outline, support, friction=0.4, uncertainty=fp.Uncertainty(SHARE))


def vertices(weights: np.ndarray) -> np.ndarray:
    """Loads at the ends of all ranges but one, which makes their sum right, shape (n, feet)."""
    found = []
    for k in range(len(weights)):
        for signs in product((-1.0, 1.0), repeat=len(weights) - 1):
            loads = weights * (1 + SHARE * np.insert(np.array(signs), k, 0.0))
            loads[k] += weights.sum() - loads.sum()
            if abs(loads[k] - weights[k]) <= SHARE * weights[k] + 1e-12:
                found.append(loads)
    return np.array(found)


def drawn(scene: fp.Scene, number: int, rng: np.random.Generator) -> list[fp.Scene]:
    """The scene on tables of the set: vertices first, then from inside."""
    points, weights = scene.object.support.feet
    ends = vertices(weights)
    scenes = []
    for i in range(number):
        if i < len(ends):
            loads, mu = ends[i], (LEAST, 1.0)[i % 2] * scene.object.friction
        else:
            mixed = rng.dirichlet(np.full(len(ends), 0.3)) @ ends
            loads, mu = mixed, rng.uniform(LEAST, 1.0) * scene.object.friction
        body = replace(scene.object, support=fp.Support.points(points, loads), friction=mu, uncertainty=None)
        scenes.append(replace(scene, object=body))
    return scenes


def failures(plan: Any, scenes: list[fp.Scene]) -> tuple[int, int]:
    """Runs that do not stick throughout, and runs that do not end."""
    rolled = roll(plan, scenes, "exact", "samples")
    return int(np.sum(~rolled.sticking)), sum(word != "completed" for word in rolled.outcomes)


def moved(scenes: list[fp.Scene], rng: np.random.Generator) -> list[fp.Scene]:
    """The same with starts of the region: on its rim with the angle at an end, in every other scene inside."""
    found = []
    for i, scene in enumerate(scenes):
        way, turn = rng.uniform(0, 2 * np.pi), rng.choice([-1.0, 1.0]) * REGION.angle
        far = REGION.position
        if i % 2:
            far, turn = far * np.sqrt(rng.uniform()), rng.uniform(-1, 1) * REGION.angle
        start = scene.start_pose + np.array([far * np.cos(way), far * np.sin(way), turn])
        found.append(replace(scene, start=start))
    return found


def astray(plan: Any, scenes: list[fp.Scene]) -> tuple[int, float]:
    """Runs that do not end in the region that a plan states, and the farthest end, as a share of its half sides."""
    rolled = roll(plan, scenes, "exact", "samples")
    errors = np.abs([plan.scene.goal_error(pose) for pose in rolled.final])
    box = np.array([*plan.certificate.set_end, 0.0]) + 1e-6
    ended = np.array([word == "completed" for word in rolled.outcomes])
    return int(np.sum(~(ended & np.all(errors <= box, axis=1)))), float(np.max(errors[:, :2] / box[:2]))


def planned(
    body: fp.Object, start: tuple[float, ...], hand: dict[str, float] | None = None, **planning: Any
) -> tuple[Any, float]:
    """A plan and the CPU seconds that it took, nothing of the object being known before."""
    pusher = fp.Pusher(fingers=2, **({"spacing": 0.014} if hand is None else hand))
    scene = fp.Scene(replace(body), start, pusher=pusher, planning=fp.Planning(iterations=300, **planning))
    began = time.process_time()
    return fp.plan(scene), time.process_time() - began


def main(objects: int = 50, draws: int = 200, seed: int = 0) -> None:
    rng = np.random.default_rng(seed)
    kinds: dict[str, dict[str, Any]] = {
        "set": {"proof": "set"},
        "nominal": {"proof": "nominal"},
        "middle": {"proof": "nominal", "two_finger": "middle"},
    }
    total = {kind: np.zeros(3, int) for kind in ("set", "nominal")}
    costs, taken, proving, anywhere = [], [], [], []
    body = thing(rng)
    planned(body, (0.05, 0.0, 1.0))  # compiles
    for k in range(objects):
        start = (*rng.uniform(-LIMIT, LIMIT, 2), rng.uniform(-np.pi, np.pi))
        plans, times = zip(*(planned(body, start, **options) for options in kinds.values()), strict=True)
        proved, nominal, _ = plans
        if proved.status != "solved" or nominal.status != "solved":
            print(f"object {k}: {proved.reason or nominal.reason}")
        else:
            costs.append([plan.cost if plan.status == "solved" else np.inf for plan in plans])
            taken.append(times)
            began = time.process_time()
            proof_of(proved.scene, proved.pushes)
            proving.append(time.process_time() - began)
            scenes = drawn(proved.scene, draws, rng)
            for kind, plan in (("set", proved), ("nominal", nominal)):
                slips, unended = failures(plan, scenes)
                total[kind] += slips, unended, slips > 0
                print(f"object {k}, {kind}: {slips} of {draws} slip, {unended} do not end", flush=True)
            known = replace(body.uncertainty, start=REGION)
            beside, before = planned(body, start, WIDER)
            plan, seconds = planned(replace(body, uncertainty=known), start, WIDER)
            if plan.status != "solved":
                print(f"object {k}, any start: {plan.reason.splitlines()[0]}", flush=True)
            else:
                out, far = astray(plan, moved(drawn(plan.scene, draws, rng), rng))
                anywhere.append((out, plan.cost / beside.cost, len(plan.pushes), seconds / before))
                print(
                    f"object {k}, any start: {out} of {draws} end elsewhere, the farthest at {far:.2f} of its region"
                )
        body = thing(rng)
    if not costs:
        return
    for kind, (slips, unended, some) in total.items():
        runs = len(costs) * draws
        print(
            f"{kind}: {slips} of {runs} runs slip ({100 * slips / runs:.1f} %), {unended} do not end;",
            end=" ",
        )
        print(f"{some} of {len(costs)} objects have a table that slips")
    if anywhere:
        out, ratio, pushes, slower = np.array(anywhere).T
        print(
            f"any start: {out.sum():.0f} of {len(out) * draws} runs end elsewhere; {len(out)} of {len(costs)} objects"
            f" have a plan, of {np.median(pushes):.0f} pushes and {np.median(ratio):.2f} times the cost in the median,"
            f" planned in {np.median(slower):.2f} times the time"
        )
    by_set, by_nominal, by_middle = np.array(costs).T
    print("set, nominal, middle [mm]:", np.round(1000 * np.array(costs), 1).tolist())
    print(
        f"a proved plan costs {np.median(by_set / by_nominal):.2f} times the nominal one in the median, "
        f"{np.median(by_set / by_middle):.2f} times that of the middle contact, and less than that in "
        f"{np.sum(by_set < by_middle)} of {len(costs)}"
    )
    ratio = np.divide(*np.array(taken).T[:2])
    print(
        f"planning takes {np.median(ratio):.2f} times as long (worst {ratio.max():.2f}); "
        f"proof {1000 * np.median(proving):.1f} ms, worst {1000 * np.max(proving):.1f} ms of CPU"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
