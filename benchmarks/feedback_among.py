"""The horizon controller among things: tasks of experiments.feedback_among.

    python benchmarks/feedback_among.py [RUNS] [FIRST] [FINGERS] [free]

FINGERS is 1 (default) or 2: two fingers by the ReplanningController, to 1 mm and 1°. "free": with nothing in the way.

RUNS (default 200) tasks from number FIRST (0) on, in one process. Prints every run that fails as it comes, then how
many ended within 2 mm and 2° and touched nothing, how far off, landings and times, the least room that was left, and
what the ticks take of a processor: those that push, and all others (looks, in which ways are sought, and landings).
"""

import sys
from time import process_time as clock

import numpy as np

from flatpush.control.horizon.controller import HorizonController
from flatpush.control.tracking.replanning_controller import ReplanningController
from flatpush.experiments.feedback_among import (
    SPACING,
    EndedAmong,
    attempt_among,
    carried_task,
    crowded_task,
    least_room,
)

TIPS = np.array([[0.0, 0.0], [0.0, 0.5 * SPACING], [0.0, -0.5 * SPACING]])
PUSHING, OTHERS = [], []  # what ticks take [s of a processor]


class Timed(HorizonController):
    """A horizon controller whose ticks are timed."""

    def act(self, state, time):
        began = clock()
        after, command = super().act(state, time)
        (PUSHING if after.mode == "push" else OTHERS).append(clock() - began)
        return after, command


class TimedOfTwo(ReplanningController):
    """The same with two fingers."""

    def act(self, state, time):
        began = clock()
        after, command = super().act(state, time)
        (PUSHING if after.mode in ("path", "saturated") else OTHERS).append(clock() - began)
        return after, command


def main(runs: int, first: int, fingers: int, free: bool) -> None:
    ends, rooms = [], []
    for number in range(first, first + runs):
        asked = carried_task(number) if free else crowded_task(number, fingers=fingers)
        if fingers == 1 and not asked.steerable:
            continue
        ended, run = attempt_among(asked, Timed if fingers == 1 else TimedOfTwo)
        ends.append(ended)
        if run is not None and not free:
            rooms.append(least_room(asked.scene, run, TIPS[:fingers] if fingers == 1 else TIPS[1:]))
        if not ended.good:
            off = f"{1000 * ended.distance:.2f} mm, {np.rad2deg(ended.angle):.2f}°, {ended.landings} landings"
            words = f"{ended.outcome}; {ended.touched or 'nothing touched'} ({off}, {ended.time:.0f} s)"
            print(f"task {number}, {asked.scene.object.name}: {words}", flush=True)
        if len(ends) % 50 == 0:
            summary(ends, rooms)
    summary(ends, rooms)


def summary(ends: list[EndedAmong], rooms: list[float]) -> None:
    good, hit = sum(end.good for end in ends), sum(bool(end.touched) for end in ends)
    off = np.median([[1000 * end.distance, np.rad2deg(end.angle)] for end in ends], axis=0)
    print(f"{good} of {len(ends)} where they should without a touch; {hit} touched something")
    print(
        f"median off the goal {off[0]:.2f} mm, {off[1]:.2f}°; least room {1000 * min(rooms, default=np.inf):.2f} mm"
    )
    for name, values in (("landings", [e.landings for e in ends]), ("time [s]", [e.time for e in ends])):
        middle, high = np.quantile(values, [0.5, 0.95])
        print(f"{name}: median {middle:.1f}, 95 % {high:.1f}, most {max(values):.1f}")
    for name, values in (("pushing", PUSHING), ("of all else, looks and landings included,", OTHERS)):
        ms = 1000 * np.quantile(values, [0.5, 0.99, 1.0])
        print(
            f"ticks {name}: median {ms[0]:.2f} ms, 99 % {ms[1]:.2f} ms, most {ms[2]:.1f} ms ({len(values)})"
        )


if __name__ == "__main__":
    given = sys.argv[1:] + ["200", "0", "1", ""][len(sys.argv) - 1 :]
    main(int(given[0]), int(given[1]), int(given[2]), given[3] == "free")
