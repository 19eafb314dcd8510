"""Reads and writes a calibrated camera, in SI and pixels."""

import json
import os
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..geometry.table_camera import TableCamera
from .atomic import write_atomically
from .reading import read_mapping
from .refusals import checked
from .scene_model import Finite, Matrix, NotNegative, Part, Point, Row


def save_camera(camera: TableCamera, rms: float, path: str | os.PathLike[str]) -> None:
    """Writes a camera as JSON, {"flatpush": "camera/1", ...}; rms: of the calibration [px]."""
    document = {
        "flatpush": "camera/1",
        "size": list(camera.size),
        "focal": camera.focal.tolist(),
        "centre": camera.centre.tolist(),
        "distortion": camera.distortion.tolist(),
        "rotation": camera.rotation.tolist(),
        "translation": camera.translation.tolist(),
        "rms": rms,
    }
    write_atomically(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def load_camera(path: str | os.PathLike[str]) -> TableCamera:
    """The camera in a file that save_camera wrote.

    Raises:
        InputError: if the file is not such a document, or no camera is like that.
    """
    form = checked(_Camera, read_mapping(path), os.fspath(path))
    try:
        return TableCamera(
            (form.size[0], form.size[1]),
            np.array(form.focal),
            np.array(form.centre),
            np.array(form.distortion),
            np.array(form.rotation),
            np.array(form.translation),
        )
    except InputError as error:
        raise InputError(
            error.rule, source=os.fspath(path), key=error.key, value=error.value, hint=error.hint
        ) from None


class _Camera(Part):
    flatpush: Literal["camera/1"] = Field(description="The version of this document: camera/1.")
    size: Annotated[list[Annotated[int, Field(ge=1, le=100_000)]], Field(min_length=2, max_length=2)] = Field(
        description="Width and height of its pictures, pixels."
    )
    focal: Point = Field(description="Focal lengths, pixels.")
    centre: Point = Field(description="Principal point, pixels.")
    distortion: Annotated[list[Finite], Field(min_length=5, max_length=5)] = Field(
        description="Coefficients of the lens: k1, k2, p1, p2, k3."
    )
    rotation: Matrix = Field(description="Of the table frame in the camera's.")
    translation: Row = Field(description="Of the table frame's origin in the camera's, m.")
    rms: NotNegative = Field(description="How far the calibration's points are from their places, pixels.")
