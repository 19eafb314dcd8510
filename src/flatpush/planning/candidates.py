"""Automatic push points: on each edge or smooth stretch, the contact with the smallest turning radius."""

from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..contact.placement import SMOOTH_CORNER
from ..errors import FlatpushError
from ..friction import Support
from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from ..problem import Object, Push, Scene
from ..problem.mechanics import proved_for_set, starts_anywhere
from .options import PushOption, push_option

# A stretch ends where its normal has turned this far, so that a smooth outline gets pushes from all sides.
STRETCH = np.deg2rad(90.0)
COARSE, REFINED = 9, 8
MOST = 8
# An outline of more corners is simplified for the search of places: within these parts of its size, what presses on the
# table and what the fingers touch, of which the normals are to turn in finer steps.
MANY, SIMPLE, FINER = 30, 5e-4, 5e-5
# Then places on a stretch are tried around the best of a quick guess, in fractions of its length, and closer by.
AROUND, CLOSER = (0.0, -0.15, 0.15), 0.06
# How many places of a stretch are proved for a set of tables, and how far apart they are, by the outline's size.
PROVED, APART = 4, 0.04
# On the outline itself, places beside that are tried, in parts SIMPLE of the size.
BESIDE = 0.2  # of an edge, next to a corner where the normal passes the COF
ASIDE = (0.3, 2, -2, 6, -6, 12, -12)
# A polygon of so many corners has edges that can be counted; sides of others are named by the compass.
FEW = 20
EQUAL = 1e-7  # radii that differ by this part are equal
# What of how to plan makes a push a good one.
GOODNESS_KEYS = "model", "two_finger", "friction_margin", "cost", "proof"
Found = tuple[tuple[Push, ...], tuple[PushOption, ...]]
_known: WeakKeyDictionary[Object, dict[tuple[Any, ...], Found]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of an outline without sharp corners, as edges and lengths along it.

    Without a name it is called after the side of the place on it that is pushed.
    """

    name: str
    edges: tuple[int, ...]
    lengths: Array  # of the edges [m]; for a circle one quarter of the turn
    offset: float = 0.0  # where a circle's quarter starts, as a fraction of a turn
    backwards: bool = False  # whether the edges are passed from their second corner to their first

    def at(self, outline: Outline, fraction: float) -> OutlinePoint:
        """The point at a fraction of the stretch's length."""
        if outline.is_circle:
            return outline.at(0, self.offset + 0.25 * fraction)
        ends = np.cumsum(self.lengths)
        s = fraction * ends[-1]
        k = min(int(np.searchsorted(ends, s, side="right")), len(self.edges) - 1)
        along = float(np.clip((s - (ends[k] - self.lengths[k])) / self.lengths[k], 0.0, 1.0))
        return outline.at(self.edges[k], 1 - along if self.backwards else along)

    def square_to(self, outline: Outline, cof: Array) -> Array:
        """Fractions at which the normal passes through the COF: contacts that steer with the least friction."""
        if outline.is_circle:
            x, y = cof - outline.centre
            if np.hypot(x, y) < 1e-9 * outline.radius:
                return np.empty(0)
            turns = np.array([0.0, 0.5]) + np.arctan2(y, x) / (2 * np.pi)
            fractions = 4 * ((turns - self.offset) % 1.0)
            return fractions[fractions < 1]
        edges = outline.edges[list(self.edges)]
        if self.backwards:
            edges = edges[:, ::-1]
        d = edges[:, 1] - edges[:, 0]
        along = np.einsum("ij,ij->i", cof - edges[:, 0], d) / self.lengths**2
        on = (along > 1e-6) & (along < 1 - 1e-6)
        before = np.cumsum(self.lengths) - self.lengths
        found = ((before + along * self.lengths) / self.lengths.sum())[on]
        # Between two edges the normal may turn past the COF: beside that corner.
        passed = np.flatnonzero((along[:-1] >= 1) & (along[1:] <= 0))
        corners = (before + self.lengths)[passed]
        beside = [corners - BESIDE * self.lengths[passed], corners + BESIDE * self.lengths[passed + 1]]
        return np.concatenate([found, np.concatenate(beside) / self.lengths.sum()])


def automatic_pushes(scene: Scene) -> Found:
    """A small set of pushes that is worth switching between, and those left out, with the reason.

    One push of each edge or smooth stretch; of more than MOST, those are kept that push in different
    directions, smaller turning radii first. They are sought once for an object: scenes that differ only in their
    poses, their workspace or how the search is done share them.
    """
    query = scene.pusher, *(getattr(scene.planning, key) for key in GOODNESS_KEYS)
    known = _known.setdefault(scene.object, {})
    if query not in known:
        known[query] = _automatic_pushes(scene)
    return known[query]


def _automatic_pushes(scene: Scene) -> Found:
    outline = scene.object.outline
    found: list[PushOption] = []
    refused: list[PushOption] = []
    many = len(outline.vertices) > MANY
    coarse, fine = _simplified(scene) if many else (scene, scene)
    names: list[str] = []
    for stretch in stretches(coarse.object.outline):
        option = _best_of_many(coarse, fine, stretch) if many else _best(scene, stretch)
        if option is None:
            continue
        if stretch.name == "":
            names.append(_side(option.push.at.normal, names))
            option = replace(option, push=replace(option.push, name=names[-1]))
        (refused if option.car is None else found).append(option)
    kept = _spread(found)
    refused += [
        replace(
            o, car=None, error=FlatpushError("left out: other pushes in nearly this direction turn tighter")
        )
        for o in found
        if o not in kept
    ]
    if many:
        placed = [_on_outline(scene, option) for option in kept]
        kept = [option for option in placed if option.car is not None]
        refused += [option for option in placed if option.car is None]
        refused = [replace(o, push=replace(o.push, at=outline.nearest(o.push.at.point))) for o in refused]
    return tuple(option.push for option in kept), tuple(refused)


def _simplified(scene: Scene) -> tuple[Scene, Scene]:
    """The scene with an outline of few corners, and of some more, both on the support that goes with the first."""
    obj = scene.object

    def with_outline(tolerance: float, support: Support | str) -> Scene:
        outline = obj.outline.simplified(tolerance * obj.outline.size)
        thing = Object(outline, support, obj.friction, obj.surface, obj.name, obj.uncertainty)
        return replace(scene, object=thing, pushes="auto")

    coarse = with_outline(SIMPLE, obj.support_word or obj.support)
    return coarse, with_outline(FINER, coarse.object.support)


def _on_outline(scene: Scene, option: PushOption) -> PushOption:
    """The push at the nearest place of the scene's own outline, or a little beside it where it is refused there."""
    outline = scene.object.outline
    at = option.push.at
    along = np.array([at.normal[1], -at.normal[0]])
    tried = None
    for k in ASIDE:
        place = outline.nearest(at.point + k * SIMPLE * outline.size * along)
        if place.corner:
            d = outline.edges[place.edge, 1] - outline.edges[place.edge, 0]
            place = outline.nearest(outline.edges[place.edge].mean(axis=0) if d.any() else place.point)
        tried = push_option(scene, replace(option.push, at=place), quick=True)
        if tried.car is not None:
            break
    return tried if tried is not None else option


def _spread(options: list[PushOption]) -> list[PushOption]:
    """The tightest car, then again and again the one that adds most: angle to the nearest kept one, over its radius."""
    if len(options) <= MOST:
        return options
    radii = np.array([o.car.radius for o in options if o.car])
    directions = np.array([o.car.direction for o in options if o.car])
    kept = [_first(radii)]
    while len(kept) < MOST:
        angles = np.arccos(np.clip(directions @ directions[kept].T, -1.0, 1.0)).min(axis=1)
        worth = angles / np.sqrt(radii)
        worth[kept] = -1.0
        kept.append(_first(-worth))
    return [options[i] for i in sorted(kept)]


def _first(values: Array) -> int:
    """The first of the least values; what differs by rounding is equal."""
    least = float(np.min(values))
    if not np.isfinite(least):
        return int(np.argmin(values))
    return int(np.flatnonzero(values <= least + EQUAL * abs(least))[0])


def stretches(outline: Outline) -> list[Stretch]:
    """Edges of an outline, joined where the corner between them is nearly smooth and the normal has not turned far."""
    if outline.is_circle:
        sides = ("east side", "north side", "west side", "south side")
        return [Stretch(name, (0,), np.ones(1), k / 4 - 1 / 8) for k, name in enumerate(sides)]
    order = outline.order
    normals = outline.edge_normals[order]
    n = len(normals)
    turns = np.arccos(np.clip(np.einsum("ij,ij->i", np.roll(normals, 1, axis=0), normals), -1.0, 1.0))
    sharp = np.flatnonzero(turns > SMOOTH_CORNER)
    # Without a corner to begin at, the farthest place is in the middle of a stretch, as each side of a circle is.
    first = int(sharp[0]) if len(sharp) else int(np.searchsorted(np.cumsum(turns), STRETCH / 2))
    lengths = np.linalg.norm(outline.edges[:, 1] - outline.edges[:, 0], axis=1)
    found: list[list[int]] = []
    turned = 0.0
    for k in range(n):
        place = (first + k) % n
        turned += float(turns[place])
        if not found or turns[place] > SMOOTH_CORNER or turned > STRETCH:
            found.append([])
            turned = 0.0
        found[-1].append(int(order[place]))
    names = ["" if len(g) > 1 or n > FEW else f"edge {g[0]}" for g in found]
    return [
        Stretch(name, tuple(g), lengths[g], backwards=outline.sense < 0)
        for name, g in zip(names, found, strict=True)
    ]


def _side(inward: Array, taken: list[str]) -> str:
    """The name of a side by the compass, east along +x of the drawing; numbered where there are several."""
    winds = "east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east"
    eighths = float(np.arctan2(-inward[1], -inward[0])) / (np.pi / 4)
    name = f"{winds[round(eighths - EQUAL) % 8]} side"  # halfway between two is not decided by rounding
    number = 1 + sum(other == name or other.startswith(f"{name} ") for other in taken)
    return name if number == 1 else f"{name} {number}"


def _best_of_many(coarse: Scene, fine: Scene, stretch: Stretch) -> PushOption | None:
    """The best place by one finger and an ellipsoid, which is quick to tell, then around it as the scene asks.

    Args:
        coarse: the scene with an outline of few corners, to which the stretch belongs.
        fine: the same with an outline of more corners, and the coarse one's support.
    """
    outline, nominal, guessed = fine.object.outline, _nominal(fine), _nominal(coarse)
    quick = replace(
        guessed,
        planning=replace(guessed.planning, model="ellipsoid"),
        pusher=replace(coarse.pusher, fingers=1),
    )
    guess = _best(quick, stretch)
    if guess is None:
        return None
    ends = np.cumsum(stretch.lengths)
    k = stretch.edges.index(guess.push.at.edge)
    along = 1 - guess.push.at.along if stretch.backwards else guess.push.at.along
    middle = float((ends[k] - stretch.lengths[k] + along * stretch.lengths[k]) / ends[-1])
    tried: list[PushOption] = []
    radii: list[float] = []
    places: list[float] = []

    def look(fraction: float) -> None:
        if not 0 < fraction < 1 or fraction in places:
            return
        place = stretch.at(coarse.object.outline, fraction)
        # A little aside, so that it is not rounding that decides between edges which are equally near.
        aside = 0.37 * FINER * outline.size * np.array([place.normal[1], -place.normal[0]])
        at = outline.nearest(place.point + aside)
        if not at.corner:
            pusher = fine.pusher
            push = Push(stretch.name, at, pusher.fingers, pusher.spacing if pusher.fingers == 2 else 0.0)
            tried.append(push_option(nominal, push, quick=True))
            places.append(fraction)
            car = tried[-1].car
            radii.append(np.inf if car is None else car.radius)

    for step in AROUND:
        look(middle + step)
    if not np.isfinite(min(radii, default=np.inf)):
        for fraction in (0.01, *(np.arange(COARSE) + 0.5) / COARSE, 0.99):
            look(float(fraction))
    if not tried:
        return None
    best = _first(np.array(radii))
    if np.isfinite(radii[best]):
        centre = places[best]
        for step in (-CLOSER, CLOSER):
            look(centre + step)
        best = _first(np.array(radii))
    return _proved(fine, [tried[best], *(tried[i] for i in np.argsort(radii, kind="stable"))])


def _nominal(scene: Scene) -> Scene:
    """The scene on its nominal table, where places are compared in less time."""
    return replace(scene, planning=replace(scene.planning, proof="nominal"))


def _proved(scene: Scene, options: list[PushOption]) -> PushOption:
    """Of a nominal scene's pushes, best first, the one that turns tightest on all tables that the scene asks for.

    Where the nominal table turns tightest others may not, so some places apart are proved; none turns tighter proved.
    For a start region it is the first that is proved: a place nearer to the end of a side turns tighter, and is landed
    on less well.
    """
    if not proved_for_set(scene) or options[0].car is None:
        return options[0]
    apart, refused = APART * scene.object.outline.size, None
    found: list[PushOption] = []
    radii: list[float] = []
    for option in options:
        at = option.push.at.point
        if option.car is None or any(np.hypot(*(at - o.push.at.point)) < apart for o in found):
            continue
        if len(found) == (1 if starts_anywhere(scene) else PROVED) or option.car.radius >= min(
            radii, default=np.inf
        ):
            break
        proved = push_option(scene, option.push)
        if proved.car is None:
            refused = refused or proved
        else:
            found.append(proved)
            radii.append(proved.car.radius)
    return found[_first(np.array(radii))] if found else refused or options[0]


def _best(scene: Scene, stretch: Stretch) -> PushOption | None:
    """Coarse search over the stretch, then golden section around its best.

    Places are compared on the nominal table; of the best the one is taken that is best on all tables of a set, where
    that is asked.
    """
    tried: dict[float, PushOption] = {}
    nominal = _nominal(scene)

    def radius(fraction: float) -> float:
        at = stretch.at(scene.object.outline, fraction)
        if at.corner:
            return np.inf
        pusher = scene.pusher
        push = Push(stretch.name, at, pusher.fingers, pusher.spacing if pusher.fingers == 2 else 0.0)
        option = push_option(nominal, push, quick=True)
        tried[fraction] = option
        return option.car.radius if option.car is not None else np.inf

    grid = (np.arange(COARSE) + 0.5) / COARSE
    grid = grid[np.argsort(np.abs(grid - 0.5), kind="stable")]  # of equals, the one in the middle
    grid = np.concatenate([stretch.square_to(scene.object.outline, scene.object.cof), grid])
    radii = [radius(float(f)) for f in grid]
    k = _first(np.array(radii))
    if np.isfinite(radii[k]):
        centre, width, best = float(grid[k]), 1.0 / COARSE, radii[k]
        for _ in range(REFINED):
            width *= 0.618
            for f in (centre - width, centre + width):
                if 0 < f < 1 and (value := radius(f)) < best - 1e-9 * best:
                    centre, best = f, value
                    break
        order = grid[np.argsort(radii, kind="stable")]
        return _proved(scene, [tried[centre], *(tried[f] for f in order.tolist() if f in tried)])
    reasons = [o for o in tried.values() if o.car is None]
    return reasons[0] if reasons else None
