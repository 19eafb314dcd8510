"""The 200 scenes of the challenge: python benchmarks/challenge/scenes.py [--unpack DIR]

Writes scenes.jsonl beside this file, one scene document a line, or with --unpack each scene as a file of its own.
Scene k has two fingers if k & 1, friction at the fingers if k & 2, and obstacles if k & 4. Objects stand on three to
five feet, so that what presses where is known to every simulator.
"""

import json
import sys
from pathlib import Path

import numpy as np
import shapely

SEED, COUNT = 2026, 200
FILE = Path(__file__).with_name("scenes.jsonl")
FARTHEST = 180.0  # of a start from its goal [mm]
HALF = 260.0  # side of the table [mm]
ROOM = 25.0  # between an obstacle and the object at start and goal, for fingers [mm]
TIP, SPACING = 2.5, 18.0  # [mm]
WITHIN = (2.0, 2.0, 2.0)  # of the goal [mm, mm, deg]
KINDS = ("rectangle", "triangle", "disc", "T", "L")


def scene(number: int) -> dict[str, object]:
    """A scene document (flatpush: scene/1), mm and degrees."""
    rng = np.random.default_rng([SEED, number])
    two, rough, crowded = (bool(number & bit) for bit in (1, 2, 4))
    kind = KINDS[int(rng.integers(len(KINDS)))]
    outline, shape = _outline(kind, rng)
    pusher = (
        {"fingers": 2, "spacing": SPACING, "tip_radius": TIP} if two else {"fingers": 1, "tip_radius": TIP}
    )
    far, bearing = rng.uniform(40.0, FARTHEST), rng.uniform(-np.pi, np.pi)
    start = [far * np.cos(bearing), far * np.sin(bearing), rng.uniform(-180.0, 180.0)]
    document: dict[str, object] = {
        "flatpush": "scene/1",
        "units": {"length": "mm", "angle": "deg"},
        "object": {
            "name": f"{kind} {number}",
            "outline": outline,
            "support": {"points": _feet(shape, rng)},
            "friction": round(float(rng.uniform(0.2, 0.5)), 3) if rough else 0.0,
        },
        "pusher": pusher,
        "start": np.round(start, 2).tolist(),
        "goal": [0.0, 0.0, 0.0],
        "planning": {"goal_tolerance": list(WITHIN)},
    }
    if crowded:
        document["workspace"] = {
            "bounds": [-HALF, -HALF, HALF, HALF],
            "obstacles": _obstacles(shape, start, rng),
        }
    return document


def _outline(kind: str, rng: np.random.Generator) -> tuple[object, shapely.Polygon]:
    """As in a scene document, and as a polygon; its centroid at the origin."""
    a, b = rng.uniform(44.0, 70.0, 2)
    if kind == "disc":
        radius = round(float(0.5 * a), 2)
        return {"circle": radius}, shapely.Point(0.0, 0.0).buffer(radius)
    thick = float(rng.uniform(18.0, 22.0))
    corners = {
        "rectangle": [(0, 0), (a, 0), (a, 0.7 * b), (0, 0.7 * b)],
        "triangle": [(0, 0), (a, 0), (rng.uniform(0.2, 0.8) * a, b)],
        "T": [(0, 0), (a, 0), (a, thick), ((a + thick) / 2, thick), ((a + thick) / 2, b), ((a - thick) / 2, b),
              ((a - thick) / 2, thick), (0, thick)],
        "L": [(0, 0), (a, 0), (a, thick), (thick, thick), (thick, b), (0, b)],
    }[kind]  # fmt: skip
    points = np.array(corners) - shapely.Polygon(corners).centroid.coords[0]
    rounded = np.round(points, 2).tolist()
    return rounded, shapely.Polygon(rounded)


def _feet(shape: shapely.Polygon, rng: np.random.Generator) -> list[list[float]]:
    """Three to five feet (x, y, load) off the rim that do not stand nearly in a line."""
    inside, size = shape.buffer(-4.0), np.sqrt(shape.area)
    while True:
        count = int(rng.integers(3, 6))
        places = rng.uniform(-0.8, 0.8, (count, 2)) * size
        whole = shapely.MultiPoint(places)
        if inside.covers(whole) and whole.convex_hull.area > 0.12 * shape.area:
            loads = rng.uniform(1.0, 2.0, count)
            return np.round(np.column_stack([places, loads]), 2).tolist()  # type: ignore[no-any-return]


def _obstacles(
    shape: shapely.Polygon, start: list[float], rng: np.random.Generator
) -> list[list[list[float]]]:
    """Two to five, clear of the object and its fingers at start and goal however it is turned."""
    reach = float(np.max(np.linalg.norm(np.array(shape.exterior.coords), axis=1))) + ROOM
    keep = shapely.MultiPoint([start[:2], [0.0, 0.0]]).buffer(reach)
    found: list[list[list[float]]] = []
    wanted = int(rng.integers(2, 6))
    while len(found) < wanted:
        corners = rng.uniform(-HALF, HALF, 2) * 0.8 + rng.uniform(-45.0, 45.0, (5, 2))
        hull = shapely.MultiPoint(np.round(corners, 2)).convex_hull
        if hull.area > 200.0 and not hull.intersects(keep):
            found.append([list(p) for p in hull.exterior.coords[:-1]])
    return found


def line(number: int) -> str:
    """A scene as it stands in the file."""
    return json.dumps(scene(number), separators=(",", ":"))


def main(words: list[str]) -> None:
    if words[:1] == ["--unpack"] and len(words) == 2:
        folder = Path(words[1])
        folder.mkdir(parents=True, exist_ok=True)
        for k, line in enumerate(FILE.read_text(encoding="utf-8").splitlines()):
            (folder / f"scene-{k:03d}.json").write_text(line + "\n", encoding="utf-8")
    elif not words:
        FILE.write_text("".join(line(k) + "\n" for k in range(COUNT)), encoding="utf-8")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
