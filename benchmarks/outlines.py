"""Automatic pushes of outlines with many corners: python benchmarks/outlines.py

A smooth shape of 1000 and of 10,000 corners, and a mask of an ellipse with some 900 steps. Prints the CPU time of the
candidates and their cars (goals: 1.5 s and 5 s; a first outline compiles and is left out) and the places of the pushes.
"""

import time

import numpy as np

import flatpush as fp
from flatpush.documents.bitmap import without_steps
from flatpush.geometry import Outline


def smooth(corners: int) -> np.ndarray:
    """A body with three lobes, 80 mm across, shape (corners, 2) [m]."""
    t = 2 * np.pi * np.arange(corners) / corners
    radius = 0.04 * (1 + 0.15 * np.cos(3 * t))
    return np.column_stack([radius * np.cos(t), radius * np.sin(t)])


def steps() -> np.ndarray:
    """The outline of an ellipse's pixels, corner by corner, of 0.2 mm."""
    y, x = np.mgrid[-170:170, -280:280] + 0.5
    inside = (x / 270) ** 2 + (y / 160) ** 2 <= 1
    widths = inside.sum(axis=1)
    rows = np.flatnonzero(widths)
    right = [(widths[r] / 2, r + side) for r in rows for side in (0, 1)]
    corners = [*right, *((-x, y) for x, y in reversed(right))]
    kept = [p for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True) if tuple(p) != tuple(q)]
    return 0.0002 * np.array(kept)


def main() -> None:
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pixelled = steps()
    found = without_steps(pixelled)
    for name, corners in (
        ("first, compiles", smooth(100)),
        ("1000 corners", smooth(1000)),
        ("10,000 corners", smooth(10_000)),
        (f"a mask of {len(pixelled)} corners", pixelled if found is None else found[0]),
    ):
        thing = fp.Object(Outline.polygon(corners), friction=0.3)
        began = time.process_time()
        planner = fp.Planner(fp.Scene(thing, (0.1, 0, 1), pusher=pusher))
        spent = time.process_time() - began
        places = [f"({1000 * x:.1f}, {1000 * y:.1f})" for x, y in (p.at.point for p in planner.scene.pushes)]
        print(f"{name}: {spent:.2f} s; {len(places)} pushes at {', '.join(places)} mm", flush=True)


if __name__ == "__main__":
    main()
