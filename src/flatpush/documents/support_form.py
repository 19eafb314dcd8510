"""Reads and writes what a document says of an object's support."""

from weakref import WeakKeyDictionary

import numpy as np

from ..errors import InputError
from ..friction.pressure import Edges, Feet, Round
from ..friction.support import Support
from ..geometry import Outline
from ..problem import Object
from . import scene_model as m

# The form, in SI, in which a support was read. A support keeps its points about their centre, from which
# those that were written come back only to rounding; with this, a scene that is written and read again stays
# the same exactly.
_WRITTEN: "WeakKeyDictionary[Support, dict[str, object]]" = WeakKeyDictionary()

Form = str | m.DiscPart | m.RingPart | m.FeetPart | m.PadPart | m.RimPart


def read_support(form: Form, outline: Outline, per_metre: float) -> Support | str:
    """The support of a parsed form; its two words stay words, which Object understands."""
    if isinstance(form, str):
        return form
    if isinstance(form, m.DiscPart):
        return Support.disc(form.disc / per_metre, np.array(form.centre) / per_metre)
    if isinstance(form, m.RingPart):
        return Support.ring(form.ring / per_metre, np.array(form.centre) / per_metre)
    if isinstance(form, m.FeetPart):
        table = np.array(form.points)
        table[:, :2] /= per_metre
        support = Support.points(table[:, :2], table[:, 2])
        _WRITTEN[support] = {"points": table.tolist()}
        return support
    if isinstance(form, m.PadPart):
        corners = np.array(form.polygon, dtype=float) / per_metre
        support = Support.polygon(corners)
        _WRITTEN[support] = {"polygon": corners.tolist()}
        return support
    corners = np.array(form.outline, dtype=float) / per_metre
    support = Support.outline(corners)
    _WRITTEN[support] = {"outline": corners.tolist()}
    return support


def support_form(obj: Object) -> str | dict[str, object]:
    """What a scene document says of the support, in SI."""
    if obj.support_word:
        return obj.support_word
    support = obj.support
    if support in _WRITTEN:
        return _WRITTEN[support]
    pressure, centre = support.pressure, support.centre
    if isinstance(pressure, Feet):
        places, weights = support.feet
        return {"points": np.column_stack([places, weights]).tolist()}
    if isinstance(pressure, Round):
        form: dict[str, object] = {"disc" if pressure.filled else "ring": float(pressure.radius)}
        return form | ({"centre": centre.tolist()} if np.any(centre) else {})
    if isinstance(pressure, Edges):
        corners = pressure.vertices + centre
        if corners.shape == obj.outline.vertices.shape and np.allclose(
            corners, obj.outline.vertices, rtol=0, atol=1e-12 * obj.outline.size
        ):
            return "uniform" if pressure.filled else "outline"
        return {"polygon" if pressure.filled else "outline": corners.tolist()}
    raise InputError("a scene document cannot hold this support", key="object.support", value=support)
