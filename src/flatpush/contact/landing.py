"""Where an object lies against two fingers after they have pushed it flush, whatever pose of a region it began in.

The hand moves straight and does not turn. One finger touches a straight side first and pushes alone, until the side
lies against both: the angle and the distance to the hand are then what they should be, and an offset along the side is
all that is left. What bounds it holds for every friction of the finger and every pressure in front of the side:

Let c be the centre of the object's turn, ω its rate, n the inward normal of the side, p the touched point, and σ the
speed along the side at which the finger slips. The table's force is f = Σ wᵢ ûᵢ, so along the side it is
ω Σ wᵢ n·(rᵢ - c) / |rᵢ - c| but for the sign of ω, and friction gives it the sign of σ. Where σ has the sign of ω,
some load lies ahead of c. Where it has not, some load lies behind c, and so c ahead of the side, where σ could have
that sign only by the part of the hand's own motion along the side. So per angle turned the finger slips between
nothing and the depth H of the loads ahead of the side, and by what the hand moves along it. (Where it sticks, it slips
nothing.)

How far the hand goes until both fingers hold follows from the moment of the table's force about p, which is none:
Σ wᵢ zᵢ · (zᵢ - Y e) / |zᵢ - Y e| = 0 for z = r - p and c = p + Y e. The sum falls with Y, so that the largest Y of a
set of tables is where the greatest sum over its loads is 0.
"""

from dataclasses import dataclass

import numpy as np

from ..arguments import is_finite
from ..errors import InputError
from ..geometry import Outline, cross, perpendicular
from ..geometry.pose import Array
from .placement import Placement
from .table_set import PARALLEL, SWING, TableSet

# Directions from the touched point to the turning centre that are looked at, from along the side to square to it.
WAYS = 33
# That centre is sought between these distances, by the support's radius; further off the object does not turn towards
# the other finger.
NEAR, FAR = 0.01, 200.0
BETWEEN = "Fingers further apart, a push nearer to the middle or a smaller region would do."
# Halvings of the range of distances of that centre, as ratios: to a thousandth.
HALVINGS = 14


@dataclass(frozen=True)
class StartRegion:
    """Poses about a nominal one.

    Attributes:
        position: how far the origin of the frame O may be from its place, in any direction [m].
        angle: by which it may be turned to either side [rad].

    Raises:
        InputError: with the key, for a number that is negative or not finite, and an angle above 45°.
    """

    position: float = 0.0
    angle: float = 0.0

    def __post_init__(self) -> None:
        for name, rule, most in (
            ("position", "a start region reaches so far, a length, 0 or more", np.inf),
            ("angle", "a start region is turned by at most 45° (π/4) to either side, 0 or more", np.pi / 4),
        ):
            value = getattr(self, name)
            if not (is_finite(value) and 0 <= value <= most):
                raise InputError(rule, key=f"object.uncertainty.start.{name}", value=value)

    def moves(self, distance: float) -> float:
        """The most by which the region moves a point at a distance from O's origin [m]."""
        return self.position + 2 * float(np.sin(0.5 * self.angle)) * distance


@dataclass(frozen=True, eq=False)
class Side:
    """A straight side that two fingers push at, in O.

    Attributes:
        along: unit vector, the inward normal turned to the left; normal: the inward normal.
        depth: of O's origin ahead of the side [m]. fingers: places of the touched points along it, from O's origin [m].
        room: from the touched points to the nearer end of the side [m].
        tip: radius of a fingertip [m].
        back: how far the fingers, where they land, are off the outline [m]; reach: and from O's origin, at most [m].
        size: of the outline [m].
        beside: how far the fingers, from where they land to where they push, are off its other sides; infinite for a
            convex outline, whose other sides are behind the corners [m].
    """

    along: Array
    normal: Array
    depth: float
    fingers: tuple[float, float]
    room: float
    tip: float
    back: float
    reach: float
    size: float
    beside: float

    def tilt(self, way: Array) -> float:
        """The angle between a way given in O, shape (2,), and the normal [rad]; 0 for no way."""
        return float(np.arctan2(cross(self.normal, way), self.normal @ way))

    @classmethod
    def of(cls, outline: Outline, placement: Placement, approach: float) -> "Side":
        """The side under two fingers that land an approach [m] behind it.

        Raises:
            InputError: unless both fingers touch one straight side.
        """
        (a, b), (n, m) = placement.points, placement.normals
        along = perpendicular(n)
        if outline.is_circle or float(n @ m) < 1 - PARALLEL or abs(float((b - a) @ n)) > PARALLEL:
            raise InputError(
                "only a straight side comes to rest against both fingers, and so makes up for a start that is off",
                key="object.uncertainty.start",
                hint="Push at a straight side, or leave the start region out.",
            )
        room, pushed = np.inf, set[int]()
        for point in (a, b):
            pushed.add(outline.nearest(point).edge)
            edge = outline.edges[outline.nearest(point).edge]
            room = min(room, *(float(np.hypot(*(point - corner))) for corner in edge))
        places = placement.points @ along
        tip = float(np.hypot(*(placement.points[0] - placement.tips[0])))
        landed = placement.tips - approach * n
        back = min(outline.nearest(at).distance for at in landed) - tip
        return cls(
            along, n, -float(n @ a), (float(places[0]), float(places[1])), room, tip, back,
            float(np.max(np.linalg.norm(landed, axis=1))), outline.size,
            _others(outline, pushed, landed, placement.tips) - tip,
        )  # fmt: skip


