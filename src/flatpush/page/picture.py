"""What the page draws of a plan, and what it says about it: the same traces, colours and words as the figures."""

import math
from collections.abc import Sequence

import numpy as np

from ..geometry import transform
from ..planning.options import PushOption
from ..problem import Certificate, Plan, Scene, SlideSegment
from ..view import words
from ..view.page import plan_data
from ..view.table import MM
from ..view.trace import PushTrace, fingertips, trace_pushes
from .plain import plain


def picture(plan: Plan, options: Sequence[PushOption] = ()) -> dict[str, object]:
    """A plan as plain values: motion and paths [mm, rad], numbers in words, and every push that was considered."""
    found: dict[str, object] = {
        "status": plan.status,
        "title": words.plan_title(plan),
        "subtitle": words.plan_subtitle(plan),
        "places": [_place(option) for option in options],
        "planning_time": plan.run.get("planning_time"),
    }
    if plan.status != "solved":
        return found | {"reason": plan.reason}
    traces = trace_pushes(plan)
    certificate = plan.certificate
    return found | {
        "cost": words.cost_text(plan),
        "duration": plan.duration,
        "motion": plan_data(plan, traces),
        "traces": [_trace(trace, plan.scene) for trace in traces],
        "goal": plain(plan.goal_pose * [MM, MM, 1.0], 3),
        "proved": [] if certificate is None or math.isnan(certificate.goal_error[0]) else proved(certificate),
        "warnings": [] if certificate is None else list(certificate.warnings),
    }


def proved(certificate: Certificate) -> list[tuple[str, str]]:
    """What a certificate states, as names and values in words."""
    x, y, turn = certificate.goal_error
    place, angle = MM * math.hypot(x, y), math.degrees(abs(turn))
    near = "<0.001 mm" if place < 0.001 else f"{place:.3f} mm"
    rows = [("goal met within", f"{near}, <0.001°" if angle < 0.001 else f"{near}, {angle:.3f}°")]
    if certificate.friction_margin is not None:
        degrees = certificate.friction_margin_degrees
        share = "" if degrees is None else f" ({degrees:.1f}°)"
        rows.append(("friction margin", f"{_percent(certificate.friction_margin)} of μ{share}"))
    for name, value in (
        ("both contacts", certificate.composite_margin),
        ("spacing margin", certificate.spacing_margin),
        ("curvature margin", certificate.curvature_margin),
    ):
        if value is not None:
            rows.append((name, _percent(value) + (" of μ" if name.startswith("both") else "")))
    if certificate.growth is not None:
        rows.append(("small errors grow", f"{certificate.growth:.3g}-fold"))
    if certificate.sensitivity is not None:
        rows.append(("a start beside moves the end", f"{certificate.sensitivity['place']:.1f}-fold"))
    if certificate.clearance is not None:
        rows.append(("clearance", f"{MM * certificate.clearance:.2f} mm"))
    bounds, worst, margin = certificate.set_bounds, certificate.set_worst, certificate.set_margin
    if bounds and worst and margin is not None and certificate.set_loads is not None:
        rows.append((f"loads within {100 * bounds.loads:.3g} %", "proved" if margin >= 0 else "not proved"))
        rows.append((f"beyond {100 * certificate.set_loads:.3g} %", worst.gives_way))
    if certificate.tube and certificate.set_end is not None:
        dx, dy = (MM * side for side in certificate.set_end)
        rows.append(("from every start", f"x ± {dx:.3f} mm, y ± {dy:.3f} mm"))
    return rows


def _trace(trace: PushTrace, scene: Scene) -> dict[str, object]:
    """A push, or a slide with the path of the centre of friction instead of that of the flat point."""
    slides, way = isinstance(trace.segment, SlideSegment), trace.flat_path
    if slides:
        way = transform(trace.segment.object, scene.object.cof)
    return {
        "name": trace.segment.push,
        "label": words.push_label(trace.number, trace.segment, True),
        "word": words.word_of(trace.segment),
        "ghosts": plain(trace.marks * [MM, MM, 1.0], 4),
        "tips": plain(MM * fingertips(trace.pushers, trace.segment.fingers).reshape(-1, 2), 2),
        "flat": None if way is None else plain(MM * way, 2),
        "slides": slides,
    }


def _place(option: PushOption) -> dict[str, object]:
    """Where a push is on the object, in O [mm], and why it is refused."""
    return {
        "name": option.push.name,
        "at": plain(MM * np.asarray(option.push.at.point), 3),
        "refusal": option.refusal,
    }


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %" if math.isfinite(value) else "none"
