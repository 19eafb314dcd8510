"""A plan that is followed under feedback, tick by tick as the page asks for it, while somebody moves the object."""

import math
import time
from collections.abc import Mapping
from typing import cast

import numpy as np

from ..control import Camera, ControllerState
from ..control.loop.closed_loop import Tick, ticks
from ..control.tracking.simulated_run import Law, TrackedRun
from ..errors import InputError
from ..problem import Plan
from ..view.table import MM
from ..view.track_figure import CONTACTS
from .values import number_of, numbers_of, whole_of

CONTROLLERS = "path", "dfl", "horizon"
LONGEST, WORK = (
    2.0,
    0.08,
)  # of one request: simulated [s], and computed before it is answered all the same [s of CPU]
MOST = 2**31  # of a seed
LATEST = 2.0  # a camera [s]
NEAR = 0.002, math.radians(2.0)  # the goal, for a controller that lands until it is there [m], [rad]
BEGUN = "landing"  # how the note of a landing begins


class Followed:
    """One run: a plan, a controller, a camera that is late and noisy, and the plant."""

    def __init__(self, plan: Plan, value: Mapping[str, object]) -> None:
        """Begins a run.

        Args:
            plan: that is followed.
            value: controller; delay of the camera [s], its frames in a second, and its noise [mm, °]; learn: whether
                the steering is learned; seed of the noise.

        Raises:
            InputError: for anything else, and for a plan that this controller cannot follow.
        """
        law, learn = value.get("controller"), value.get("learn")
        if law not in CONTROLLERS:
            raise InputError(f"a controller is one of {', '.join(CONTROLLERS)}", key="controller", value=law)
        if not isinstance(learn, bool):
            raise InputError("it is learned or not: true or false", key="learn", value=learn)
        delay = number_of(value, "delay")
        if not 0 <= delay <= LATEST:
            raise InputError(f"a camera is at most {LATEST:g} s late", key="delay", value=delay)
        place, angle = numbers_of(value, "noise", 2).tolist()
        seed = whole_of(value, "seed", 0, MOST)
        goal = plan.scene.planning.goal_tolerance
        within = (max(NEAR[0], min(goal[:2])), max(NEAR[1], goal[2])) if law == "horizon" else None
        camera = Camera(number_of(value, "frames"), delay, place / MM, math.radians(angle))
        self._run = TrackedRun(cast("Law", law), learn=learn, camera=camera, seed=seed, tolerance=within)
        self._plan, self._landings, self._note = plan, 0, ""
        self._patience = self._run.patience(plan)
        parts = self._run.parts(plan)
        self._rate = parts[0].rate
        self._ticks = ticks(*parts)
        self._tick: Tick[ControllerState] = next(self._ticks)
        self._outcome = ""

    def on(self, value: Mapping[str, object]) -> dict[str, object]:
        """The run goes on.

        Args:
            value: seconds that it goes on for; moved: where somebody moves the object [mm, mm, rad], or None.

        Returns:
            rows of time [s], object, pusher [mm, mm, rad] and height [mm]; what the camera saw last; what the contact
            does in words, with its colour and whether it touches; what the controller does; the number of landings;
            the outcome, or "".
        """
        seconds = number_of(value, "seconds")
        if not 0 < seconds <= LONGEST:
            raise InputError(f"it goes on for at most {LONGEST:g} s", key="seconds", value=seconds)
        there = None if value.get("moved") is None else numbers_of(value, "moved", 3)
        until, work = self._tick.time + seconds - 0.5 / self._rate, time.process_time() + WORK
        rows = [_row(self._tick)]
        while not self._outcome and self._tick.time < until and time.process_time() < work:
            self._tick = self._ticks.send(None if there is None else there / [MM, MM, 1.0])
            there = None
            rows.append(_row(self._tick))
            self._noted(self._tick)
        state = self._tick.state
        seen = state.seen.frame
        contact, colour = CONTACTS[self._tick.contact]
        return {
            "kind": "followed",
            "rows": rows,
            "seen": None if seen is None else _shown(seen.object),
            "mode": state.mode,
            "contact": contact,
            "colour": colour,
            "touches": self._tick.contact.startswith(("sticking", "sliding")),
            "note": self._note,
            "landings": self._landings,
            "outcome": self._outcome,
        }

    def _noted(self, tick: Tick[ControllerState]) -> None:
        note = tick.state.note
        if note.startswith(BEGUN) and note != self._note:
            self._landings += 1
        self._note = note
        self._outcome = self._run.judged(self._plan, tick.outcome, tick.object)
        if not self._outcome and tick.time > self._patience:
            self._outcome = f"out of time after {self._patience:.0f} s, {tick.state.mode}"


def _row(tick: Tick[ControllerState]) -> list[float]:
    return [round(tick.time, 4), *_shown(tick.object), *_shown(tick.pusher), round(MM * tick.height, 2)]


def _shown(pose: np.ndarray) -> list[float]:
    x, y, angle = np.asarray(pose, dtype=float).tolist()
    return [round(MM * x, 3), round(MM * y, 3), round(angle, 5)]
