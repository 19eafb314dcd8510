"""Reads and writes a plan document."""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Arc, CarCentres, Certificate, Plan, PushSegment, Segment, SlideSegment, TransitSegment
from ..problem.certificate import SetBounds, SetWorst, TubePart
from .atomic import write_atomically
from .plan_model import (
    CertificatePart,
    NoCertificatePart,
    PlanModel,
    PushSegmentPart,
    SlideSegmentPart,
    TransitSegmentPart,
)
from .reading import join, plain
from .refusals import checked
from .scene_digest import scene_digest
from .scene_reader import parse_scene
from .scene_writer import scene_document


def save_plan(plan: Plan, path: str | os.PathLike[str]) -> None:
    """Writes the plan document, JSON in SI, whole or not at all.

    Raises:
        InputError: if the file cannot be written or the plan holds a number that is not finite.
    """
    write_atomically(path, as_text(plan_document(plan)))


def plan_document(plan: Plan) -> dict[str, object]:
    """The plan as a mapping of plain values in SI.

    In the certificate and in run, what is not finite stands as None; elsewhere it is refused.
    """
    document: dict[str, object] = {"flatpush": "plan/1", "status": plan.status}
    if plan.reason:
        document["reason"] = plan.reason
    return document | {
        "scene": scene_document(plan.scene),
        "scene_digest": plan.scene_digest or scene_digest(plan.scene),
        "cost": None if plan.status == "no_plan" else _finite(plan.cost, "cost"),
        "duration": _finite(plan.duration, "duration"),
        "run": _open(plan.run),
        "segments": [_segment(s, join("segments", i)) for i, s in enumerate(plan.segments)],
        "certificate": {} if plan.certificate is None else _certificate(plan.certificate),
    }


def parse_plan(document: Mapping[str, object], source: str = "") -> Plan:
    """The plan in a mapping that is laid out like a plan document.

    Raises:
        InputError: as load_plan.
    """
    version = document.get("flatpush") if isinstance(document, Mapping) else None
    if version != "plan/1":
        hint = "Is it a plan? flatpush plan SCENE -o FILE writes one."
        if isinstance(version, str) and version.startswith("scene/"):
            hint = "This is a scene: plan it first, flatpush plan SCENE -o FILE."
        raise InputError(
            "this flatpush reads plan/1", source=source, key="flatpush", value=version, hint=hint
        )
    model = checked(PlanModel, plain(document, source), source)
    solved = model.status == "solved"
    if solved != (model.cost is not None):
        rule = "a solved plan has a cost" if solved else "without a plan there is no cost"
        raise InputError(
            rule, source=source, key="cost", value=model.cost, hint="The file was changed: plan again."
        )
    return Plan(
        status=model.status,
        scene=parse_scene(model.scene, source, "scene"),
        cost=float("nan") if model.cost is None else model.cost,
        duration=model.duration,
        segments=tuple(_read_segment(s, join("segments", i), source) for i, s in enumerate(model.segments)),
        certificate=_read_certificate(model.certificate),
        reason=model.reason,
        scene_digest=model.scene_digest,
        run=model.run,
    )


def as_text(document: Mapping[str, object]) -> str:
    """A document as JSON, with one line for each list of numbers."""
    return _lines(document, "") + "\n"


def finite_list(values: ArrayLike, key: str) -> list[object]:
    """The array as nested lists; refuses what is not finite."""
    array: Array = np.asarray(values, dtype=float)
    if not np.isfinite(array).all():
        raise InputError("a document holds finite numbers", key=key)
    return array.tolist()


def _segment(segment: Segment, key: str) -> dict[str, Any]:
    if isinstance(segment, TransitSegment):
        return {"kind": "transit", **_lists(segment, key, "times", "pusher", "height")}
    if isinstance(segment, SlideSegment):
        return {
            "kind": "slide",
            "push": segment.push,
            **_lists(segment, key, "times", "object", "pusher", "fingers", "end"),
            "sensitivity": {
                name: _finite(value, join(key, "sensitivity")) for name, value in segment.sensitivity.items()
            },
        }
    arcs = [
        {
            "turn": arc.turn,
            "twist": finite_list(arc.twist, join(key, "arcs")),
            "duration": _finite(arc.duration, join(key, "arcs")),
            "cost": _finite(arc.cost, join(key, "arcs")),
        }
        for arc in segment.arcs
    ]
    return {
        "kind": "push",
        "push": segment.push,
        "word": segment.word,
        "arcs": arcs,
        **_lists(segment, key, "times", "object", "pusher", "fingers"),
    }


