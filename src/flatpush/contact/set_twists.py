"""The car of two fingers for every table of a set: the tightest turns that all of its tables allow."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import NoDubinsReduction
from ..geometry import perpendicular, rotate
from ..geometry.pose import Array
from .table_set import TableSet
from .wrench_cone import WrenchCone

# Families of motions: directions beside the nominal straight one [rad], and where they are held, by the distance of the
# nominal turning centres ahead of the centre of friction.
DIRECTIONS = np.deg2rad(np.linspace(-30.0, 30.0, 21))
# Where no more of the directions than FEW are kept, those beside the best are looked at instead.
FEW, CLOSER = 1, np.deg2rad(np.linspace(-3.0, 3.0, 21))
AHEAD = np.array([0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5])
# The best of them are tried again with their distances changed by these shares: where the set is nearly too large, the
# motions that are left are a sliver.
NEARER = np.array([-0.3, -0.225, -0.15, -0.075, 0.0, 0.075, 0.15, 0.225, 0.3])
# Turns are looked at between these radii, by the support's, in so many steps; families are compared on finer rungs.
WIDE, TIGHT, STEPS, RUNGS = 100.0, 0.1, 40, 256
# Points of the pressure on which families are compared, and how many of the best are then proved.
SKETCH, TRIED = 64, 6


def set_twists(tables: Sequence[TableSet], cone: WrenchCone, nominal: ArrayLike) -> Array:
    """A left turn, a straight motion and a right turn that every table of a set allows, turning as tightly as it can.

    Motions are looked at in families: a point ahead of the centre of friction, at shares of the distance of the nominal
    turning centres, moves in one direction while the turn per length grows from nothing to the first motion that some
    table does not allow. Of all families the two are taken whose turning centres are nearest to each other, and the
    straight motion that is square to the line between them if every table allows it, else the nearest that is.

    Args:
        tables: at every place that they may have in the hand, their own first (see TableSet.held); all must keep a
            motion.
        cone: of the fingers, about the nominal centre of friction.
        nominal: left, straight and right on the nominal table, shape (3, 3); see cone_twists.

    Returns:
        Twists about the nominal centre of friction, shape (3, 3); the turns have ω = 1 and -1, the other unit speed.

    Raises:
        NoDubinsReduction: if the tables have no straight motion, or no turn to either side, in common.
    """
    ways, families, leaning = _families(tables, cone, nominal)
    if not len(ways):
        raise NoDubinsReduction("the fingers cannot push straight without slipping on every table of the set")
    shares = np.repeat(AHEAD, len(ways))
    # Which families turn tightest is seen on few points; how tightly they may is then proved.
    sketch = [_sketched(place) for place in tables] if len(tables[0].points) > SKETCH else tables
    found = []
    for sense in (1.0, -1.0):
        first = _turning_most(sketch, cone, families, np.outer(shares, leaning), sense)
        best, near = (
            np.repeat(families[first], len(NEARER), axis=0),
            np.add.outer(shares[first], NEARER).ravel(),
        )
        first = _turning_most(sketch, cone, best, np.outer(near, leaning), sense)
        centres, tight = _tightest(tables, cone, best[first], np.outer(near[first], leaning), sense)
        found.append(centres[tight > 0])
    lefts, rights = found
    if not len(lefts) or not len(rights):
        raise NoDubinsReduction("the fingers cannot turn the object both ways on every table of the set")
    pair = int(np.argmin(np.linalg.norm(lefts[:, None] - rights[None], axis=2)))
    left, right = lefts[pair // len(rights)], rights[pair % len(rights)]
    square = -perpendicular(left - right)
    square = square / np.hypot(*square)
    if not _kept(tables, cone, np.array([*square, 0.0])):
        square = ways[int(np.argmax(ways @ square))]
    return np.stack([[*-perpendicular(left), 1.0], [*square, 0.0], [*perpendicular(right), -1.0]])


def _sketched(tables: TableSet) -> TableSet:
    """The same on few points, as if all pressed there."""
    few = TableSet.of(tables.support, tables.share, SKETCH)
    return replace(
        few,
        support=tables.support,
        points=few.points + tables.support.centre,
        reach=np.zeros(1),
        step=tables.step,
        aside=tables.aside,
    )


def has_car(tables: Sequence[TableSet], cone: WrenchCone, nominal: ArrayLike) -> bool:
    """Whether set_twists finds twists, in less time: whether families are kept straight on and in wide turns."""
    ways, families, leaning = _families(tables, cone, nominal)
    leans, widest = np.outer(np.repeat(AHEAD, len(ways)), leaning), _turns(tables[0], STEPS)[:1]
    return all(np.any(_kept(tables, cone, _motions(families, leans, s * widest))) for s in (1.0, -1.0))


def _families(tables: Sequence[TableSet], cone: WrenchCone, nominal: ArrayLike) -> tuple[Array, Array, Array]:
    """Straight ways (n, 2) that every table allows, the families' (a n, 2), and how one of share 1 leans, (2,)."""
    a, straight, b = np.asarray(nominal, dtype=float)
    straight = straight[:2] / np.hypot(*straight[:2])
    ahead = 0.5 * float(perpendicular(a[:2] / a[2] + b[:2] / b[2]) @ straight)
    ways = rotate(DIRECTIONS, straight)
    depth = _depth(tables, cone, ways)
    if np.count_nonzero(depth >= 0) <= FEW:
        ways = rotate(CLOSER, ways[int(np.argmax(depth))])
        depth = _depth(tables, cone, ways)
    ways = ways[depth >= 0]
    return ways, np.tile(ways, (len(AHEAD), 1)), -ahead * perpendicular(straight)


