"""The usable pushes of a scene as the arrays that the search works on, with what it costs to change between them."""

from collections.abc import Sequence

import numpy as np

from ..errors import FlatpushError
from ..geometry.pose import Array
from ..problem import Scene
from ..steering.fleet import Fleet
from ..steering.time_law import Trapezoid
from .assembly import car_of
from .options import PushOption
from .segments import fingertips, tip_radii
from .transits import Transits


def fleet_of(scene: Scene, options: Sequence[PushOption], transits: Transits) -> Fleet:
    """The cars of pushes under the scene's cost; where transits count, they are part of the switching costs."""
    cars = [car_of(option) for option in options]
    switching = _switching(scene, options, transits)
    if scene.planning.cost != "time":
        return Fleet.of(
            cars, np.array([car.weights(scene.planning.cost) for car in cars]), switching=switching
        )
    pusher = scene.pusher
    radii = np.array([tip_radii(car_of(o), fingertips(o.push.fingers, o.push.spacing)) for o in options])
    limits = pusher.speed, pusher.acceleration, pusher.turn_rate
    laws = [[Trapezoid.along(1.0, float(r), *limits) for r in row] for row in radii]
    return Fleet.of(
        cars,
        np.where(np.isinf(radii), 1.0, radii),
        np.array([[law.speed for law in row] for row in laws]),
        np.array([[law.acceleration for law in row] for row in laws]),
        switching,
    )


def _switching(scene: Scene, options: Sequence[PushOption], transits: Transits) -> Array:
    """Costs of changing from each push to each other; infinite where the pusher has no way."""
    k, planning = len(options), scene.planning
    found = np.zeros((k, k))
    for i, a in enumerate(options):
        for j, b in enumerate(options):
            if i == j or a.placement is None or b.placement is None:
                continue
            try:
                way = transits.between(a.placement, b.placement)
            except FlatpushError:
                found[i, j] = np.inf
                continue
            own = {"flat": 0.0, "pusher": way.pusher_length, "time": way.duration(scene.pusher)}[
                planning.cost
            ]
            found[i, j] = planning.switching + own
    return found
