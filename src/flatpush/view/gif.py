"""The animation of a plan as a GIF, through Pillow: no ffmpeg."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import transform
from ..problem import Plan, PushSegment, Rollout, TransitSegment
from . import drawing as d
from . import palette, words
from .drawing import PAGE, SOFT, Drawing, Look
from .labels import Labels, along
from .legend import EDGE, TITLE, Entry, draw_legend, draw_title, frame_and_legend, legend_height, title_height
from .panel import BOTTOM, Panel
from .plan_figure import SLIDING
from .raster import Canvas
from .table import (
    MM,
    draw_endpoints,
    draw_number,
    draw_object,
    draw_workspace,
    tip_size,
    view_box,
    what_is_drawn,
)
from .timeline import Timeline, doing
from .trace import fingers_at, fingertips, orientation_mark, rollout_paths, trace_pushes

if TYPE_CHECKING:
    from PIL.Image import Image

FRAME_TIME = 0.08  # [s]; a GIF counts in hundredths
LONGEST = 10.0  # [s] of film; a longer plan is shown faster, and the film says how much
PAUSE = 1.5  # [s] on the last frame
PIXELS = 100 / 72  # of the film per point
RUN = (4.0, 2.0)  # dashes of a simulated run


def draw_gif(plan: Plan, rollouts: Sequence[Rollout] = ()) -> bytes:
    """Object and fingers in motion over the light traces of the plan; simulated runs in red dashes."""
    timeline = Timeline.of(plan)
    speed = max(1, int(np.ceil(timeline.duration / LONGEST)))
    frames = 1 + int(np.ceil(timeline.duration / (speed * FRAME_TIME)))
    page, panel = _background(plan, rollouts)
    background = Canvas(page.width, page.height, PIXELS, finer=2)
    for clip, item in page.items():
        background.draw(item, clip)
    images = []
    for time in np.linspace(0.0, timeline.duration, frames):
        canvas = background.copy()
        for clip, item in _moving(panel, plan, timeline, float(time), speed).items():
            canvas.draw(item, clip)
        images.append(canvas.picture())
    return _encode(images, len(plan.on_table))


def _background(plan: Plan, rollouts: Sequence[Rollout]) -> tuple[Drawing, Panel]:
    """What stays the same in all frames, with the axes that the rest is drawn in."""
    traces, scene = trace_pushes(plan), plan.scene
    title, subtitle = words.plan_title(plan), words.plan_subtitle(plan)
    box = view_box(plan, traces, rollouts)
    top = title_height(title, subtitle) + 14.0  # a line for what goes on
    several = len(traces) > 1
    entries = [
        Entry(words.push_label(t.number, t.segment, several), Look(palette.push_colour(t.number), 1.9))
        for t in traces
    ]
    entries += [Entry("fingers (white: lifted)", Look(palette.PUSHER), "dot")] if traces else []
    entries += [Entry(words.SIMULATED, Look(palette.SIMULATED, 1.2, RUN))] if rollouts else []
    frame, legend = frame_and_legend(box, entries, top, 300.0)
    bottom = max(frame[3] + BOTTOM, legend[1] + legend_height(entries, legend[2]))
    right = max(frame[2], legend[0] + legend[2], EDGE + d.text_width(title, TITLE, bold=True))
    page = Drawing(min(right + EDGE, PAGE), bottom + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, *legend)
    panel = Panel(page, frame, box)
    panel.axes()
    draw_workspace(panel, scene)
    for trace in traces:
        colour = palette.push_colour(trace.number)
        for pose in trace.marks:
            draw_object(panel, scene, pose, Look(colour, 0.6, opacity=0.22))
        if trace.flat_path is not None:
            panel.line(MM * trace.flat_path, Look(colour, 1.8, opacity=0.8), 3)
        elif not isinstance(trace.segment, PushSegment):
            way = transform(trace.segment.object, scene.object.cof)
            panel.line(MM * way, Look(colour, 1.8, SLIDING, 0.8), 3)
    labels = Labels(panel, what_is_drawn(plan, traces))
    for trace in traces if several else ():
        path = MM * transform(trace.segment.object, scene.object.cof)
        draw_number(page, labels.place(13.0, 13.0, along(panel, path), free=True), trace.number)
    draw_endpoints(panel, plan, labels)
    for rollout in rollouts:
        for path in rollout_paths(rollout, plan, traces):
            panel.line(MM * path, Look(palette.SIMULATED, 1.0, RUN), 4)
    return page, panel


def _moving(panel: Panel, plan: Plan, timeline: Timeline, time: float, speed: int) -> Drawing:
    """What one frame shows over the background."""
    scene = plan.scene
    layer = Drawing(panel.page.width, panel.page.height, "")
    over = Panel(layer, panel.frame, panel.box)
    pose, pusher, height, number = timeline.at(time)
    colour = palette.START
    if plan.segments and not isinstance(plan.segments[number], TransitSegment):
        colour = palette.push_colour(sum(s.kind != "transit" for s in plan.segments[:number]))
    draw_object(over, scene, pose, Look(colour, 2.2), 10)
    over.line(MM * transform(pose, orientation_mark(scene)), Look(colour, 1.6), 11)
    if timeline.moves:
        tips = MM * fingertips(pusher, fingers_at(plan, number))
        over.line(tips, Look(palette.PUSHER, 1.6), 12)
        for tip in tips:
            fill = "#ffffff" if height > 1e-6 else palette.PUSHER
            over.disc(tip, tip_size(over, scene), Look(palette.PUSHER, 1.2, fill=fill), 13)
    faster = f"   (×{speed})" if speed > 1 else ""
    text = f"{time:5.1f} s{faster}   {doing(plan, timeline, time)}"
    layer.add(d.Text(panel.frame[0], panel.frame[1] - 5, text, 9.0, SOFT), 20)
    return layer


def _encode(images: list["Image"], pushes: int) -> bytes:
    """Frames as one GIF with one palette, so that still parts neither flicker nor are stored twice."""
    from PIL import Image

    colours = Image.new("P", (1, 1))
    colours.putpalette(_palette(pushes))
    frames = [i.quantize(palette=colours, dither=Image.Dither.NONE) for i in images]
    times = [round(1000 * FRAME_TIME)] * len(frames)
    times[-1] = round(1000 * PAUSE)
    buffer = io.BytesIO()
    frames[0].save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=times,
        loop=0,
        optimize=False,
        disposal=1,
    )
    return buffer.getvalue()


def _palette(pushes: int) -> list[int]:
    """Our colours and what they become on white: 256 colours as a row of numbers 0 to 255."""
    named = [palette.push_colour(k) for k in range(min(max(pushes, 1), 16))]
    named += [palette.GOAL, palette.SIMULATED, palette.OBSTACLE, palette.BOUNDS]
    shades = np.linspace(1.0, 0.1, 200 // len(named))[:, None]
    rows = []
    for colour in named:
        rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
        rows.append(255 * (1 - shades * (1 - rgb)))
    # Pillow looks colours up in cells of four levels: nothing may lie close to white, or it replaces white.
    rows.append(np.append(np.linspace(0, 240, 55), 255.0)[:, None] * np.ones(3))
    return [round(float(v)) for v in np.concatenate(rows).ravel()]
