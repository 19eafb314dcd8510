"""What several commands share: poses on the command line, units in print, and a word when something takes long."""

import json
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from ..errors import InputError


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


def pose_text(pose: Any) -> str:
    """A pose in mm and degrees, the angle within half a turn."""
    x, y, angle = (
        round(value, 2) + 0.0
        for value in (1000 * pose[0], 1000 * pose[1], math.remainder(math.degrees(pose[2]), 360))
    )
    return f"({x:.2f} mm, {y:.2f} mm, {angle:.2f}°)"


def error_text(distance: float, turn: float) -> str:
    """A distance [m] and an angle [rad] in mm and degrees; what is below a thousandth is said to be so."""
    mm, degrees = 1000 * distance, math.degrees(abs(turn))
    return ("<0.001 mm" if mm < 0.001 else f"{mm:.3f} mm") + (
        " and <0.001°" if degrees < 0.001 else f" and {degrees:.3f}°"
    )


def growth_text(growth: float) -> str:
    return f"{growth:.1f}-fold" if growth < 1000 else f"{growth:.0e}-fold"


def cost_text(cost: float, kind: str) -> str:
    """A cost in its unit; one that would round to nothing is said to be smaller than the last digit."""
    if kind == "time":
        return "<0.01 s" if 0 < cost < 0.005 else f"{cost:.2f} s"
    return "<0.1 mm" if 0 < cost < 0.00005 else f"{1000 * cost:.1f} mm"


def print_json(value: Any) -> None:
    typer.echo(json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False))


@contextmanager
def telling(what: str, after: float = 1.0) -> Iterator[None]:
    """Says on standard error what is being done, if it takes longer than a second."""
    timer = threading.Timer(after, lambda: typer.echo(f"{what} …", err=True))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
