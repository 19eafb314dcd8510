"""Straight pushes with one finger, rolled out once each, whatever the contact does: stick, slide, let go."""

from dataclasses import dataclass, fields, replace

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...geometry import Outline, compose, transform
from ...geometry.pose import Array, perpendicular, rotate
from ...problem import Object
from ...simulation.plant import Plant

# By default: contacts a twenty-fifth of the object's size apart, directions 15° apart, lengths that grow by half.
CONTACTS = 0.04  # distance of neighbouring contacts, by the outline's size
STEEPEST = np.deg2rad(60.0)  # angle between push and inward normal
DIRECTIONS = 9
LENGTHS = 0.02 * 1.5 ** np.arange(10)  # by the outline's size
ASIDE = 1e-3  # by which the finger goes beside its way to see what that changes, by the outline's size
BEFORE = 0.01  # the finger starts so far from the contact, by the outline's size


@dataclass(frozen=True, eq=False)
class SlideLibrary:
    """Straight pushes of one object; n of them. Frames: O of the object where the push begins.

    Attributes:
        edge, along: the contact, as Outline.at takes it, shapes (n,).
        direction: angle from the inward normal to the push, counter-clockwise, shape (n,) [rad].
        length: of the finger's way from the contact on, shape (n,) [m].
        begin, end: the fingertip's centre before and after the push, in O at its beginning, shape (n, 2) [m].
        displacement: pose of the object after the push in O at its beginning, shape (n, 3).
        cof: centre of friction in O, shape (2,) [m].
        reach: the outline's greatest distance from it [m]; with it angles are measured as lengths.
        growth: how far the outline's farthest point ends elsewhere, about, if the finger goes beside its way, by that
            distance, shape (n,).
    """

    edge: NDArray[np.intp]
    along: Array
    direction: Array
    length: Array
    begin: Array
    end: Array
    displacement: Array
    cof: Array
    reach: float
    growth: Array

    def __len__(self) -> int:
        return len(self.length)

    def steady(self, most: float) -> "SlideLibrary":
        """The pushes whose growth is at most `most`, a factor."""
        kept = self.growth <= most
        rows = {f.name: getattr(self, f.name)[kept] for f in fields(self) if f.name not in ("cof", "reach")}
        return replace(self, **rows)

    def coordinates(self, poses: ArrayLike) -> Array:
        """Poses (..., 3) as points (..., 4) whose distance is about the displacement of the outline's farthest point.

        They are the place of the centre of friction and the direction of O's x axis, times the reach.
        """
        X = np.asarray(poses, dtype=float)
        angle = X[..., 2:]
        turned = self.reach * np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
        return np.concatenate([transform(X, self.cof), turned], axis=-1)


