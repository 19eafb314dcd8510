"""The animation of a plan as a GIF, through Pillow: no ffmpeg."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan, Rollout, Scene
from . import palette
from .canvas import SOFT, drawing_style, headline, new_figure, settle, table_axes
from .plan_figure import MM, draw_ends, draw_object, draw_workspace, view_box
from .timeline import Timeline, doing
from .trace import fingertips, orientation_mark, rollout_paths, trace_pushes
from .words import plan_subtitle, plan_title

FRAME_TIME = 0.08  # [s]; a GIF counts in hundredths
LONGEST = 10.0  # [s] of film; a longer plan is shown faster, and the film says how much
PAUSE = 1.5  # [s] on the last frame
GIF_DPI = 100


def draw_gif(plan: Plan, rollouts: Sequence[Rollout] = ()) -> bytes:
    """Object and fingers in motion over the light traces of the plan; simulated runs in red dashes."""
    timeline = Timeline.of(plan)
    speed = max(1, int(np.ceil(timeline.duration / LONGEST)))
    frames = 1 + int(np.ceil(timeline.duration / (speed * FRAME_TIME)))
    with drawing_style():
        figure = new_figure()
        figure.set_dpi(GIF_DPI)
        axes = table_axes(figure.add_subplot())
        traces = trace_pushes(plan)
        headline(figure, plan_title(plan), plan_subtitle(plan))
        settle(figure, [(axes, view_box(plan, traces, rollouts))])
        draw_workspace(axes, plan.scene)
        for trace in traces:
            colour = palette.push_colour(trace.number)
            for pose in trace.marks:
                draw_object(axes, plan.scene, pose, colour, linewidth=0.6, alpha=0.22)
            if trace.flat_path is not None:
                axes.plot(*(MM * trace.flat_path).T, color=colour, linewidth=1.8, alpha=0.8, zorder=3)
        draw_ends(axes, plan, traces)
        for rollout in rollouts:
            for path in rollout_paths(rollout, plan, traces):
                axes.plot(
                    *(MM * path).T, color=palette.SIMULATED, linewidth=1.0, linestyle=(0, (4, 2)), zorder=4
                )
        mover = _Mover(axes, plan, timeline, speed)
        figure.canvas.draw()
        background = figure.canvas.copy_from_bbox(figure.bbox)
        images = []
        for time in np.linspace(0.0, timeline.duration, frames):
            figure.canvas.restore_region(background)
            mover.draw(float(time))
            images.append(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())
    return _encode(images)


class _Mover:
    """The artists that change from frame to frame, drawn over a background that is drawn once."""

    def __init__(self, axes: Any, plan: Plan, timeline: Timeline, speed: int) -> None:
        self.axes, self.plan, self.timeline, self.speed = axes, plan, timeline, speed
        self.text = axes.text(
            0.008,
            0.985,
            "",
            transform=axes.transAxes,
            va="top",
            fontsize=9.5,
            color=SOFT,
            zorder=20,
            animated=True,
        )
        self.body = draw_object(
            axes, plan.scene, plan.scene.start_pose, palette.START, linewidth=2.2, animated=True
        )
        (self.mark,) = axes.plot([], [], color=palette.START, linewidth=1.6, animated=True, zorder=11)
        (self.bar,) = axes.plot([], [], color=palette.PUSHER, linewidth=1.6, animated=True, zorder=12)
        self.tips = _discs(axes, plan.scene, max((len(push.fingers) for push in plan.pushes), default=0))

    def draw(self, time: float) -> None:
        """One frame onto the canvas."""
        scene, timeline = self.plan.scene, self.timeline
        pose, pusher, height, number = timeline.at(time)
        colour = self._colour(number)
        self.body.set_xy(MM * transform(pose, scene.object.outline.polyline()))
        self.body.set_edgecolor(colour)
        self.mark.set_data(*(MM * transform(pose, orientation_mark(scene))).T)
        self.mark.set_color(colour)
        tips = MM * fingertips(pusher, self._fingers(number)) if timeline.moves else np.empty((0, 2))
        self.bar.set_data(*tips.T)
        lifted = height > 1e-6
        for disc, tip in zip(self.tips, tips, strict=False):
            disc.center = tuple(tip)
            disc.set_facecolor("white" if lifted else palette.PUSHER)
        faster = f"   (×{self.speed})" if self.speed > 1 else ""
        self.text.set_text(f"{time:5.1f} s{faster}   {doing(self.plan, timeline, time)}")
        for artist in (self.body, self.mark, self.bar, *self.tips[: len(tips)], self.text):
            self.axes.draw_artist(artist)

    def _fingers(self, number: int) -> Array:
        """The fingertips of this push; of the next while the pusher moves alone, else of the last."""
        segments = self.plan.segments
        for segment in (*segments[number:], *reversed(segments[:number])):
            if segment.kind == "push":
                return segment.fingers
        return np.zeros((1, 2))

    def _colour(self, number: int) -> str:
        if not self.plan.segments or self.plan.segments[number].kind != "push":
            return palette.START
        return palette.push_colour(sum(s.kind == "push" for s in self.plan.segments[:number]))


def _discs(axes: Any, scene: Scene, count: int) -> list[Any]:
    from matplotlib.patches import Circle

    radius = MM * max(scene.pusher.tip_radius, 0.008 * scene.object.outline.size)
    look = {
        "facecolor": palette.PUSHER,
        "edgecolor": palette.PUSHER,
        "linewidth": 1.2,
        "zorder": 13,
        "animated": True,
    }
    return [axes.add_patch(Circle((0, 0), radius, **look)) for _ in range(count)]


def _encode(images: list[Array]) -> bytes:
    """Frames as one GIF with one palette, so that still parts neither flicker nor are stored twice."""
    from PIL import Image

    colours = Image.new("P", (1, 1))
    colours.putpalette(_palette())
    frames = [Image.fromarray(i).quantize(palette=colours, dither=Image.Dither.NONE) for i in images]
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


def _palette() -> list[int]:
    """Our colours and what they become on white: 256 colours as a row of numbers 0 to 255."""
    from matplotlib.colors import to_rgb

    named = [*palette.PUSHES, palette.GOAL, palette.SIMULATED, palette.OBSTACLE, palette.BOUNDS]
    shades = np.linspace(1.0, 0.1, 20)[:, None]
    rows = [255 * (1 - shades * (1 - np.array(to_rgb(colour)))) for colour in named]
    # Pillow looks colours up in cells of four levels: nothing may lie close to white, or it replaces white.
    rows.append(np.append(np.linspace(0, 240, 55), 255.0)[:, None] * np.ones(3))
    return [round(float(v)) for v in np.concatenate(rows).ravel()]
