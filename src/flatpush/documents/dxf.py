"""Reads what is visible in the model space of a DXF drawing."""

import codecs
import os
import re
from collections.abc import Callable, Iterable
from io import StringIO
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .drawing import FLATNESS, WIDE, Curve, Drawing, LeftOut, Unreadable, extent, flattened
from .reading import read_bytes

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document
    from ezdxf.entities import DXFEntity

_LINES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX")
# What is no line of the object, with the word for it.
_ASIDE = {
    **dict.fromkeys(("TEXT", "MTEXT", "ATTRIB", "ATTDEF", "RTEXT", "ARCALIGNEDTEXT"), "text"),
    **dict.fromkeys(("DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION", "TOLERANCE"), "a dimension"),
    **dict.fromkeys(("SHAPE",), "a symbol"),
    **dict.fromkeys(("LEADER", "MULTILEADER", "MLEADER"), "a leader"),
    **dict.fromkeys(("HATCH", "MPOLYGON", "SOLID", "TRACE"), "a filled area"),
    **dict.fromkeys(("POINT",), "a point"),
    **dict.fromkeys(("XLINE", "RAY"), "an endless construction line"),
    **dict.fromkeys(("IMAGE", "PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "OLE2FRAME", "WIPEOUT"), "a picture"),
    **dict.fromkeys(("ACAD_TABLE", "TABLE"), "a table"),
    **dict.fromkeys(("VIEWPORT", "LIGHT", "SUN", "CAMERA", "SECTION", "GEODATA", "SEQEND"), "no line"),
}  # fmt: skip
# $INSUNITS: metres per unit; 0 says nothing.
_UNITS = {
    1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 0.0254e-6, 9: 0.0254e-3, 10: 0.9144,
    11: 1e-10, 12: 1e-9, 13: 1e-6, 14: 0.1, 15: 10.0, 16: 100.0, 17: 1e9,
    21: 1200 / 3937, 22: 100 / 3937, 23: 3600 / 3937, 24: 1200 / 3937 * 5280,
}  # fmt: skip
# Names of line types and layers of lines that are no edges.
_LINE_TYPES = {
    "a centre line": ("center", "centre", "dashdot", "dash_dot", "chain", "acad_iso04", "acad_iso08", "acad_iso10"),
    "a phantom line": ("phantom", "divide", "border", "acad_iso05", "acad_iso09", "acad_iso12"),
    "a hidden line": ("hidden", "dashed", "dot", "acad_iso02", "acad_iso03", "acad_iso07"),
}  # fmt: skip
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_MOST_NESTED, _MOST_ENTITIES = 8, 200_000
# A variable of the header begins with 9; the same word in a text does not declare anything.
_SET = re.compile(rb"^[ \t]*9[ \t]*\r?\n[ \t]*\$INSUNITS[ \t]*\r?$|\x09\x00?\$INSUNITS\x00", re.M)
_DECLARED = re.compile(rb"\s*70\s*\r?\n\s*(-?[0-9]+)")
_DASH = 49  # group of a line type: length of a dash, negative for a gap
_TILTED = 1e-4  # slope of a plane from which on lengths in it are not what is seen
_FRAME_POINT = 16  # flag of a vertex that only controls the curve of its POLYLINE


def read_dxf(path: str | os.PathLike[str]) -> Drawing:
    """The visible curves of the model space, each with its layer.

    Read are lines, arcs, circles, ellipses, polylines (with bulges), multilines and splines, also inside
    inserted blocks and arrays of them. The unit is that of $INSUNITS, None if the file does not set it.

    Raises:
        InputError: if the file is not such a drawing, or its unit is not known.
        ImportError: if ezdxf is not installed.
    """
    import ezdxf

    source = os.fspath(path)
    hint = "Is it the right file, and is it complete?"
    content = read_bytes(path)
    try:
        marked = next((mark for mark in _MARKS if content.startswith(mark)), b"")
        if marked:  # by which text says how it is encoded; ezdxf does not know it
            text = content[len(marked) :].decode(_MARKS[marked])
            content = text.encode()
            document = ezdxf.read(StringIO("\n".join(text.splitlines()) + "\n"))
        else:
            document = ezdxf.readfile(source)
        if document.dxfversion <= "AC1009" and b"AcDbEntity" in content:
            raise InputError(  # ezdxf then takes all layers for 0
                "the drawing says that it is of R12, or nothing ($ACADVER), and has entities of later versions",
                value=document.dxfversion,
                hint="Save it as DXF R2000 or later, or as R12.",
            )
        unit = _unit(document, content, source)
        reader = _Reader(document)
        reader.visit(document.modelspace(), "0", (), 0)
        if not reader.drawing.curves:
            reader.look_at_paper()
    except OSError:
        # ezdxf raises a plain OSError for a file that is no DXF file.
        raise InputError("the drawing cannot be read (it is not in DXF)", source=source, hint=hint) from None
    except InputError as error:
        raise InputError(error.rule, source=source, value=error.value, hint=error.hint or hint) from None
    except Exception as error:  # a broken file can make it stumble anywhere
        raise InputError(f"this is not a drawing in DXF ({error})", source=source, hint=hint) from error
    reader.drawing.unit = unit
    return reader.drawing


def _unit(document: "Document", content: bytes, source: str) -> float | None:
    declared = _SET.search(content)
    if declared is None:
        return None  # ezdxf then says metres
    match = _DECLARED.match(content, declared.end())
    code = int(match[1]) if match else int(document.header.get("$INSUNITS", 0))
    if code and code not in _UNITS:
        raise InputError(
            "the unit of the drawing is not known ($INSUNITS)",
            source=source,
            value=code,
            hint="Set it to 4 (mm), or to 0 for the unit of the scene.",
        )
    return _UNITS.get(code)


class _Reader:
    def __init__(self, document: "Document") -> None:
        self.document = document
        self.drawing = Drawing()
        self.count = 0
        self.clip = ""  # why the entities of a block are not seen as they are
        self.line_type = "CONTINUOUS"  # of the insert of the block that is read
        self.layers = {layer.dxf.name.casefold(): layer for layer in document.layers}
        self.drawing.known.update(dict.fromkeys(layer.dxf.name for layer in document.layers))

    def visit(
        self, entities: Iterable["DXFEntity"], around: str, blocks: tuple[str, ...], level: int
    ) -> None:
        """Reads entities; around: the layer of the insert that they are in; blocks: the blocks they are in."""
        for entity in entities:
            self.count += 1
            if self.count > _MOST_ENTITIES:
                raise InputError(f"the drawing has at most {_MOST_ENTITIES} entities")
            self.entity(entity, around, blocks, level)

    def entity(self, entity: "DXFEntity", around: str, blocks: tuple[str, ...], level: int) -> None:
        kind = entity.dxftype()
        if not entity.dxf.is_supported("layer"):
            self.drawing.unreadable.append(Unreadable(kind, "this kind of entity is not read"))
            return
        layer = entity.dxf.get("layer", "0")
        if layer == "0" and blocks:
            layer = around
        handle = entity.dxf.handle or getattr(entity.source_of_copy, "dxf", entity.dxf).handle
        place = f"{kind} on layer {layer!r}"
        place += f" in block {blocks[-1]!r}" if blocks else f" (handle {handle})"
        names = (layer, *blocks)
        if reason := self.unseen(entity, layer, frozen_only=kind == "INSERT"):
            self.drawing.left_out.append(LeftOut(place, reason))
            if kind in _LINES and (unseen := _if_readable(entity)) is not None:
                self.drawing.hidden.append(Curve(unseen, place, layer, names, reason))
        elif kind == "INSERT":
            self.insert(entity, layer, blocks, level, place)
        elif kind == "MLINE":
            self.visit(entity.virtual_entities(), layer, blocks, level)
        elif kind in _ASIDE:
            self.drawing.left_out.append(LeftOut(place, _ASIDE[kind]))
        elif kind not in _LINES or (
            kind == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)
        ):
            self.drawing.unreadable.append(Unreadable(place, "this kind of entity is not read", names))
        elif flaw := _flaw(entity):
            self.drawing.unreadable.append(Unreadable(place, flaw, names))
        else:
            points = _points(entity)
            if points is not None:
                aside = self.aside(entity, layer)
                self.drawing.curves.append(Curve(points, place, layer, names, aside, self.clip))
                width = entity.dxf.get("const_width", 0.0) if kind == "LWPOLYLINE" else 0.0
                if width > WIDE * extent(points(np.inf)):
                    told = f"half of the width of its line ({width:.3g} in all), beyond its middle"
                    self.drawing.left_out.append(LeftOut(place, told))

    def unseen(self, entity: "DXFEntity", layer: str, frozen_only: bool) -> str:
        """Why an entity is not visible. An insert on a layer that is off shows what its block has on others."""
        if entity.dxf.get("invisible", 0):
            return "invisible"
        if layer.casefold() == "defpoints":
            return "on Defpoints, which is never plotted"
        state = self.layers.get(layer.casefold())
        if state is not None and state.is_frozen():
            return f"layer {layer!r} is frozen"
        if state is not None and state.is_off() and not frozen_only:
            return f"layer {layer!r} is off"
        return ""

    def insert(
        self, insert: "DXFEntity", layer: str, blocks: tuple[str, ...], level: int, place: str
    ) -> None:
        name = insert.dxf.name
        block = self.document.blocks.get(name)
        if block is None or (block.block is not None and block.block.dxf.get("flags", 0) & 0b1100):
            where = "is not in the file" if block is None else "is in another file"
            self.drawing.unreadable.append(
                Unreadable(place, f"its block {name!r} {where}", (layer, *blocks, name))
            )
            return
        if level >= _MOST_NESTED:
            raise InputError(f"blocks are nested at most {_MOST_NESTED} levels deep", value=name)
        from ezdxf.xclip import XClip

        skipped: list[str] = []
        before, clip = (self.clip, self.line_type), XClip(insert)
        self.line_type = self.type_of(insert, layer)
        if clip.has_clipping_path and clip.is_clipping_enabled:
            self.clip = f"its block {name!r} is clipped (XCLIP)"
        for one in insert.multi_insert() if insert.mcount > 1 else [insert]:
            parts = one.virtual_entities(skipped_entity_callback=lambda e, _: skipped.append(e.dxftype()))
            self.visit(parts, layer, (*blocks, name), level + 1)
        self.clip, self.line_type = before
        for kind in dict.fromkeys(skipped):
            if kind in _ASIDE:
                self.drawing.left_out.append(LeftOut(f"{kind} in block {name!r}", _ASIDE[kind]))
            else:
                self.drawing.unreadable.append(
                    Unreadable(
                        f"{kind} in block {name!r}",
                        "it cannot be placed as the insert asks",
                        (layer, *blocks, name),
                    )
                )

    def aside(self, entity: "DXFEntity", layer: str) -> str:
        """Why a line is no edge, by the type of the line and what becomes of its layer."""
        state = self.layers.get(layer.casefold())
        if state is not None and not state.dxf.get("plot", 1):
            return f"layer {layer!r} is not plotted"
        name = self.type_of(entity, layer)
        for kind, words in _LINE_TYPES.items():
            if name.casefold().startswith(words):
                return f"{kind} (line type {name})"
        known = self.document.linetypes
        pattern = known.get(name).pattern_tags.tags if name in known else ()
        if any(tag.code == _DASH and tag.value < 0 for tag in pattern):
            return f"a line with gaps (line type {name})"  # as MITTE and VERDECKT
        return ""

    def type_of(self, entity: "DXFEntity", layer: str) -> str:
        """The name of the line type of an entity, which may be that of its layer or of the insert of its block."""
        name = str(entity.dxf.get("linetype", "BYLAYER"))
        if name.upper() == "BYBLOCK":
            return self.line_type
        state = self.layers.get(layer.casefold())
        if name.upper() != "BYLAYER":
            return name
        return str(state.dxf.get("linetype", "CONTINUOUS")) if state is not None else "CONTINUOUS"

    def look_at_paper(self) -> None:
        """Tells that the lines are on paper, where the model space has none."""
        for layout in self.document.layouts:
            if not layout.is_modelspace and any(e.dxftype() in _LINES for e in layout):
                self.drawing.left_out.append(
                    LeftOut(
                        f"what is on the sheet {layout.name!r}", "in paper space; only model space is read"
                    )
                )


def _flaw(entity: "DXFEntity") -> str:
    """Why programs differ about what a line is; empty if they do not."""
    kind, get = entity.dxftype(), entity.dxf.get
    if entity.dxf.is_supported("extrusion"):
        x, y, z = get("extrusion", (0.0, 0.0, 1.0))
        level = (
            kind == "LINE" and entity.dxf.start.z == entity.dxf.end.z
        )  # whose ends are not told in that plane
        if np.hypot(x, y) > _TILTED * abs(z) and not level:
            return "it lies in a tilted plane, and is seen foreshortened"
    if kind in ("ARC", "ELLIPSE"):
        first, last = ("start_angle", "end_angle") if kind == "ARC" else ("start_param", "end_param")
        if get(first, 0.0) == get(last, 2 * np.pi):
            return "it begins and ends at the same angle, which is nothing to some programs and a full turn to others"
    return ""


def _points(entity: "DXFEntity") -> Callable[[float], Array] | None:
    """What gives the polygon of an entity; None for one without length."""
    from ezdxf import path as paths

    if entity.dxftype() == "POLYLINE":
        entity.vertices[:] = [v for v in entity.vertices if not v.dxf.flags & _FRAME_POINT]
        if not len(entity.vertices):
            return None
    if entity.dxftype() == "SPLINE" and (spline := _spline(entity)) is not None:
        return spline
    path = paths.make_path(entity)
    if not len(path):
        return None
    if not path.has_curves:
        corners = np.array([(p.x, p.y) for p in path.control_vertices()])
        return lambda tolerance: corners
    box = paths.bbox([path], fast=True)
    size = max(box.size.x, box.size.y)

    def points(tolerance: float) -> Array:
        distance = tolerance if np.isfinite(tolerance) else 0.1 * size
        return np.array([(p.x, p.y) for p in path.flattening(max(distance, FLATNESS**2 * size), segments=4)])

    return points


def _if_readable(entity: "DXFEntity") -> Callable[[float], Array] | None:
    """The same for what is not seen: it need not be readable."""
    try:
        return _points(entity)
    except Exception:  # a broken file can make ezdxf stumble anywhere
        return None


def _spline(spline: "DXFEntity") -> Callable[[float], Array] | None:
    """The polygon of a B-spline with as many knots as it should have; None for others, as those through fit points.

    Its curve lies between the knots of numbers p and n (degree p, n control points); ezdxf draws one whose knots go on
    over all of them, and puts cubic curves, which swing at corners, in the place of other degrees.
    """
    knots, degree = np.array(spline.knots), int(spline.dxf.degree)
    controls, count = np.array(spline.control_points), len(spline.control_points)
    if not count or len(knots) != count + degree + 1:
        return None
    first, last = float(knots[degree]), float(knots[count])
    if last <= first or np.any(np.diff(knots) < 0):
        return None
    from scipy.interpolate import BSpline

    weights = np.array(spline.weights) if len(spline.weights) == count else np.ones(count)
    curve = BSpline(knots, np.column_stack([controls[:, :2] * weights[:, None], weights]), degree)

    def at(t: Array) -> Array:
        x, y, w = curve(t).T
        return np.column_stack([x / w, y / w])

    inside = np.unique(np.clip(knots, first, last))  # between which it is smooth
    size = extent(controls[:, :2])

    def points(tolerance: float) -> Array:
        distance = tolerance if np.isfinite(tolerance) else 0.1 * size
        parts = [
            flattened(lambda t, a=a, b=b: at(a + t * (b - a)), distance)  # type: ignore[misc]
            for a, b in pairwise(inside.tolist())
        ]
        return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])

    return points