def _depth(tables: Sequence[TableSet], cone: WrenchCone, ways: Array) -> Array:
    """The least depth of straight motions (n, 2) over all tables, shape (n,)."""
    V = np.column_stack([ways, np.zeros(len(ways))])
    return np.asarray(np.min([place.margin(cone, V) for place in tables], axis=0))


def _kept(tables: Sequence[TableSet], cone: WrenchCone, twists: Array) -> NDArray[np.bool_]:
    """Whether twists (..., 3) are kept at every place, shape (...)."""
    V = twists.reshape(-1, 3)
    kept = np.arange(len(V))
    for place in tables:
        kept = kept[place.margin(cone, V[kept]) >= 0]
    return np.isin(np.arange(len(V)), kept).reshape(twists.shape[:-1])


def _motions(families: Array, leans: Array, turn: Array) -> Array:
    """Of families (n, 2) that lean (n, 2) by the turn, at turns per length (..., 1 or n), shape (..., n, 3)."""
    v = families + turn[..., None] * leans
    return np.concatenate([v, np.broadcast_to(turn[..., None], (*v.shape[:-1], 1))], axis=-1)


def _turns(tables: TableSet, steps: int) -> Array:
    return np.asarray(1.0 / (tables.radius * WIDE * (TIGHT / WIDE) ** np.linspace(0.0, 1.0, steps)))


def _turning_most(
    tables: Sequence[TableSet], cone: WrenchCone, families: Array, leans: Array, sense: float
) -> NDArray[np.intp]:
    """About TRIED of the families, those that every table still keeps in the tightest turns, as indices.

    By bisection over the rungs of turns, so it takes a family to be kept in all turns wider than one in which it is.
    """
    turns, low, high, left = _turns(tables[0], RUNGS), 0, RUNGS, np.arange(len(families))
    while low < high:
        middle = (low + high) // 2
        kept = left[_kept(tables, cone, _motions(families[left], leans[left], sense * turns[[middle]]))]
        if len(kept) >= TRIED or (middle == 0 and len(kept)):
            low, left = middle + 1, kept
        else:
            high = middle
    return left


def _tightest(
    tables: Sequence[TableSet], cone: WrenchCone, families: Array, leans: Array, sense: float
) -> tuple[Array, Array]:
    """Centres (n, 2) of the tightest turns of families that are kept from straight on, and turns per length (n,)."""
    turns = _turns(tables[0], STEPS)
    good = _kept(tables, cone, _motions(families, leans, sense * turns[:, None]))
    count = np.where(good.all(axis=0), len(turns), np.argmin(good, axis=0))
    low = np.where(count > 0, turns[np.maximum(count - 1, 0)], 0.0)
    high = np.where(count < len(turns), turns[np.minimum(count, len(turns) - 1)], low)
    for _ in range(8):
        middle = 0.5 * (low + high)
        fine = np.logical_and(_kept(tables, cone, _motions(families, leans, sense * middle)), low > 0)
        low, high = np.where(fine, middle, low), np.where(fine, high, middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        V = _motions(families, leans, sense * low)
        return np.asarray(perpendicular(V[:, :2]) / V[:, 2:]), low
