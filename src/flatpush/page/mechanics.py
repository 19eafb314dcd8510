"""The mechanics of one push, as [Zhou2017] Figs. 1 and 2 and `flatpush describe --figure` show them."""

from collections.abc import Mapping

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from ..planning import PushDescription
from ..planning.options import push_option
from ..problem import Scene
from ..view import palette, words
from ..view.push_figure import REGION, caption
from ..view.sketches import sketches
from ..view.table import MM


def mechanics(scene: Scene, name: str) -> dict[str, object]:
    """Cones, turning centres and, of two fingers with their composite cone, the regions of their stable centres.

    Args:
        scene: with its pushes listed.
        name: of the push.

    Returns:
        plain values in the object's frame O [mm]; directions are unit vectors.

    Raises:
        InputError: for a push that the scene does not have, or whose fingers do not fit.
    """
    push = next((push for push in scene.pushes if not isinstance(push, str) and push.name == name), None)
    if push is None:
        raise InputError("the scene has no push of this name", key="push", value=name)
    described = PushDescription(push, push_option(scene, push, margin=0.0), {}, float("nan"))
    found = sketches(scene, [described])
    if not found:
        raise InputError(described.option.refusal, key=name)
    sketch = found[0]
    size, areas = REGION * scene.object.outline.size, list[Mapping[str, object]]()
    for sign, colour in ((1, palette.COUNTER_CLOCKWISE), (-1, palette.CLOCKWISE)):
        for region, opacity in ((sketch.region, 0.16), (sketch.any_pressure, 0.3)):
            if region is not None:
                corners = region.polygon(sign, (-size, -size, size, size))
                if len(corners) > 2:
                    areas.append({"corners": _mm(corners + sketch.cof), "colour": colour, "opacity": opacity})
    centres = [
        {"at": _mm(centre), "sign": sign}
        for centre, sign in ((sketch.left_centre, 1), (sketch.right_centre, -1))
        if np.all(np.isfinite(centre))
    ]
    return {
        "kind": "mechanics",
        "push": name,
        "caption": caption(sketch) if sketch.steers else sketch.refusal,
        "contact": _mm(sketch.contact),
        "cones": [
            _cone(words.FRICTION_CONE, palette.FORCE, sketch.force_left, sketch.force_right),
            _cone(words.MOTION_CONE, palette.MOTION, sketch.motion_left, sketch.motion_right),
        ],
        "centres": centres,
        "flat": _mm(sketch.flat_point) if sketch.steers else None,
        "areas": areas,
    }


def _mm(values: Array) -> list[object]:
    return (MM * np.asarray(values, dtype=float)).round(3).tolist()


def _cone(name: str, colour: str, *edges: Array) -> dict[str, object]:
    units = [(np.asarray(v) / np.hypot(*v)).round(5).tolist() for v in edges]
    return {"name": name, "colour": colour, "edges": units}
