"""What an experiment found, beside what the paper says of it: rows, figures, and the table that it prints."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from ..documents.atomic import write_atomically

COLUMNS = ("what", "paper", "here", "why they differ")


@dataclass(frozen=True)
class Row:
    """One number or picture of the paper beside ours.

    Attributes:
        what: it is.
        paper: says; "" where the paper says nothing.
        ours: what flatpush computes.
        why: one sentence on the difference, or what it shows.
    """

    what: str
    paper: str
    ours: str
    why: str = ""


@dataclass(frozen=True)
class Finding:
    """The result of one experiment.

    Attributes:
        rows: beside the paper's.
        figures: names of files and their SVG, in order.
        table: what the experiment prints by itself.
        missing: what there is no result without, "" if there is one.
        failed: the mistake that ended it, "" if none did.
    """

    rows: tuple[Row, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()
    table: str = ""
    missing: str = ""
    failed: str = ""

    def text(self) -> str:
        """The rows as they are printed, the paper's and ours under each other."""
        lines = []
        for row in self.rows:
            lines.append(row.what)
            for name, value in (("paper", row.paper), ("here", row.ours), ("", row.why)):
                if value:
                    lines.append(f"  {name:<6}{value}")
        return "\n".join([*lines, *([self.table] if self.table else [])])

    def saved(self, folder: Path | None) -> str:
        """The text; with a folder the figures are written into it."""
        if folder is not None:
            for name, svg in self.figures:
                write_atomically(folder / name, svg)
        return self.text()


def drawn(draw: Callable[[Path], object], first: Sequence[str] = ()) -> tuple[tuple[str, str], ...]:
    """The figures that a function draws into a folder: names and SVG, those named first before the others."""
    with TemporaryDirectory() as place:
        draw(Path(place))
        found = {path.name: path.read_text(encoding="utf-8") for path in sorted(Path(place).glob("*.svg"))}
    order = [name for name in first if name in found]
    return tuple((name, found[name]) for name in [*order, *(n for n in found if n not in order)])
