"""Moves the frame of an object that is drawn far from its origin into the object."""

from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..geometry import Outline, transform
from ..geometry.pose import Array
from .scene import Object, Scene

# An origin further from the object than so many of its sizes is moved. A plan's samples are poses of the origin: the
# further it is, the denser they must be, and the more digits are lost.
FAR_SIZES = 100.0


def far_origin(outline: Outline) -> Array | None:
    """Where the frame O moves to, shape (2,) in O [m]: the outline's centroid; None if its origin is not far."""
    centroid = outline.centroid
    return centroid if np.hypot(*centroid) > FAR_SIZES * outline.size else None


def moved_inside(scene: Scene) -> Scene:
    """The same scene with the origin of O in the object, if it was more than 100 sizes away; else the scene itself.

    Start and goal are then poses of the outline's centroid, with the axes of the drawing.

    Raises:
        InputError: if the goal leaves the angle open, or a start region has one: the object would turn about an origin
            far away.
    """
    origin = far_origin(scene.object.outline)
    if origin is None:
        return scene
    if scene.free_angle:
        raise InputError(
            f"a goal with a free angle is a place of the drawing's origin, and that is {np.hypot(*origin):.4g} m from"
            " the object",
            key="goal",
            hint="Draw the outline about its origin, or read its file with origin: centroid.",
        )
    obj = scene.object
    if obj.uncertainty is not None and obj.uncertainty.start is not None and obj.uncertainty.start.angle > 0:
        raise InputError(
            f"a start region is turned about the drawing's origin, and that is {np.hypot(*origin):.4g} m from the"
            " object",
            key="object.uncertainty.start",
            hint="Draw the outline about its origin, or read its file with origin: centroid.",
        )
    support = obj.support_word or obj.support.translated(-origin)
    moved = Object(
        obj.outline.translated(-origin), support, obj.friction, obj.surface, obj.name, obj.uncertainty
    )

    def pose(X_WO: Array) -> Array:
        return np.array([*transform(X_WO, origin), X_WO[2]])

    pushes = scene.pushes
    if not isinstance(pushes, str):
        pushes = tuple(replace(push, at=replace(push.at, point=push.at.point - origin)) for push in pushes)
    return replace(
        scene, object=moved, start=pose(scene.start_pose), goal=pose(scene.goal_pose), pushes=pushes
    )
