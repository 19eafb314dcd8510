"""Camera, tags, finger and friction of a robot that pushed, from what its logs hold: from the contacts, or from ends.

What is sought is physical and shared: one affine map of the camera, one offset of the tag for each object, one inset of
the fingers, one coefficient of friction. No run has a parameter of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..geometry import relative, transform, wrap_angle
from ..geometry.pose import Array
from ..problem import Object
from .plant import Plant
from .replay import CameraMap, Recording, Registration, Replayed, replay

# A push counts for the contact after so much way [m] and until so long before its end [s], in every so manyth row.
SETTLED, ENDING, EVERY = 0.02, 0.5, 2
# Residuals beyond this count linearly: of gaps at the contact [mm], of ends [mm].
SOFT_CONTACT, SOFT_END = 0.2, 1.0
# What a millimetre is held to be worth in turn of the object: this lever [m]. Pushes before the last count half.
LEVER, INNER = 0.03, 0.5
# Scales of camera matrix, shift [m], tag [m, rad], inset [m] and friction, and how strongly these hold them near the
# nominal values.
CAMERA, SHIFT, TAG, INSET, FRICTION = 0.01, 0.001, np.array([1e-3, 1e-3, 0.01]), 1e-4, 0.1
# Friction at which fingers surely stick. How much more than that there is does not show, so the search begins there.
STICKING = 1.0
PULL_CONTACT, PULL_ENDS = 0.05, 0.1
_STEP, _ROUNDS = 0.01, 15


@dataclass(frozen=True, eq=False)
class Setup:
    """What is known of the experiment.

    Attributes:
        objects: by the name that the logs give them. fingers: in E, shape (k, 2) [m]. tip_radius: [m].
        pivot: of the camera's map, somewhere amid the runs, shape (2,) [m].
        tags: which tag an object carries, where several objects are one block with one tag; else each has its own.
    """

    objects: Mapping[str, Object]
    fingers: Array
    tip_radius: float
    pivot: Array
    tags: Mapping[str, str] = field(default_factory=dict)

    def tag(self, name: str) -> str:
        """The tag of an object."""
        return self.tags.get(name, name)

    @property
    def tag_names(self) -> list[str]:
        """All tags, in the order of the objects."""
        return list(dict.fromkeys(self.tag(name) for name in self.objects))


# No camera that knows the size of its tag is off by such a share of the lengths.
ODD_SCALE = 0.1


@dataclass(frozen=True, eq=False)
class Parameters:
    """What is calibrated; the default is what the drawing says.

    Attributes:
        camera: matrix minus identity, row by row, and shift [m], shape (6,).
        tags: of each tag, see Registration (3,).
        inset: so much less than the tip radius the fingers keep from the outline [m].
        friction: between finger and object; None: the objects' own.
        lag: see replay.trajectory_errors [s].
    """

    camera: Array = field(default_factory=lambda: np.zeros(6))
    tags: Mapping[str, Array] = field(default_factory=dict)
    inset: float = 0.0
    friction: float | None = None
    lag: float = 0.16

    @property
    def doubt(self) -> str:
        """What a camera's map that cannot be right points to; else ""."""
        area = float(np.linalg.det(np.eye(2) + np.reshape(self.camera[:4], (2, 2))))
        if area <= 0:
            return "the camera's map mirrors: x and y are exchanged, or the pictures are mirrored"
        scale = float(np.sqrt(area))
        if abs(scale - 1) > ODD_SCALE:
            return f"the camera's map has a scale of {scale:.2f}: a wrong size of the tag or a wrong unit does that"
        return ""

    def registration(self, setup: Setup, name: str) -> Registration:
        matrix = np.eye(2) + np.reshape(self.camera[:4], (2, 2))
        return Registration(
            CameraMap(matrix, np.asarray(self.camera[4:]), setup.pivot),
            np.asarray(self.tags.get(setup.tag(name), np.zeros(3))),
        )

    def plant(self, setup: Setup, name: str) -> Plant:
        return Plant(
            setup.objects[name], setup.fingers, setup.tip_radius - self.inset, friction=self.friction
        )

    def replay(self, setup: Setup, recording: Recording, landings: bool = False) -> Replayed:
        """The run in the simulator, with these parameters.

        Args:
            landings: whether what the camera saw around each landing is used (see replay.replay).
        """
        name = recording.run.object
        return replay(
            recording, self.plant(setup, name), self.registration(setup, name), self.lag if landings else None
        )


def contact_calibration(recordings: Sequence[Recording], setup: Setup, tags: bool = True) -> Parameters:
    """Camera map, lag and, if asked for, tags, from the contact alone; no end of a run is used.

    While two fingers push an edge, each keeps the tip radius from the outline, and the object its place in the hand.

    Raises:
        InputError: if no stroke is long enough.
    """
    from scipy.optimize import least_squares

    stretches = [stretch for recording in recordings for stretch in contact_stretches(recording)]
    if not stretches:
        raise InputError("no stroke is long enough to tell of the contact", value=len(recordings))
    outlines = distances(setup)
    names = setup.tag_names
    most = 6 + 3 * len(names) * tags

    def parameters(x: Array) -> Parameters:
        return replace(shared_parameters(x, names if tags else []), lag=0.16 + 0.02 * float(x[most]))

    def residuals(x: Array) -> Array:
        p = parameters(x)
        found = [PULL_CONTACT * x]
        for stretch in stretches:
            found.append(contact_gaps(stretch, p, setup, outlines[stretch.name]))
        return np.concatenate(found)

    # Shifted by one, so that the steps of the derivatives are alike.
    fit = least_squares(
        lambda x: residuals(x - 1), np.ones(most + 1), diff_step=_STEP, loss="soft_l1", f_scale=SOFT_CONTACT,
        max_nfev=_ROUNDS,
    )  # fmt: skip
    return parameters(fit.x - 1)