def _lists(segment: Any, key: str, *names: str) -> dict[str, list[object]]:
    return {name: finite_list(getattr(segment, name), join(key, name)) for name in names}


def _read_segment(
    part: PushSegmentPart | SlideSegmentPart | TransitSegmentPart, key: str, source: str
) -> Segment:
    hint = "The file was changed: plan again."
    count = len(part.times)
    if part.times[0] != 0 or any(b < a for a, b in zip(part.times, part.times[1:], strict=False)):
        raise InputError(
            "times start at 0 and never go back",
            source=source,
            key=join(key, "times"),
            value=part.times,
            hint=hint,
        )
    names = ("pusher", "height") if isinstance(part, TransitSegmentPart) else ("object", "pusher")
    for name in names:
        if len(getattr(part, name)) != count:
            raise InputError(
                f"there is one entry for each of the {count} times",
                source=source,
                key=join(key, name),
                value=f"{len(getattr(part, name))} entries",
                hint=hint,
            )
    if isinstance(part, TransitSegmentPart):
        return TransitSegment(
            times=np.array(part.times, dtype=float),
            pusher=np.array(part.pusher, dtype=float),
            height=np.array(part.height, dtype=float),
        )
    if isinstance(part, SlideSegmentPart):
        return SlideSegment(
            push=part.push,
            times=np.array(part.times, dtype=float),
            object=np.array(part.object, dtype=float),
            pusher=np.array(part.pusher, dtype=float),
            fingers=np.array(part.fingers, dtype=float),
            end=np.array(part.end, dtype=float),
            sensitivity=part.sensitivity.model_dump(),
        )
    return PushSegment(
        push=part.push,
        word=part.word,
        arcs=tuple(Arc(a.turn, np.array(a.twist, dtype=float), a.duration, a.cost) for a in part.arcs),
        times=np.array(part.times, dtype=float),
        object=np.array(part.object, dtype=float),
        pusher=np.array(part.pusher, dtype=float),
        fingers=np.array(part.fingers, dtype=float),
    )


def _certificate(certificate: Certificate) -> dict[str, Any]:
    values = asdict(certificate)
    return _open(values | values.pop("others"))


def _read_certificate(part: CertificatePart | NoCertificatePart) -> Certificate | None:
    if isinstance(part, NoCertificatePart):
        return None
    values = part.model_dump()
    others = {key: values.pop(key) for key in list(values) if key not in CertificatePart.model_fields}
    values["goal_error"] = tuple(values["goal_error"])
    values["set_end"] = None if values.get("set_end") is None else tuple(values["set_end"])
    if values.get("tube") is not None:
        values["tube"] = tuple(
            TubePart(**{**one, "end": (float(one["end"][0]), float(one["end"][1]))}) for one in values["tube"]
        )
    if values.get("set_bounds") is not None:
        values["set_bounds"] = SetBounds(**values["set_bounds"])
    if values.get("set_worst") is not None:
        worst: dict[str, Any] = {**values["set_worst"]}
        worst["points"] = tuple(tuple(point) for point in worst["points"])
        worst["loads"], worst["face"] = tuple(worst["loads"]), tuple(worst["face"])
        values["set_worst"] = SetWorst(**worst)
    values["warnings"] = tuple(values["warnings"])
    values["cars"] = {
        name: CarCentres(**{key: tuple(pair) for key, pair in car.items()})
        for name, car in values["cars"].items()
    }
    return Certificate(**values, others=others)


def _finite(value: float, key: str) -> float:
    if not math.isfinite(value):
        raise InputError("a document holds finite numbers", key=key, value=value)
    return float(value)


def _open(value: Any) -> Any:
    """Plain values; what is not finite becomes None."""
    value = plain(value)
    if isinstance(value, dict):
        return {key: _open(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_open(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _lines(value: Any, indent: str) -> str:
    """JSON in which mappings, and lists of mappings, have one line per entry and other lists one line in
    all."""
    inner = indent + " "
    if isinstance(value, dict) and value:
        entries = [
            f"{inner}{json.dumps(key, ensure_ascii=False)}: {_lines(item, inner)}"
            for key, item in value.items()
        ]
        return "{\n" + ",\n".join(entries) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(inner + _lines(item, inner) for item in value) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