def slide_library(
    thing: Object,
    plant: Plant,
    contacts: ArrayLike | None = None,
    directions: ArrayLike | None = None,
    lengths: ArrayLike | None = None,
    before: float | None = None,
) -> SlideLibrary:
    """Rolls out straight pushes from all around an object, in the plant.

    Pushes that could not begin, because the finger would start in the object, are left out.

    Args:
        plant: of the object and one finger at its hand's origin.
        contacts: edges and places on them (m, 2), as Outline.at takes them; default: evenly around the outline.
        directions: angles from the inward normal [rad]; default: nine within ±60°.
        lengths: of the pushes from the contact on [m], increasing; default: ten from 2 to 77 % of the size.
        before: the finger starts at least so far from the outline [m]; default: 1 % of the size.

    Raises:
        InputError: for another number of fingers, or no push that could begin.
    """
    if plant.fingers.shape != (1, 2) or np.any(plant.fingers):
        raise InputError("sliding pushes are made with one finger, at its hand's origin", value=plant.fingers)
    outline, tip = thing.outline, plant.tip_radius
    places = _around(thing) if contacts is None else np.asarray(contacts, dtype=float)
    angles = np.linspace(-STEEPEST, STEEPEST, DIRECTIONS) if directions is None else np.asarray(directions)
    ways = LENGTHS * outline.size if lengths is None else np.asarray(lengths, dtype=float)
    room = BEFORE * outline.size if before is None else before
    rows = np.array([(edge, along, angle) for edge, along in places for angle in angles]).reshape(-1, 3)
    begin, touch, heading, good = finger_ways(outline, tip, room, rows)
    if not good.any():
        raise InputError("no finger of this radius reaches the outline", value=tip)
    rows, begin, touch, heading = rows[good], begin[good], touch[good], heading[good]
    end = touch[:, None] + ways[:, None] * heading[:, None]  # (n, lengths, 2)
    hand = np.zeros((len(rows), 2 + len(ways), 3))
    hand[..., :2] = np.concatenate([begin[:, None], touch[:, None], end], axis=1)
    hand[..., 2] = np.arctan2(heading[:, 1], heading[:, 0])[:, None]
    beside = hand.copy()
    beside[..., :2] += ASIDE * outline.size * perpendicular(heading)[:, None]
    runs, others = (
        plant.many(np.zeros((len(rows), 3)), h, push_out=False, record=True) for h in (hand, beside)
    )
    assert runs.object is not None
    assert others.object is not None
    good = (runs.outcome == 0) & (others.outcome == 0)
    moved = runs.object[good][:, 2:].reshape(-1, 3)
    elsewhere = others.object[good][:, 2:].reshape(-1, 3)
    number = rows[good].repeat(len(ways), axis=0)
    library = SlideLibrary(
        number[:, 0].astype(np.intp),
        number[:, 1],
        number[:, 2],
        np.tile(ways, int(good.sum())),
        begin[good].repeat(len(ways), axis=0),
        end[good].reshape(-1, 2),
        moved,
        np.array(plant.cof),
        outline.radius_about(plant.cof),
        np.zeros(len(moved)),
    )
    off = np.linalg.norm(library.coordinates(elsewhere) - library.coordinates(moved), axis=1)
    return replace(library, growth=off / (ASIDE * outline.size))


def finger_ways(
    outline: Outline, tip: float, room: float, pushes: Array
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Where the fingertip's centre is before pushes and at contact, and their directions, each (n, 2) in O.

    Also whether each can begin, shape (n,): its finger does not start in the object, nor so near that it touched
    elsewhere.

    Args:
        tip: its radius [m]. room: as slide_library's `before`.
        pushes: edge, place on it, and angle from the inward normal [rad], shape (n, 3).
    """
    edge, along, angle = pushes.T
    if outline.is_circle:
        normal = -np.column_stack([np.cos(2 * np.pi * along), np.sin(2 * np.pi * along)])
        contact = outline.centre - outline.radius * normal
    else:
        ends = outline.edges[edge.astype(int)]
        normal = outline.edge_normals[edge.astype(int)]
        contact = ends[:, 0] + along[:, None] * (ends[:, 1] - ends[:, 0])
    centre, heading = contact - tip * normal, rotate(angle, normal)
    start = centre - (room / np.cos(angle))[:, None] * heading
    return start, centre, heading, _outside(outline, start) >= tip + 0.5 * room


def _outside(outline: Outline, points: Array) -> Array:
    """Distances of points (n, 2) from an outline, 0 or less inside, shape (n,) [m]."""
    if outline.is_circle:
        return np.linalg.norm(points - outline.centre, axis=1) - outline.radius
    return np.asarray(shapely.distance(shapely.Polygon(outline.vertices), shapely.points(points)))


def _around(thing: Object) -> Array:
    """Contacts evenly around the outline, at least two on each edge, shape (m, 2)."""
    outline = thing.outline
    if outline.is_circle:
        count = int(np.ceil(2 * np.pi * outline.radius / (CONTACTS * outline.size)))
        return np.stack([np.zeros(count), (np.arange(count) + 0.5) / count], axis=1)
    ends = outline.edges
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    counts = np.maximum(2, np.round(lengths / (CONTACTS * outline.size)).astype(int))
    return np.array([(e, (k + 0.5) / n) for e, n in enumerate(counts) for k in range(n)])


def product(poses: ArrayLike, displacements: ArrayLike) -> Array:
    """All products of poses (n, 3) and displacements (m, 3), shape (n · m, 3)."""
    X, D = np.asarray(poses, dtype=float), np.asarray(displacements, dtype=float)
    return compose(X[:, None], D[None]).reshape(-1, 3)
