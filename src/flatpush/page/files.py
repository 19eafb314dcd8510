"""What is dropped on the page, and what is saved from it."""

import base64
import binascii
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from ..documents import parse_plan, parse_scene, read_mapping
from ..documents.plan_file import as_text, plan_document
from ..documents.shapes import Choice, load_drawing
from ..errors import InputError
from ..problem import Plan
from .in_mm import refuse_files, scene_in_mm
from .recorded import LOGS, recorded
from .values import scene_of

DRAWINGS, BITMAPS, DOCUMENTS = (".svg", ".dxf"), (".png",), (".yaml", ".yml", ".json")
Dropped = tuple[dict[str, object], Plan | None]
UNIT = 1e-3  # of a drawing that does not say its own [m]
PIXEL = 0.4e-3  # side of a pixel of a bitmap unless the page says otherwise [m]


def read_dropped(value: Mapping[str, object]) -> Dropped:
    """A dropped file {name, data (base64), pixel [mm], scene}: a whole scene, the outline of an object about its
    centroid in mm, or the recorded runs of a log of the object of the scene; and the plan if it is one.

    Raises:
        InputError: for what is none of these.
    """
    name, data, pixel = value.get("name"), value.get("data"), value.get("pixel", 1e3 * PIXEL)
    if not isinstance(name, str) or not isinstance(data, str):
        raise InputError("a dropped file has a name and data")
    if isinstance(pixel, bool) or not isinstance(pixel, int | float) or not 0 < pixel <= 1000:
        raise InputError("the side of a pixel is a length in mm", key="pixel", value=pixel)
    kind = Path(name).suffix.lower()
    if kind not in (*DRAWINGS, *BITMAPS, *DOCUMENTS, *LOGS):
        raise InputError(
            "this is no kind of file that the page reads",
            value=name,
            hint="Drop a scene or a plan (.yaml, .json), a drawing (.svg, .dxf, .png) or a log (.csv, .mcap).",
        )
    try:
        content = base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError):
        raise InputError("the data of a dropped file are base64", key="data") from None
    with TemporaryDirectory(prefix="flatpush-") as folder:
        path = Path(folder, f"dropped{kind}")
        path.write_bytes(content)
        try:
            if kind in LOGS:
                scene = scene_of(value)
                refuse_files(scene)
                return {"kind": "file", "name": name, "runs": recorded(path, parse_scene(scene))}, None
            found, plan = _read(path, kind, 1e-3 * float(pixel))
            return {"kind": "file", "name": name, **found}, plan
        except InputError as error:
            raise InputError(
                error.rule.replace(str(path), name),
                source=name,
                key=error.key,
                value=error.value,
                hint=error.hint,
            ) from None


def _read(path: Path, kind: str, pixel: float) -> Dropped:
    if kind in DOCUMENTS:
        document = read_mapping(path)
        refuse_files(document)
        version = document.get("flatpush")
        plan = parse_plan(document) if isinstance(version, str) and version.startswith("plan/") else None
        return {"scene": scene_in_mm(parse_scene(document) if plan is None else plan.scene)}, plan
    choice = Choice(origin="centroid", pixel=pixel if kind in BITMAPS else 0.0)
    drawn = load_drawing(path, UNIT, choice)
    corners = [[round(1e3 * x, 4), round(1e3 * y, 4)] for x, y in drawn.outline.vertices.tolist()]
    return {"outline": corners, "taken": drawn.taken, "left_out": len(drawn.left_out)}, None


def saved(value: Mapping[str, object], plan: Plan | None) -> dict[str, object]:
    """A file to save, {what: scene, plan or figure, scene}: its name and its text.

    Raises:
        InputError: for a scene that is none, and where there is no plan.
    """
    what = value.get("what")
    if what not in ("scene", "plan", "figure"):
        raise InputError("a scene, a plan or a figure is saved", key="what", value=what)
    if what == "scene":
        scene = scene_of(value)
        refuse_files(scene)
        parse_scene(scene)
        return {"kind": "saved", "name": f"{_stem(scene)}.yaml", "text": _yaml(scene)}
    if plan is None:
        raise InputError("there is no plan to save")
    name = "".join(c if c.isalnum() or c in "-_" else "-" for c in plan.scene.object.name) or "plan"
    if what == "plan":
        return {"kind": "saved", "name": f"{name}.json", "text": as_text(plan_document(plan))}
    from ..view import save_figure

    with TemporaryDirectory(prefix="flatpush-") as folder:
        path = Path(folder, "figure.svg")
        save_figure(plan, path)
        return {"kind": "saved", "name": f"{name}.svg", "text": path.read_text(encoding="utf-8")}


def _stem(scene: Mapping[str, object]) -> str:
    thing = scene.get("object")
    name = thing.get("name") if isinstance(thing, dict) else None
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in str(name or "scene"))


def _yaml(scene: Mapping[str, object]) -> str:
    import yaml

    return yaml.safe_dump(
        dict(scene), sort_keys=False, default_flow_style=None, allow_unicode=True, width=110
    )
