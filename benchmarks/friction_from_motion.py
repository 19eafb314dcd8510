"""Friction from motion alone, in the simulator: python benchmarks/friction_from_motion.py N [SEED [KIND…]].

N random objects of each kind of support; each is pushed ten times for 100 mm by one finger within 35° of the normal,
and seen at 30 Hz with 0.1 mm and 0.1° of noise. Printed: turning radii against the truth where they lie between a fifth
and five times the size (below: absolute), friction, and how two-finger plans from the fitted table end on the true one,
executed straight from sample to sample: with the uncertainty that identify writes, without it, and without margin.
"""

import sys
import time
from dataclasses import replace

import numpy as np
import shapely

from flatpush import plan
from flatpush.documents.motion_file import Motion
from flatpush.errors import FlatpushError
from flatpush.friction import Support
from flatpush.geometry import Outline, OutlinePoint, pose_error, rotate, transform
from flatpush.identification import MotionFit, fit_motion, turning_radius
from flatpush.identification.fit import _fitted
from flatpush.identification.pressure import FreeFeet
from flatpush.planning.reserve import reserve
from flatpush.problem import Object, Planning, Pusher, Scene, Uncertainty
from flatpush.simulation.plant import Plant
from flatpush.simulation.rollout import roll

KINDS = ("known feet", "face", "rim", "unknown feet")
TIP, LENGTH, SPEED, RATE = 0.0025, 0.1, 0.02, 30
NOISE = np.array([1e-4, 1e-4, np.deg2rad(0.1)])
EXPECTED_FRICTION = 0.35  # what the scene says before the fit


def random_object(rng: np.random.Generator, kind: str) -> Object:
    """A star-shaped polygon of 50 to 100 mm, with a random support."""
    while True:
        n = int(rng.integers(3, 7))
        angles, reach = np.sort(rng.uniform(0, 2 * np.pi, n)), rng.uniform(0.025, 0.05, n)
        corners = reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        shape = shapely.Polygon(corners)
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        if shape.is_valid and shape.area > 0.0015 and sides.min() > 0.025:
            break
    friction = float(rng.uniform(0.2, 0.6))
    if kind in ("face", "rim"):
        return Object(corners, support="uniform" if kind == "face" else "outline", friction=friction)
    count = 3 if kind == "known feet" else int(rng.integers(4, 9))
    inside = shape.buffer(-0.002)
    while True:
        places = rng.uniform(-0.05, 0.05, (200, 2))
        places = places[shapely.contains_xy(inside, *places.T)][:count]
        if shapely.MultiPoint(places).convex_hull.area > 0.2 * shape.area:
            break
    return Object(corners, support=Support.points(places, rng.uniform(0.3, 1, count)), friction=friction)


def expected(thing: Object, kind: str) -> Object:
    """What is known of the object before it is pushed."""
    support = Support.points(thing.support.feet[0]) if kind == "known feet" else "uniform"
    return Object(thing.outline, support, EXPECTED_FRICTION)


def recorded(
    rng: np.random.Generator, thing: Object, count: int = 10, length: float = LENGTH
) -> list[Motion]:
    """Pushes of one finger at random places, as a camera sees them."""
    outline, plant = thing.outline, Plant(thing, [[0.0, 0.0]], TIP)
    sides = np.linalg.norm(outline.edges[:, 1] - outline.edges[:, 0], axis=1)
    found: list[Motion] = []
    while len(found) < count:
        edge = int(rng.choice(len(sides), p=sides / sides.sum()))
        at = outline.at(edge, float(rng.uniform(0.2, 0.8)))
        begin = at.point - TIP * at.normal
        if outline.nearest(begin).distance < TIP - 1e-9:
            continue
        direction = rotate(rng.uniform(-1, 1) * np.deg2rad(35), at.normal)
        frames = int(length / SPEED * RATE)
        pose = np.array([0.0, 0.0, rng.uniform(-3, 3)])
        tips = transform(pose, begin + np.outer(np.linspace(-0.002, length, frames), direction))
        run = plant.follow(pose, np.column_stack([tips, np.zeros(frames)]))
        if not run.outcome:
            seen = run.object + rng.normal(size=(frames, 3)) * NOISE
            found.append(
                Motion(f"push {len(found)}", np.arange(frames) / RATE, seen, tips, np.arange(frames) + 2)
            )
    return found


def places(outline: Outline) -> list[OutlinePoint]:
    return [outline.at(edge, along) for edge in range(len(outline.vertices)) for along in (0.3, 0.5, 0.7)]


def compared(fit: MotionFit, thing: Object) -> tuple[list[float], list[float]]:
    """Relative errors of the radii, and absolute ones of the small [m]."""
    relative, absolute = [], []
    for at in places(thing.outline):
        true, found = turning_radius(thing, at), turning_radius(fit.thing, at)
        if not (np.isfinite(true) and np.isfinite(found)) or true > 5 * thing.outline.size:
            continue
        if true < 0.2 * thing.outline.size:
            absolute.append(abs(found - true))
        else:
            relative.append(abs(found / true - 1))
    return relative, absolute


