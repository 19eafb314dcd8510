"""Reads and writes limit surfaces about the centre of friction: in a scene, and as a document of their own, in SI."""

import json
import os
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..friction.surface import LimitSurface
from .atomic import write_atomically
from .reading import read_mapping
from .refusals import checked
from .scene_model import Coefficients, EllipsoidPart, Matrix, Part, QuarticPart, SurfaceFilePart


def save_surface(surface: LimitSurface, path: str | os.PathLike[str]) -> None:
    """Writes an Ellipsoid or a Quartic as {"flatpush": "surface/1", "ellipsoid": ...} or {..., "quartic":
    ...}."""
    document = {"flatpush": "surface/1", **surface_form(surface)}
    write_atomically(path, json.dumps(document, allow_nan=False) + "\n")


def load_surface(path: str | os.PathLike[str]) -> LimitSurface:
    """The limit surface in a file that save_surface wrote.

    Raises:
        InputError: if the file is not such a document, or the surface is not one.
    """
    source = os.fspath(path)
    document = read_mapping(path)
    form = checked(_Surface, document, source)
    given = [name for name in ("ellipsoid", "quartic") if getattr(form, name) is not None]
    if len(given) != 1:
        hint = "Write ellipsoid: 3 × 3 numbers or quartic: 15 numbers."
        raise InputError("a surface is either an ellipsoid or a quartic", source=source, hint=hint)
    part = (
        EllipsoidPart(ellipsoid=form.ellipsoid) if form.ellipsoid else QuarticPart(quartic=form.quartic or [])
    )
    try:
        return read_surface(part, Path())
    except InputError as error:
        raise InputError(
            error.rule, source=source, key=given[0], value=document[given[0]], hint=error.hint
        ) from None


def read_surface(form: SurfaceFilePart | EllipsoidPart | QuarticPart, folder: Path) -> LimitSurface:
    """The limit surface of a parsed form."""
    if isinstance(form, SurfaceFilePart):
        return load_surface(folder / form.file)
    if isinstance(form, EllipsoidPart):
        from ..friction.ellipsoid import Ellipsoid

        return Ellipsoid(np.array(form.ellipsoid))
    from ..friction.quartic import Quartic

    return Quartic(np.array(form.quartic))


def surface_form(surface: LimitSurface) -> dict[str, list[object]]:
    """What a document says of a limit surface, in SI."""
    for name, attribute in (("ellipsoid", "matrix"), ("quartic", "coefficients")):
        values = getattr(surface, attribute, None)
        if values is not None:
            return {name: np.asarray(values, dtype=float).tolist()}
    raise InputError(
        "a document holds an ellipsoid or a quartic as limit surface",
        key="object.surface",
        value=type(surface).__name__,
        hint="Give an exact surface by its support.",
    )


class _Surface(Part):
    flatpush: Literal["surface/1"] = Field(description="The version of this document: surface/1.")
    ellipsoid: Matrix | None = Field(
        default=None, description="The symmetric positive-definite matrix A, 3 × 3 numbers."
    )
    quartic: Coefficients | None = Field(
        default=None, description="15 coefficients, in the order of the scene document."
    )