def _others(outline: Outline, pushed: set[int], landed: Array, tips: Array) -> float:
    """The distance of the ways of fingertips to the sides that are not pushed [m]; infinite for a convex outline."""
    ways = np.diff(outline.edges, axis=1)[:, 0]
    turns = cross(ways, np.roll(ways, -1, axis=0))
    if np.all(turns >= 0) or np.all(turns <= 0):
        return np.inf
    import shapely

    sides = shapely.linestrings([edge for i, edge in enumerate(outline.edges) if i not in pushed])
    return float(
        np.min(shapely.distance(sides[:, None], shapely.linestrings(np.stack([landed, tips], axis=1))))
    )


@dataclass(frozen=True)
class Landing:
    """What is left of a region of poses once a side lies against both fingers.

    Attributes:
        offset: along the side, to either side at most [m].
        gap: between a finger at its place and the side, or how deep it stands in it, at most [m].
        travel: of the hand, straight on from where it should touch, after which both fingers hold [m].
        wander: how far the touched points are from where they should be, along the side, on the way there [m].
    """

    offset: float
    gap: float
    travel: float
    wander: float


def landing(tables: TableSet, cof: Array, side: Side, region: StartRegion, tilt: float) -> Landing:
    """The first landing of a plan, at an object somewhere in a region of poses.

    Args:
        tables: the loads. cof: their nominal centre of friction, in O.
        tilt: between the hand's straight motion and the normal of the side [rad].

    Raises:
        InputError: where the object need not turn towards the other finger, or hardly, or presses behind the side.
    """
    angle, position = region.angle, region.position
    lean, ratio = abs(tilt), 1 / float(np.cos(region.angle))
    slope, slant = float(np.tan(angle)), float(np.tan(abs(tilt)))
    if lean + angle >= 0.5 * np.pi or slope * slant >= 1:
        raise InputError("the hand moves along the side that it should push", key="object.uncertainty.start")
    places = np.abs(side.fingers)
    gap = position * ratio + abs(side.depth + side.tip) * (ratio - 1) + slope * float(np.max(places))
    gap /= 1 - slope * slant
    ahead = (tables.points + cof) @ side.normal + side.depth
    if angle > 0 and float(np.min(ahead)) < -1e-9:
        raise InputError(
            "the object presses on the table behind the side that is pushed, where nothing bounds how it turns",
            key="object.uncertainty.start", hint="Push at another side.",
        )  # fmt: skip
    deep = float(np.max(ahead + tables.reach))
    beside = (position + gap * slant) * ratio + float(np.max(places)) * (ratio - 1)
    beside += side.tip * (slope - angle)
    turned = max(abs(side.depth), abs(deep - side.depth)) * slope
    wander = beside + turned + side.tip * angle
    pressed = slid = 0.0
    if angle > 0:
        pressed = angle * _turning_distance(tables, cof, side, lean + angle, wander) / np.cos(lean + angle)
        slid = pressed * float(np.sin(lean + angle))
    travel = gap / float(np.cos(lean)) + pressed
    if beside + turned + slid > region.moves(side.size):
        raise InputError(
            f"it would take {1000 * travel:.1f} mm until both fingers hold the object for every table and start, and"
            f" leave it off by up to {1000 * (beside + turned + slid):.1f} mm along the side, more than it is before",
            key="object.uncertainty.start", hint=BETWEEN,
        )  # fmt: skip
    return Landing(float(beside + turned + slid), float(gap), float(travel), float(wander + slid))