def contact_gaps(stretch: "Stretch", p: Parameters, setup: Setup, outline: "Distance") -> Array:
    """How far each finger is from touching, and the object from its place in the hand; root mean squares in mm."""
    registration = p.registration(setup, stretch.name)
    hands = np.column_stack([np.interp(stretch.times - p.lag, stretch.clock, h) for h in stretch.hands.T])
    poses = registration.poses(stretch.poses)
    in_object, in_hand = relative(poses, hands), relative(hands, poses)
    weight = 1000 / np.sqrt(len(poses))
    reach = setup.tip_radius - p.inset
    gaps = [weight * (outline(transform(in_object, finger)) - reach) for finger in setup.fingers]
    return np.concatenate([*gaps, 0.5 * weight * (in_hand[:, 1] - np.median(in_hand[:, 1]))])


def distances(setup: Setup) -> dict[str, "Distance"]:
    """Of each object's outline."""
    return {name: Distance(thing) for name, thing in setup.objects.items()}


def fit_to_ends(recordings: Sequence[Recording], setup: Setup, start: Parameters) -> Parameters:
    """Camera map, tags, inset and friction with which the simulator comes nearest to the measured ends of all pushes.

    Args:
        start: where the search begins, as from contact_calibration; its lag is kept.
    """
    from scipy.optimize import least_squares

    names = setup.tag_names

    def parameters(x: Array) -> Parameters:
        inset, friction = INSET * float(x[-2]), max(0.05, STICKING + FRICTION * float(x[-1]))
        return replace(shared_parameters(x, names), inset=inset, friction=friction, lag=start.lag)

    def residuals(x: Array) -> Array:
        p = parameters(x)
        plants = {name: p.plant(setup, name) for name in names}
        found = [PULL_ENDS * x]
        for recording in recordings:
            name = recording.run.object
            registration = p.registration(setup, name)
            run = replay(recording, plants[name], registration)
            ends = np.array([poses[-1] for poses in run.poses]) - registration.poses(measured_ends(recording))
            ends[:, 2] = LEVER * wrap_angle(ends[:, 2])
            ends[:-1] *= INNER
            found.append(1000 * np.nan_to_num(ends).ravel())
        return np.concatenate(found)

    begin = np.zeros(6 + 3 * len(names) + 2)
    begin[:6] = start.camera / ([CAMERA] * 4 + [SHIFT] * 2)
    begin[6:-2] = np.ravel([np.asarray(start.tags.get(name, np.zeros(3))) / TAG for name in names])
    fit = least_squares(
        lambda x: residuals(x - 1), begin + 1, diff_step=_STEP, loss="soft_l1", f_scale=SOFT_END,
        max_nfev=_ROUNDS,
    )  # fmt: skip
    return parameters(fit.x - 1)


def shared_parameters(x: Array, names: Sequence[str]) -> Parameters:
    """Camera and tags from numbers of order one."""
    tags = {name: TAG * x[6 + 3 * k : 9 + 3 * k] for k, name in enumerate(names)}
    return Parameters(x[:6] * ([CAMERA] * 4 + [SHIFT] * 2), tags)


def measured_ends(recording: Recording) -> Array:
    """The last measured pose of each stroke, nan where the object was never seen, shape (n, 3)."""
    run, found = recording.run, []
    for a, b in recording.strokes:
        seen = np.flatnonzero(run.seen[a:b])
        found.append(run.poses[a + seen[-1]] if len(seen) else np.full(3, np.nan))
    found[-1] = recording.final
    return np.array(found)


@dataclass(frozen=True, eq=False)
class Stretch:
    """Rows in which a push was under way: the hand with its clock, and the new frames with their times."""

    name: str
    clock: Array
    hands: Array
    times: Array
    poses: Array


def contact_stretches(recording: Recording) -> list[Stretch]:
    run, found = recording.run, []
    for (a, b), hands in zip(recording.strokes, recording.hands, strict=True):
        clock, poses = run.times[a:b], run.poses[a:b]
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(hands[:, :2], axis=0).T))])
        new = np.concatenate([[True], np.any(np.diff(poses, axis=0) != 0, axis=1)])
        rows = np.flatnonzero(run.seen[a:b] & new & (way > SETTLED) & (clock < clock[-1] - ENDING))[::EVERY]
        if len(rows) > 5:
            found.append(Stretch(run.object, clock, hands, clock[rows], poses[rows]))
    return found


class Distance:
    """Signed distances of points (n, 2) in O from an object's outline, positive outside [m]."""

    def __init__(self, thing: Object) -> None:
        import shapely

        self._shape = shapely.Polygon(thing.outline.polyline())
        shapely.prepare(self._shape)

    def __call__(self, points: Array) -> Array:
        import shapely

        places = shapely.points(points)
        inside = shapely.contains(self._shape, places)
        away = shapely.distance(self._shape.exterior, places)
        return np.asarray(np.where(inside, -away, away))
