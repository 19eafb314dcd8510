"""Reads and writes what runs told of a robot and its camera, in SI."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..geometry.pose import Array
from .atomic import write_atomically
from .reading import read_mapping
from .refusals import checked
from .scene_model import Finite, NotNegative, Part, Point, Pose, Row


@dataclass(frozen=True, eq=False)
class CalibrationFile:
    """A calibration as it is kept.

    Attributes:
        camera: matrix minus identity, row by row, and shift [m], shape (6,). pivot: of the camera's map (2,) [m].
        tags: pose of the outline's frame in the frame that the camera reports, by tag, (3,).
        carried: which tag an object carries; others carry one of their own name.
        inset: so much less than the tip radius the fingers keep from the outline [m].
        friction: between finger and object. lag: of the camera [s].
        judged: mean and worst distance [m], mean and worst angle [rad] of runs from starts that were left out, (4,);
            empty if there was one start only.
        runs: how many were used.
    """

    camera: Array
    pivot: Array
    tags: Mapping[str, Array]
    carried: Mapping[str, str]
    inset: float
    friction: float
    lag: float
    judged: Array
    runs: int


def save_calibration(kept: CalibrationFile, path: str | os.PathLike[str]) -> None:
    """Writes it as JSON, {"flatpush": "calibration/1", ...}."""
    document = {
        "flatpush": "calibration/1",
        "camera": _rows(kept.camera).tolist(),
        "pivot": kept.pivot.tolist(),
        "tags": {name: np.asarray(pose).tolist() for name, pose in kept.tags.items()},
        "carried": dict(kept.carried),
        "inset": kept.inset,
        "friction": kept.friction,
        "lag": kept.lag,
        "judged": kept.judged.tolist(),
        "runs": kept.runs,
    }
    write_atomically(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def load_calibration(path: str | os.PathLike[str]) -> CalibrationFile:
    """The calibration in a file that save_calibration wrote.

    Raises:
        InputError: if the file is not such a document.
    """
    form = checked(_Calibration, read_mapping(path), os.fspath(path))
    rows = np.array(form.camera)
    return CalibrationFile(
        camera=np.concatenate([(rows[:, :2] - np.eye(2)).ravel(), rows[:, 2]]),
        pivot=np.array(form.pivot),
        tags={name: np.array(pose) for name, pose in form.tags.items()},
        carried=dict(form.carried),
        inset=form.inset,
        friction=form.friction,
        lag=form.lag,
        judged=np.array(form.judged),
        runs=form.runs,
    )


def _rows(camera: Array) -> Array:
    """The affine map, shape (2, 3)."""
    return np.column_stack([np.eye(2) + np.reshape(camera[:4], (2, 2)), camera[4:]])


class _Calibration(Part):
    flatpush: Literal["calibration/1"] = Field(description="The version of this document: calibration/1.")
    camera: Annotated[list[Row], Field(min_length=2, max_length=2)] = Field(
        description="The affine map from the camera's table frame to the robot's about the pivot, 2 × 3 numbers."
    )
    pivot: Point = Field(description="The point about which the map is written, [x, y] in m.")
    tags: dict[str, Pose] = Field(
        description="Of each tag: pose of the drawing in the tag's frame, m and rad."
    )
    carried: dict[str, str] = Field(description="Of objects: the tag that each carries.")
    inset: Finite = Field(description="How much nearer than the tip radius the fingers come, m.")
    friction: NotNegative = Field(description="The coefficient between finger and object.")
    lag: Finite = Field(description="How much later the camera's poses come, s.")
    judged: list[NotNegative] = Field(
        description="Mean and worst distance, mean and worst angle of starts left out."
    )
    runs: Annotated[int, Field(ge=0)] = Field(description="How many runs were used.")