def carried(side: Side, along: Array, offset: float, tilt: float) -> Landing:
    """The next landing, of an object off by at most an offset [m] along a direction in O, its angle being right.

    Both fingers touch at once: of the offset there stays what lies along the new side.
    """
    gap = offset * abs(float(along @ side.normal))
    left = offset * abs(float(along @ side.along)) + gap * float(np.tan(abs(tilt)))
    return Landing(left, gap, gap / float(np.cos(tilt)), left)


def _turning_distance(tables: TableSet, cof: Array, side: Side, lean: float, wander: float) -> float:
    """The furthest that a turning centre is from the finger that pushes alone, on any table [m].

    For all directions from along the side to square to it, and all places of the touched point up to where it wanders:
    some of both are looked at, and what the moment may be more between is added.
    """
    farthest = 0.0
    middle = np.mean(side.fingers)
    lifts = np.linspace(-lean, 0.5 * np.pi, WAYS)[:, None]
    for place in side.fingers:
        inward = 1.0 if place < middle else -1.0
        e = np.cos(lifts) * inward * side.along + np.sin(lifts) * side.normal
        places = place + wander * np.array([-1.0, 0.0, 1.0] if wander > 0 else [0.0])
        p = places[:, None] * side.along - side.depth * side.normal
        z = tables.points + cof - p[:, None]
        low, high = NEAR * tables.radius, FAR * tables.radius
        step = float(lifts[1, 0] - lifts[0, 0])
        if np.any(_moments(tables, z, e, step, wander, high) >= 0):
            raise InputError(
                "the centre of friction does not lie between the fingers for every table and start, so that one"
                " finger alone need not turn the object against the other",
                key="object.uncertainty.start",
                hint=BETWEEN,
            )
        for _ in range(HALVINGS):
            half = float(np.sqrt(low * high))
            over = _moments(tables, z, e, step, wander, half) >= 0
            if not np.any(over):
                high = half
                continue
            low, beside = half, over.copy()  # between two directions of which neither is, nothing is further
            beside[1:] |= over[:-1]
            beside[:-1] |= over[1:]
            e = e[beside]
        farthest = max(farthest, high)
    return farthest


def _moments(tables: TableSet, z: Array, e: Array, step: float, wander: float, distance: float) -> Array:
    """Σ w q, q = z · (z - c) / |z - c|, for centres c = Y e, at most, shape (m,).

    Of each direction the greatest over the set and all touched points; between two directions it is never more than the
    greater of theirs.

    Args:
        z: of the loads from touched points that are `wander` apart, shape (k, n, 2).
        e: unit vectors, shape (m, 2); neighbours are a step apart [rad].
        distance: Y [m].
    """
    c = distance * e[:, None, None]
    apart = np.maximum(np.linalg.norm(z - c, axis=-1), 1e-12)
    unit = (z - c) / apart[..., None]
    # q = |z - c| + c · û, û of z - c; in a patch |∇q| ≤ 1 + Y/d and |∇²q| ≤ 1/d + SWING Y/d², d = |z - c|.
    h, along, across = tables.reach, tables.along, perpendicular(unit)
    near = np.maximum(apart - h, 1e-12)
    second = 0.5 * h**2 * (1 / near + SWING * distance / near**2)
    pull = np.sum(c * across, axis=-1) / apart  # ∇q = û + pull · across
    straight = np.abs(np.sum(unit * along, axis=-1) + pull * np.sum(across * along, axis=-1))
    rate = np.where(np.any(along != 0, axis=-1), straight, np.hypot(1.0, pull))
    first = np.minimum(h * (1 + distance / near), h * rate + second)
    # Along the directions q' = Y² sin 2β / (2d), β the angle at c from p to r, so that |q''| ≤ √5/2 |z| Y²/d²; along
    # the points |q''| ≤ 2/d + SWING |z|/d²; at all |q| ≤ |z|.
    size = np.linalg.norm(z, axis=-1) + h + wander
    near = np.maximum(near - distance * step - wander, 1e-12)
    bent = 0.5 * np.sqrt(5) * size * (distance * step / near) ** 2
    bent += (2 / near + SWING * size / near**2) * wander**2
    q = np.sum(z * unit, axis=-1) + np.minimum(bent / 8, 2 * size)
    return np.asarray(np.max(tables.most(q, first, second), axis=1))
