"""Random scenes as documents, in mm and degrees: what programs that compare, fuzz or soak draw their cases from."""

import numpy as np

MODELS = ("exact", "exact", "ellipsoid", "local", "quartic")
COSTS = ("flat", "flat", "pusher", "time")


def scene(seed: int, iterations: int = 300) -> dict[str, object]:
    """A scene document (flatpush: scene/1) drawn from a seed.

    Outlines are polygons of 3 to 30 corners or discs of 15 to 60 mm radius; supports are of every kind; one or two
    fingers; every model, cost and transit; half of them with bounds, of these most with obstacles that leave start
    and goal free. Searches end by iterations, never by the clock.
    """
    rng = np.random.default_rng([seed, 20])
    size = float(rng.uniform(15, 60))
    disc = rng.random() < 0.15
    outline: object = {"circle": round(size, 3)} if disc else _polygon(rng, size)
    thing = {"name": f"random {seed}", "outline": outline, "support": _support(rng, outline, size)}
    thing["friction"] = round(float(rng.uniform(0.15, 0.8)), 3)
    two = bool(rng.random() < 0.5)
    pusher: dict[str, object] = {"fingers": 1 + two, "tip_radius": round(float(rng.uniform(1, 4)), 2)}
    if two:
        pusher["spacing"] = round(float(rng.uniform(0.3, 0.8)) * size + 8, 2)
    if rng.random() < 0.3:
        pusher["transit"] = "planar"
    if not two and rng.random() < 0.15:
        pusher["turns"] = False
    start = [*np.round(rng.uniform(-3, 3, 2) * size, 2).tolist(), round(float(rng.uniform(-180, 180)), 2)]
    goal = [*np.round(rng.uniform(-3, 3, 2) * size, 2).tolist(), round(float(rng.uniform(-180, 180)), 2)]
    planning = {
        "model": MODELS[rng.integers(len(MODELS))],
        "two_finger": "cone" if rng.random() < 0.8 else "middle",
        "cost": COSTS[rng.integers(len(COSTS))],
        "margin": {"friction": round(float(rng.uniform(0, 0.3)), 2)},
        "seed": int(rng.integers(100)),
        "iterations": iterations,
        "time_limit": 1000,
    }
    document: dict[str, object] = {
        "flatpush": "scene/1",
        "units": {"length": "mm", "angle": "deg"},
        "object": thing,
        "pusher": pusher,
        "start": start,
        "goal": goal,
        "planning": planning,
    }
    if rng.random() < 0.5:
        document["workspace"] = _workspace(rng, size, start, goal)
        planning["margin"] = {**planning["margin"], "clearance": round(float(rng.uniform(0, 2)), 2)}  # type: ignore[dict-item]
    return document


def _polygon(rng: np.random.Generator, size: float) -> list[list[float]]:
    """Star-shaped about the origin: convex or not, corners at least a twentieth of the size apart."""
    n = int(rng.integers(3, 31))
    angles = np.sort(2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n)
    radii = (
        size * rng.uniform(0.6 if n > 4 else 0.8, 1.0, n) * (1 if rng.random() < 0.5 else rng.uniform(0.5, 1))
    )
    corners = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]) + rng.uniform(-20, 20, 2)
    return np.round(corners if rng.random() < 0.5 else corners[::-1], 3).tolist()  # type: ignore[no-any-return]


def _support(rng: np.random.Generator, outline: object, size: float) -> object:
    kind = int(rng.integers(5))
    centre = np.zeros(2) if isinstance(outline, dict) else np.mean(np.array(outline), axis=0)
    if kind < 2:
        return ("uniform", "outline")[kind]
    if kind == 2:
        feet = centre + 0.5 * size * rng.uniform(-1, 1, (int(rng.integers(3, 9)), 2))
        return {"points": np.round(np.column_stack([feet, rng.uniform(0.5, 2, len(feet))]), 3).tolist()}
    if isinstance(outline, dict):
        return {("disc", "ring")[kind - 3]: round(0.8 * size, 3)}
    return "uniform"


def _workspace(
    rng: np.random.Generator, size: float, start: list[float], goal: list[float]
) -> dict[str, object]:
    half = 6.5 * size + 30
    obstacles: list[list[list[float]]] = []
    for _ in range(int(rng.integers(0, 9))):
        centre, radius = rng.uniform(-4, 4, 2) * size, float(rng.uniform(0.2, 0.8)) * size
        if min(np.hypot(*(centre - start[:2])), np.hypot(*(centre - goal[:2]))) < radius + 1.2 * size + 45:
            continue
        turns = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 7))))
        if np.max(np.diff([*turns, turns[0] + 2 * np.pi])) > 2.8:
            continue
        corners = centre + radius * np.column_stack([np.cos(turns), np.sin(turns)])
        obstacles.append(np.round(corners, 3).tolist())
    return {"bounds": [-half, -half, half, half], "obstacles": obstacles}
