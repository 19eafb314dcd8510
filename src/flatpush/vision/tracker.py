"""Objects by their tags, from picture to picture: in small windows while they are known, in whole pictures else."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..geometry import pose_error
from ..geometry.pose import Array
from ..geometry.table_camera import TableCamera
from .filter import Track, TwistFilter
from .sighting import Refused, Sighting, sighting
from .tags import Detected, Picture, detect
from .worn import Tag

# A window is so wide at least [px], and so many times the side of the tag.
WINDOW, TAGS_WIDE = 180, 2.6
# While all are known, each picture is searched for a second tag of a number in one of so many parts, across and down:
# an object that enters with another's tag is noticed within 48 pictures, at a twelfth of the price of whole ones.
PARTS = (8, 6)
# Neighbouring parts share so many sides of a tag, its diagonal with the white rim, so that one of them holds all of it.
SHARED = 1.8
# A pose this far from where the track expects it, in squared standard deviations, is no motion of the object:
# 1 in 10⁷ by chance (three degrees of freedom), and the acceleration of a push is allowed for.
UNLIKELY = 35.0
# After so many poses in a row that agree with each other, the object is believed to be elsewhere: somebody moved it.
# They agree within [m], [rad] per frame.
AGREEING, NEAR, NEAR_TURN = 3, 0.003, 0.05
# A track is given up when its object was not seen for so long [s].
LOST = 0.5


@dataclass(frozen=True, eq=False)
class One:
    """What is known of one object: its track, the last sighting, and poses elsewhere that agree with each other."""

    track: Track | None = None
    last: Sighting | None = None
    elsewhere: tuple[Sighting, ...] = ()


@dataclass(frozen=True, eq=False)
class TrackerState:
    """What a tracker remembers. stamp: of the newest picture [s]; number: how many there were; objects: by name."""

    stamp: float = -np.inf
    number: int = 0
    objects: Mapping[str, One] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Seen:
    """What a picture showed.

    Attributes:
        stamp: of its exposure [s]. number: of the picture, from 1.
        sightings: of the objects that were seen and are believed, by name.
        notes: why others are not, by name.
    """

    stamp: float
    number: int
    sightings: Mapping[str, Sighting]
    notes: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Tracker:
    """Follows objects by their tags.

    Args:
        camera: calibrated. tags: by the name of the object, each with a number of its own.
        filter: how objects move.

    Raises:
        InputError: for no tag, or two objects with one.
    """

    camera: TableCamera
    tags: Mapping[str, Tag]
    filter: TwistFilter = field(default_factory=TwistFilter)

    def __post_init__(self) -> None:
        numbers = [tag.number for tag in self.tags.values()]
        if not numbers:
            raise InputError("a tracker needs a tag to follow")
        for number in numbers:
            if numbers.count(number) > 1:
                raise InputError("two objects have one tag", key="tag", value=number)

    def start(self) -> TrackerState:
        """The state before the first picture: nothing is known of any object."""
        return TrackerState(objects={name: One() for name in self.tags})

    def step(self, state: TrackerState, picture: Picture, stamp: float) -> tuple[TrackerState, Seen]:
        """The state after a grey picture, shape (height, width), and what it showed; stamp: of its exposure [s].

        Raises:
            InputError: for a picture of another size than the camera's, one that is no newer than the last, a tag that
                is in the picture twice, and a tag that is never of the size it should have.
        """
        number = state.number + 1
        w, h = self.camera.size
        if picture.shape != (h, w):
            got = " × ".join(str(k) for k in picture.shape[::-1])
            raise InputError(
                f"picture {number} is {got} pixels, and the camera was calibrated with {w} × {h}",
                hint="Calibrate again, or set the camera to that size.",
            )
        if not stamp > state.stamp:
            how = "has the time of" if stamp == state.stamp else "was taken before"
            raise InputError(f"picture {number} {how} picture {number - 1}", key="stamp", value=stamp)
        found = self._detected(state, picture, stamp)
        objects, sightings, notes = {}, {}, {}
        for name, tag in self.tags.items():
            before = state.objects[name]
            seen = [one for one in found if one.id == tag.number]
            if len(seen) > 1:
                places = " and ".join("({:.0f}, {:.0f})".format(*one.corners.mean(axis=0)) for one in seen)
                raise InputError(
                    f"tag {tag.number} is in picture {number} twice, at {places}: two objects wear it",
                    hint="Give every object a tag of its own.",
                )
            if not seen:
                objects[name], notes[name] = self._unseen(before, stamp), "not seen"
                continue
            one = sighting(self.camera, tag, seen[0], stamp)
            if isinstance(one, Refused):
                if one.size and before.track is None:
                    raise InputError(f"picture {number}: {one.why}")
                objects[name], notes[name] = self._unseen(before, stamp), one.why
                continue
            objects[name], why = self._followed(before, one)
            if why:
                notes[name] = why
            else:
                sightings[name] = one
        return TrackerState(stamp, number, objects), Seen(stamp, number, sightings, notes)

    def _detected(self, state: TrackerState, picture: Picture, stamp: float) -> list[Detected]:
        """In a window for each object that is known, else in the whole picture."""
        windows = []
        for name, tag in self.tags.items():
            known = state.objects[name]
            if known.track is None or known.last is None:
                return detect(picture)
            windows.append((tag.number, self._window(known, tag, stamp)))
        found = []
        for number, window in windows:
            inside = [one for one in detect(picture, window) if one.id == number]
            if not inside:
                return detect(picture)
            found += inside
        return found + self._second(state.number, picture, found)

    def _second(self, number: int, picture: Picture, found: list[Detected]) -> list[Detected]:
        """Tags with the number of one that was found in its window, elsewhere in this picture's part of the whole."""
        w, h = self.camera.size
        (across, down), side = PARTS, max(_side(one) for one in found)
        row, column = divmod(number % (across * down), across)
        u, v, more = column * w // across, row * h // down, int(SHARED * side) + 1
        part = (u, v, min(w, u + w // across + more), min(h, v + h // down + more))
        known = {one.id: one.corners.mean(axis=0) for one in found}
        return [
            one
            for one in detect(picture, part)
            if one.id in known and np.hypot(*(one.corners.mean(axis=0) - known[one.id])) > 0.5 * _side(one)
        ]

    def _window(self, known: One, tag: Tag, stamp: float) -> tuple[int, int, int, int]:
        assert known.track is not None
        assert known.last is not None
        ahead = self.filter.at(known.track, stamp).pose
        there, here = (self.camera.pixels([*p[:2], tag.height]) for p in (ahead, known.last.pose))
        middle = known.last.middle + there - here
        half = max(WINDOW, int(TAGS_WIDE * known.last.side)) // 2
        w, h = self.camera.size
        u, v = (int(np.clip(round(float(m)), 0, most - 1)) for m, most in zip(middle, (w, h), strict=True))
        return max(0, u - half), max(0, v - half), min(w, u + half), min(h, v + half)

    def _unseen(self, before: One, stamp: float) -> One:
        lost = before.track is None or stamp - before.track.stamp > LOST
        return One() if lost else replace(before, elsewhere=())

    def _followed(self, before: One, seen: Sighting) -> tuple[One, str]:
        """The object after a sighting, and why it is not believed, or ""."""
        if before.track is None:
            return One(self.filter.begin(seen.stamp, seen.pose, seen.covariance), seen), ""
        track = self.filter.at(before.track, seen.stamp)
        if self.filter.distance(track, seen.pose, seen.covariance) <= UNLIKELY:
            return One(self.filter.after(track, seen.pose, seen.covariance), seen), ""
        off = pose_error(seen.pose, track.pose)
        why = (
            f"it jumped by {1000 * np.hypot(*off[:2]):.1f} mm and {np.rad2deg(abs(off[2])):.1f}°"
            f" in {seen.stamp - before.track.stamp:.3f} s"
        )
        agree = before.elsewhere and _near(before.elsewhere[-1].pose, seen.pose)
        elsewhere = (*before.elsewhere, seen) if agree else (seen,)
        if len(elsewhere) >= AGREEING:
            return One(self.filter.begin(seen.stamp, seen.pose, seen.covariance), seen), ""
        return replace(before, elsewhere=elsewhere), why


def _side(one: Detected) -> float:
    return float(np.hypot(*(one.corners[1] - one.corners[0])))


def _near(a: Array, b: Array) -> bool:
    off = pose_error(a, b)
    return bool(np.hypot(*off[:2]) < NEAR and abs(off[2]) < NEAR_TURN)
