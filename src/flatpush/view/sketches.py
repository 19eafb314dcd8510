"""From the descriptions of a scene's pushes to what a sketch shows."""

from collections.abc import Sequence

import numpy as np

from ..contact import Placement, StableCentres, StableRegion, stable_region
from ..friction import Ellipsoid
from ..geometry import rotate
from ..geometry.pose import Array
from ..planning import PushDescription
from ..problem import Scene
from ..problem.mechanics import contacts_of, slider_of, surface_at, virtual_contact
from ..steering.car import Car
from .push_sketch import PushSketch

CENTRES = 121


def sketches(scene: Scene, described: Sequence[PushDescription]) -> tuple[PushSketch, ...]:
    """A sketch of each push whose fingers fit."""
    return tuple(_sketch(scene, push) for push in described if push.option.placement is not None)


def _sketch(scene: Scene, described: PushDescription) -> PushSketch:
    option, cof = described.option, scene.object.cof
    placement = option.placement
    assert placement is not None
    contact = virtual_contact(scene, placement)
    surface = surface_at(scene, contact)
    motion, force = contact.motion_cone(surface), contact.force_edges()
    nothing = np.full(2, np.nan)
    car = option.car
    two = car is not None and car.cone is not None
    drive, drive_centre = (nothing, nothing) if car is None else _drive(car, placement.points.mean(axis=0))
    return PushSketch(
        name=option.push.name,
        contact_points=placement.points,
        normal=contact.normal,
        fingertips=placement.tips,
        tip_radius=scene.pusher.tip_radius,
        friction=contact.friction,
        cof=cof,
        force_left=force.left,
        force_right=force.right,
        motion_left=motion.left,
        motion_right=motion.right,
        left_centre=nothing if car is None else car.left_centre,
        right_centre=nothing if car is None else car.right_centre,
        flat_point=nothing if car is None else car.flat_point,
        straight=nothing if car is None else car.direction,
        refusal=option.refusal,
        centres=np.empty((0, 2)) if car is None or two or isinstance(surface, Ellipsoid) else _centres(car),
        region=StableCentres.of(car.cone, surface) if car is not None and car.cone is not None else None,
        any_pressure=_any_pressure(scene, placement) if two else None,
        drive=drive,
        drive_centre=drive_centre,
    )


def _drive(car: Car, contact: Array) -> tuple[Array, Array]:
    """Velocity of a contact point (in O) and rotation centre, of a left turn half as tight as the tightest."""
    vx, vy, w = car.twist(0.5 / car.radius)
    return np.array([vx - w * contact[1], vy + w * contact[0]]), np.array([-vy, vx]) / w


def _any_pressure(scene: Scene, placement: Placement) -> StableRegion:
    slider = slider_of(scene.object)
    return stable_region(contacts_of(scene, placement), slider, float(np.max(np.linalg.norm(slider, axis=1))))


def _centres(car: Car) -> Array:
    """The curve of rotation centres for forces from the left edge of the cone to the right one; far ones left out."""
    left, _, right = car.contact.force_angles(car.forces)
    found = []
    for angle in np.linspace(left, right, CENTRES):
        V = car.surface.twist(car.contact.wrench(rotate(angle, car.contact.normal)))
        if abs(V[2]) > 1e-3 * np.hypot(V[0], V[1]):
            found.append(np.array([-V[1], V[0]]) / V[2] + car.cof)
    return np.array(found)