def from_truth(fit: MotionFit, thing: Object) -> MotionFit:
    """The fit of as many feet as there are, begun where they stand: no search of the same numbers finds more."""
    places, loads = thing.support.feet
    family = FreeFeet(thing.outline, len(loads))
    return _fitted(family, family.numbers(places, loads / loads.sum()), fit.seen, fit.thing, TIP)


def asked(thing: Object, margin: float) -> Scene:
    """A scene in which two fingers bring the object to the origin."""
    pusher = Pusher(fingers=2, spacing=0.012, tip_radius=TIP)
    planning = Planning(iterations=300, friction_margin=margin)
    return Scene(thing, (0.1, 0.0, 0.0), (0.0, 0.0, 0.0), pusher, planning=planning)


def as_written(fit: MotionFit) -> Object:
    """The fitted object with the uncertainty of its loads that identify writes."""
    kept = reserve(fit, asked(fit.thing, 0.2))
    return replace(fit.thing, uncertainty=Uncertainty(kept.loads) if kept and kept.loads else None)


def plan_ends(
    rng: np.random.Generator, assumed: Object, thing: Object, margin: float
) -> tuple[float, float] | None:
    """Where a two-finger plan made for the assumed table ends on the true one [m, rad]; None if there is no plan."""
    start = np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(-3, 3)])
    scene = replace(asked(assumed, margin), start=start)
    try:
        made = plan(scene)
    except FlatpushError:
        return None
    if made.status != "solved":
        return None
    rolled = roll(made, [replace(made.scene, object=thing)], "exact", "samples")
    error = pose_error(rolled.final[0], scene.goal_pose)
    return float(np.hypot(*error[:2])), float(abs(error[2]))


def main(count: int, seed: int, kinds: tuple[str, ...] = KINDS) -> None:
    every: dict[str, list[tuple[float, float] | None]] = {
        "fitted": [],
        "fitted, loads taken as exact": [],
        "fitted, no margin": [],
        "uniform": [],
    }
    for kind in kinds:
        relative, absolute, friction, spent = [], [], [], []
        best: tuple[list[float], list[float]] = [], []
        for k in range(count):
            rng = np.random.default_rng([seed, KINDS.index(kind), k])
            thing = random_object(rng, kind)
            motions = recorded(rng, thing)
            began = time.process_time()
            fit = fit_motion(motions, expected(thing, kind), TIP)
            spent.append(time.process_time() - began)
            errors = compared(fit, thing)
            relative += errors[0]
            absolute += errors[1]
            if kind == "unknown feet":
                for of, more in zip(best, compared(from_truth(fit, thing), thing), strict=True):
                    of += more
            friction.append(abs(fit.thing.friction / thing.friction - 1))
            uniform = Object(thing.outline, "uniform", fit.thing.friction)
            for what, assumed, margin in (
                ("fitted", as_written(fit), 0.2),
                ("fitted, loads taken as exact", fit.thing, 0.2),
                ("fitted, no margin", fit.thing, 0.0),
                ("uniform", uniform, 0.2),
            ):
                way = np.random.default_rng([seed, 9, k])
                every[what].append(plan_ends(way, assumed, thing, margin))
            print(
                f"{kind} {k}: {fit.pressure.name}, radii {_two(errors[0])}, μ {100 * friction[-1]:.1f} %,"
                f" plan {every['fitted'][-1]}", flush=True,
            )  # fmt: skip
        print(
            f"{kind}: {count} objects, {len(relative)} radii, median and 95 % {_two(relative)}; small ones"
            f" {_two_mm(absolute)}; μ worst {100 * max(friction):.1f} %; a fit {np.median(spent):.1f} s"
            f" ({max(spent):.1f} at most)",
            flush=True,
        )
        if best[0]:
            print(f"  begun at the truth: {_two(best[0])}; small ones {_two_mm(best[1])}", flush=True)
    for what, ends in every.items():
        made = np.array([end for end in ends if end is not None])
        if not len(made):
            continue
        near = np.mean((made[:, 0] < 5e-4) & (made[:, 1] < np.deg2rad(0.5)))
        worst = made.max(axis=0)
        print(
            f"two-finger plans, {what}: {len(made)} of {len(ends)} found, {100 * near:.0f} % within 0.5 mm and 0.5°,"
            f" worst {1000 * worst[0]:.2f} mm and {np.rad2deg(worst[1]):.2f}°"
        )


def _two(values: list[float]) -> str:
    return f"{100 * np.median(values):.1f} and {100 * np.percentile(values, 95):.1f} %" if values else "none"


def _two_mm(values: list[float]) -> str:
    return (
        f"{1000 * np.median(values):.2f} and {1000 * np.percentile(values, 95):.2f} mm" if values else "none"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0, tuple(sys.argv[3:]) or KINDS)
