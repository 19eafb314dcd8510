"""What several commands share: poses on the command line, units in print, and a word when something takes long."""

import json
import math
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

import typer

from .. import compiling
from ..errors import InputError

if TYPE_CHECKING:
    from ..geometry.pose import Array
    from ..problem import Plan
    from ..simulation import Claim


def goal_values(text: str | None) -> list[float | str] | None:
    """A goal "x,y,θ" or "x,y,free" from the command line."""
    *place, last = text.rsplit(",", 1) if text is not None else [""]
    if last.strip() != "free":
        return [*(numbers(text, 3, "--goal") or [])] or None
    return [*(numbers(",".join(place), 2, "--goal x,y,free") or []), "free"]


def numbers(text: str | None, count: int, option: str) -> list[float] | None:
    """A list such as "60,20,135" from the command line."""
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise InputError(f"{option} takes {count} numbers separated by commas", value=text)
    return values


def check_latency(seconds: float) -> None:
    """Refuses a --latency that is none."""
    if not (math.isfinite(seconds) and seconds >= 0):
        raise InputError("--latency is a finite number of seconds, 0 or more", value=seconds)


def pose_text(pose: "Array | Sequence[float]") -> str:
    """A pose in mm and degrees, the angle within half a turn, or any."""
    turn = 0.0 if math.isnan(pose[2]) else math.remainder(math.degrees(pose[2]), 360)
    x, y, angle = (round(value, 2) + 0.0 for value in (1000 * pose[0], 1000 * pose[1], turn))
    return f"({x:.2f} mm, {y:.2f} mm, " + ("any angle)" if math.isnan(pose[2]) else f"{angle:.2f}°)")


def error_text(distance: float, turn: float | None) -> str:
    """A distance [m] and an angle [rad] in mm and degrees; what is below a thousandth is said to be so.

    None as the angle stands for a goal that leaves it open.
    """
    mm = 1000 * distance
    length = "<0.001 mm" if mm < 0.001 else f"{mm:.3f} mm"
    if turn is None:
        return f"{length} with any angle"
    degrees = math.degrees(abs(turn))
    return length + (" and <0.001°" if degrees < 0.001 else f" and {degrees:.3f}°")


def growth_text(growth: float) -> str:
    return f"{growth:.1f}-fold" if growth < 1000 else f"{growth:.0e}-fold"


def cost_text(cost: float, kind: str) -> str:
    """A cost in its unit; one that would round to nothing is said to be smaller than the last digit."""
    if kind == "time":
        return "<0.01 s" if 0 < cost < 0.005 else f"{cost:.2f} s"
    return "<0.1 mm" if 0 < cost < 0.00005 else f"{1000 * cost:.1f} mm"


def tell_failed(failed: Sequence["Claim"]) -> None:
    """Names the claims of a plan that do not hold, on standard error."""
    for claim in failed:
        typer.echo(
            f"✗ {claim.name}: stated {claim.stated}, found {claim.recomputed} ({claim.rule})", err=True
        )


def warn_unverified(plan: "Plan") -> None:
    """Warns of a plan that fails verification."""
    from ..simulation import verify

    failed = verify(plan).failed if plan.status == "solved" else ()
    if failed:
        names = ", ".join(claim.name for claim in failed[:3]) + (", …" if len(failed) > 3 else "")
        typer.echo(f"warning: this plan fails verification ({names}); see flatpush verify", err=True)


def tell_slow_way(plan: "Plan", runs: int = 1, rate: float | None = None) -> None:
    """Says how long runs of a plan take where the simulator's steps are not compiled, by one step that is measured.

    Args:
        rate: of a controller [Hz]; None: a step for each sample of the plan.
    """
    from ..simulation.plant import Plant

    moving = [push for push in plan.on_table if len(push.times) > 2]
    if not moving:
        return
    push, middle = moving[0], len(moving[0].times) // 2
    plant = Plant(plan.scene.object, push.fingers, plan.scene.pusher.tip_radius)
    if plant.compiled:
        return
    before, after = push.pusher[middle - 1], push.pusher[middle]
    # The first step loads what the later ones need.
    state = plant.step(plant.start(push.object[middle - 1], before), after - before, 1.0)
    began = time.perf_counter()
    plant.step(state, after - before, 1.0)
    each = time.perf_counter() - began
    steps = sum(len(p.times) if rate is None else p.times[-1] * rate for p in moving)
    typer.echo(
        "the simulator knows no quick way for this table (all feet stand on one line);"
        f" this takes about {runs * steps * each:.0f} s",
        err=True,
    )


def print_json(value: object) -> None:
    typer.echo(json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False))


@contextmanager
def telling(what: str, after: float = 1.0) -> Iterator[None]:
    """Says on standard error what is being done, if it takes longer than a second; compiling does not count."""
    over, began = threading.Event(), compiling.clock()

    def wait() -> None:
        while not over.wait(0.1):
            if compiling.clock() - began > after:
                typer.echo(f"{what} …", err=True)
                return

    threading.Thread(target=wait, daemon=True).start()
    try:
        yield
    finally:
        over.set()


class CompilingNotice:
    """Tells who waits what is being compiled: on a terminal in a line that is rewritten, elsewhere once.

    Args:
        stream: standard error.
        period: the terminal's line is rewritten so often [s]; what is ready earlier is not mentioned.
    """

    def __init__(self, stream: TextIO, period: float = 0.5) -> None:
        self._stream, self._period = stream, period
        self._live = stream.isatty()
        self._work: compiling.Work | None = None
        self._began: float | None = None

    def __call__(self, work: compiling.Work) -> None:
        first, self._work = self._began is None, None if work.over else work
        if first:
            self._began = time.perf_counter()
            if self._live:
                threading.Thread(target=self._keep_writing, daemon=True).start()
            else:
                self._stream.write(
                    f"compiling {work.kernel} and what else is needed, once on this machine …\n"
                )
                self._stream.flush()

    def _keep_writing(self) -> None:
        written = False
        while True:
            time.sleep(self._period)
            work = self._work
            if work is not None:
                self._stream.write(f"\r\033[K{self.line(work)}")
            elif written:
                self._stream.write("\r\033[K")
            written = work is not None
            self._stream.flush()

    def line(self, work: compiling.Work) -> str:
        """What, a bar, how many of how many functions, and for how long in all."""
        filled = round(20 * work.done / max(work.of, 1))
        seconds = time.perf_counter() - (self._began or time.perf_counter())
        bar = "█" * filled + "·" * (20 - filled)
        return (
            f"compiling {work.kernel} {bar} {work.done} of {work.of}, {seconds:.0f} s (once on this machine)"
        )
