"""What hypothesis draws: outlines, supports, poses, twists and wrenches themselves, so that what fails shrinks.

Numbers come from a grid: no draw is a rounding away from another, and coincidences (a rotation centre on a foot, sides
that are parallel) are frequent.
"""

import numpy as np
from hypothesis import strategies as st

from flatpush.friction import Support
from flatpush.geometry import Outline

GRID = 1000  # steps between the ends of a range
SUPPORTS = ("feet", "polygon", "outline", "disc", "ring")


def reals(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers from low to high on a grid; they shrink towards the one nearest to 0."""
    step = (high - low) / GRID
    first = int(np.ceil(low / step - 1e-9))
    return st.integers(first, first + GRID).map(lambda k: min(max(k * step, low), high))


def vectors(reach: float, size: int = 2) -> st.SearchStrategy[np.ndarray]:
    """Points or other vectors, each component within ± reach."""
    return st.tuples(*[reals(-reach, reach)] * size).map(np.array)


def poses(reach: float, turn: float = 4.0) -> st.SearchStrategy[np.ndarray]:
    """Poses (x, y, θ) within ± reach and ± turn."""
    return st.tuples(reals(-reach, reach), reals(-reach, reach), reals(-turn, turn)).map(np.array)


@st.composite
def stars(draw: st.DrawFn, size: float = 1.0, most: int = 8, spread: float = 0.4) -> np.ndarray:
    """Corners of a simple polygon of that size, convex or not, in either sense, shape (n, 2); n from 3 to `most`.

    Each corner is turned by up to `spread` of the angle between two, so that with less than 0.25 the origin is inside.
    """
    n = draw(st.integers(3, most))
    angles = [2 * np.pi * (k + draw(reals(-spread, spread))) / n for k in range(n)]
    radii = [size * draw(reals(0.3, 1.0)) for _ in range(n)]
    corners = np.array([[r * np.cos(a), r * np.sin(a)] for r, a in zip(radii, angles, strict=True)])
    return corners[::-1] if draw(st.booleans()) else corners


@st.composite
def outlines(draw: st.DrawFn, size: float, reach: float) -> Outline:
    """A polygon or circle of at most that size about a place within ± reach."""
    at = draw(vectors(reach))
    if draw(st.integers(0, 3)) == 0:
        return Outline.circle(size * draw(reals(0.1, 1.0)), at)
    return Outline.polygon(draw(stars(size * draw(reals(0.1, 1.0)))) + at)


@st.composite
def supports(draw: st.DrawFn, kinds: tuple[str, ...] = SUPPORTS) -> Support:
    """A support of radius about 1, as a rule not centred; feet are never in one line."""
    kind, place = draw(st.sampled_from(kinds)), draw(vectors(2.0))
    if kind == "feet":
        feet = [*draw(stars(most=3, spread=0.2)), *draw(st.lists(vectors(1.0), max_size=9))]
        weights = [draw(reals(0.05, 1.0)) for _ in feet]
        return Support.points(np.array(feet) + place, weights)
    if kind in ("polygon", "outline"):
        return getattr(Support, kind)(draw(stars()) + place)
    return getattr(Support, kind)(draw(reals(0.2, 1.0)), place)


@st.composite
def twists(draw: st.DrawFn, support: Support, most: int = 6) -> np.ndarray:
    """Rotations about centres near and far, some on feet, and translations, shape (n, 3)."""
    feet, _ = support.feet
    found = []
    for _ in range(draw(st.integers(1, most))):
        kind = draw(st.sampled_from(["near", "far", "translation", *(["foot"] if len(feet) else [])]))
        if kind == "translation":
            angle = draw(reals(-np.pi, np.pi))
            found.append([np.cos(angle), np.sin(angle), 0.0])
            continue
        x, y = draw(st.sampled_from(list(feet))) if kind == "foot" else draw(vectors(3.0))
        scale = 10.0 ** draw(st.integers(0, 3)) if kind == "far" else 1.0
        found.append(draw(st.sampled_from([1.0, -1.0])) * np.array([scale * y, -scale * x, 1.0]))
    return np.array(found)


@st.composite
def directions(draw: st.DrawFn, size: int = 3) -> np.ndarray:
    """Vectors of which no component but perhaps one is nearly everything, and that are not zero."""
    vector = draw(vectors(1.0, size))
    return vector if np.linalg.norm(vector) > 0.05 else vector + np.eye(size)[draw(st.integers(0, size - 1))]
