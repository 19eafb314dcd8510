"""Matplotlib figures without pyplot, global state or dates: the same drawing gives the same bytes."""

import io
import re
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

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
Box = tuple[float, float, float, float]  # xmin, ymin, xmax, ymax [mm]
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


def new_figure(width: float = 8.0, height: float = 16 / 3) -> Any:
    """An empty figure with the Agg canvas and constrained layout; inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.08, h_pad=0.08)
    return figure


def figure_bytes(figure: Any, extension: str, title: str) -> bytes:
    """The figure as ".png" or ".svg" (as wide as its page allows)."""
    buffer = io.BytesIO()
    if extension == ".png":
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Title": title})
        return buffer.getvalue()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Title": title})
    text = buffer.getvalue().decode("utf-8")
    return re.sub(r'(<svg [^>]*?)height="[^"]*" ', r"\1", _full_width(text), count=1).encode("utf-8")


def table_axes(axes: Any) -> Any:
    """Dresses axes that show the table in mm; returns them."""
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.grid(True, color="#ececec", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(length=2.5, width=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return axes


def settle(figure: Any, boxes: Sequence[tuple[Any, Box]]) -> None:
    """Equal scales in axes that hold their box and fill their place; call it once titles and legend stand."""
    for axes, box in boxes:
        axes.set(xlim=box[::2], ylim=box[1::2], autoscale_on=False)
    figure.draw_without_rendering()
    for axes, box in boxes:
        place = axes.get_window_extent()
        middle, half = (
            [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2],
            [(box[2] - box[0]) / 2, (box[3] - box[1]) / 2],
        )
        scale = max(half[0] / place.width, half[1] / place.height)
        reach = (scale * place.width, scale * place.height)
        axes.set(
            xlim=(middle[0] - reach[0], middle[0] + reach[0]),
            ylim=(middle[1] - reach[1], middle[1] + reach[1]),
        )
        axes.set_aspect("equal", adjustable="box")


def headline(figure: Any, title: str, subtitle: str) -> None:
    """Bold and plain lines above the drawing, flush left, in space kept for them; long ones are wrapped."""
    width, height = figure.get_size_inches()
    below, left = 0.11, 0.12 / width
    for text, size, room, step, ink in ((title, 11.5, 9.5, 0.23, INK), (subtitle, 9.5, 13.0, 0.19, SOFT)):
        for line in textwrap.wrap(text, int(room * width), max_lines=4, placeholder=" …"):
            weight = "bold" if ink == INK else "normal"
            figure.text(left, 1 - below / height, line, va="top", fontsize=size, color=ink, weight=weight)
            below += step
    figure.get_layout_engine().set(rect=(0, 0, 1, 1 - (below - 0.01) / height))


def legend_below(figure: Any, entries: Sequence[Any]) -> None:
    """A legend under the drawing in as many columns as fit, at most four."""
    for columns in (4, 3, 2, 1):
        legend = figure.legend(handles=entries, loc="outside lower left", ncols=columns)
        figure.draw_without_rendering()
        if legend.get_window_extent().x1 <= figure.bbox.width or columns == 1:
            return
        legend.remove()


def _full_width(svg: str) -> str:
    return re.sub(r'(<svg [^>]*?)width="[^"]*"', r'\1width="100%"', svg, count=1)
