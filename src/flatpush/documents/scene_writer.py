"""Writes a scene as a document in SI, with everything filled in."""

import math
from dataclasses import asdict
from typing import Any

from ..errors import InputError
from ..geometry import Outline
from ..problem import Scene
from .reading import join
from .support_form import support_form
from .surface_file import surface_form


def scene_document(scene: Scene) -> dict[str, object]:
    """The scene as a mapping of plain values in m and rad, which parse_scene reads back to an equal scene,
    exactly.

    Pushes stand as points (at), with their fingers; defaults are filled in; an outline that came from a
    drawing is a list of corners.

    Raises:
        InputError: if the scene holds what a document cannot (a number that is not finite, an exact limit
            surface).
    """
    obj, planning = scene.object, scene.planning
    target: dict[str, Any] = {
        "name": obj.name,
        "outline": _outline(obj.outline),
        "support": support_form(obj),
        "friction": float(obj.friction),
    }
    if obj.surface is not None:
        target["surface"] = surface_form(obj.surface)
    if obj.uncertainty is not None:
        known = obj.uncertainty
        target["uncertainty"] = {"loads": float(known.loads), "offset": float(known.offset)}
        if known.friction is not None:
            target["uncertainty"]["friction"] = [float(x) for x in known.friction]
        if known.start is not None:
            region = {"position": float(known.start.position), "angle": float(known.start.angle)}
            target["uncertainty"]["start"] = region
    pushes: str | list[dict[str, Any]] = "auto"
    if not isinstance(scene.pushes, str):
        pushes = [
            {
                "name": p.name,
                "at": p.at.point.tolist(),
                "fingers": int(p.fingers),
                "spacing": float(p.spacing),
            }
            for p in scene.pushes
        ]
    document: dict[str, object] = {
        "flatpush": "scene/1",
        "units": {"length": "m", "angle": "rad"},
        "object": target,
        "pusher": {key: _number(value) for key, value in asdict(scene.pusher).items()},
        "pushes": pushes,
        "start": scene.start_pose.tolist(),
        "goal": goal_values(scene),
    }
    workspace: dict[str, Any] = {}
    if scene.workspace.bounds is not None:
        workspace["bounds"] = [float(x) for x in scene.workspace.bounds]
    if len(scene.workspace.obstacles):
        workspace["obstacles"] = [
            {"circle": float(o.radius), "centre": o.centre.tolist()} if o.is_circle else o.vertices.tolist()
            for o in scene.workspace.obstacles
        ]
    if workspace:
        document["workspace"] = workspace
    document["planning"] = {
        "model": planning.model,
        "two_finger": planning.two_finger,
        **({"proof": planning.proof} if obj.uncertainty is not None else {}),
        **({"slides": planning.slides} if planning.slides != "auto" else {}),
        "cost": planning.cost,
        "switch_cost": float(planning.switching),
        "margin": {"friction": float(planning.friction_margin), "clearance": float(planning.clearance)},
        "goal_tolerance": [float(x) for x in planning.goal_tolerance],
        "robust": bool(planning.robust),
        "seed": int(planning.seed),
        "iterations": int(planning.iterations),
        "time_limit": float(planning.time_limit),
    }
    _check_finite(document, "")
    return document


def goal_values(scene: Scene) -> list[float | str]:
    """A goal as a document holds it, [x, y, angle] or [x, y, "free"], in m and rad."""
    x, y, angle = scene.goal_pose.tolist()
    return [x, y, "free" if scene.free_angle else angle]


def _outline(outline: Outline) -> Any:
    if not outline.is_circle:
        return outline.vertices.tolist()
    centre = {"centre": outline.centre.tolist()} if outline.centre.any() else {}
    return {"circle": float(outline.radius), **centre}


def _number(value: Any) -> Any:
    """Plain values for NumPy's; a whole number stays one."""
    return value if isinstance(value, str | bool | int) else float(value)


def _check_finite(value: Any, key: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError("a document holds finite numbers", key=key, value=value)
    for step, item in (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    ):
        _check_finite(item, join(key, step))
