"""Rows of recorded numbers: what makes one unusable, and how a file with such rows is refused."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import InputError

_MOST_NAMED = 5


@dataclass(frozen=True)
class BadRow:
    """A row that cannot be used.

    Attributes:
        line: its number in the file, counted from 1.
        reason: what is wrong.
    """

    line: int
    reason: str


class Unusable(Exception):
    """Why a row is left out."""


def number(cell: str, name: str, most: float = math.inf) -> float:
    """The finite number in a cell of a column, at most so large; Unusable if it holds none."""
    text = cell.strip()
    try:
        value = float(text)
    except ValueError:
        raise Unusable(f"{name} is not a number ({text[:20]!r})") from None
    if not math.isfinite(value):
        raise Unusable(f"{name} is not finite ({text})")
    if abs(value) > most:
        raise Unusable(f"{name} is beyond {most:g} ({text})")
    return value


def is_number(text: str) -> bool:
    """Whether a first cell, or what stands before its first blank, is a number: then the file names no columns."""
    try:
        float(text.split()[0] if text else text)
    except ValueError:
        return False
    return True


def refusal(bad: Sequence[BadRow], source: str, leave_out: str) -> InputError:
    """Of a file that holds bad rows; `leave_out` says how it is read without them."""
    named = "; ".join(f"line {row.line}: {row.reason}" for row in bad[:_MOST_NAMED])
    more = f"; and {len(bad) - _MOST_NAMED} more" if len(bad) > _MOST_NAMED else ""
    return InputError(
        f"{len(bad)} row{'s' if len(bad) > 1 else ''} cannot be used: {named}{more}",
        source=source,
        hint=f"Correct the file, or leave such rows out{leave_out}.",
    )
