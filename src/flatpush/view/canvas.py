"""Matplotlib figures without pyplot, global state or dates: the same drawing gives the same bytes."""

import io
import re
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

STYLE = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.linewidth": 0.7,
    "axes.edgecolor": "#777777",
    "axes.labelcolor": "#333333",
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "legend.columnspacing": 1.6,
    "hatch.linewidth": 0.6,
    "text.parse_math": False,  # names are not formulas
    "svg.hashsalt": "flatpush",
    "svg.fonttype": "path",
}
INK, SOFT = "#1a1a1a", "#555555"
DPI = 150  # of a PNG: 8 × 5.33 inches are 1200 × 800 pixels


@contextmanager
def drawing_style() -> Iterator[None]:
    """Our style and nothing of the user's matplotlibrc, until the end of the block."""
    import matplotlib

    with matplotlib.rc_context(), warnings.catch_warnings():
        # A name may use letters that the font has not; boxes stand for them.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def new_figure(width: float = 8.0, height: float = 16 / 3) -> "Figure":
    """An empty figure with the Agg canvas and constrained layout; inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(
        figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08), facecolor="white"
    )
    FigureCanvasAgg(figure)
    return figure


def figure_bytes(figure: "Figure", extension: str, title: str) -> bytes:
    """The figure as ".png" or ".svg" (as wide as its page allows)."""
    buffer = io.BytesIO()
    if extension == ".png":
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Title": title})
        return buffer.getvalue()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Title": title})
    text = buffer.getvalue().decode("utf-8")
    return re.sub(r'(<svg [^>]*?)height="[^"]*" ', r"\1", _full_width(text), count=1).encode("utf-8")


def headline(figure: "Figure", title: str, subtitle: str) -> None:
    """Bold and plain lines above the drawing, flush left, in space kept for them; long ones are wrapped."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    width, height = figure.get_size_inches()
    below, left = 0.11, 0.12 / width
    for text, size, room, step, ink in ((title, 11.5, 9.5, 0.23, INK), (subtitle, 9.5, 13.0, 0.19, SOFT)):
        for line in textwrap.wrap(text, int(room * width), max_lines=4, placeholder=" …"):
            weight = "bold" if ink == INK else "normal"
            figure.text(left, 1 - below / height, line, va="top", fontsize=size, color=ink, weight=weight)
            below += step
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(rect=(0, 0, 1, 1 - (below - 0.01) / height))


def legend_below(figure: "Figure", entries: Sequence["Artist"]) -> None:
    """A legend under the drawing in as many columns as fit, at most four."""
    for columns in (4, 3, 2, 1):
        legend = figure.legend(handles=entries, loc="outside lower left", ncols=columns)
        figure.draw_without_rendering()
        if legend.get_window_extent().x1 <= figure.bbox.width or columns == 1:
            return
        legend.remove()


def _full_width(svg: str) -> str:
    return re.sub(r'(<svg [^>]*?)width="[^"]*"', r'\1width="100%"', svg, count=1)
