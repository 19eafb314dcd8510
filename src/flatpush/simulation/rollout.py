"""Quasi-static motion of the object under the planned motion of the pusher."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arguments import made_of
from ..friction.surface import LimitSurface
from ..geometry import inverse, transform
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, Rollout, Scene
from ..problem.mechanics import named, placement_of, surface_of
from ..problem.scene import Model
from .corners import passed_a_corner
from .noise import Disturbances, Noise
from .pieces import Source
from .plant import MODES, OUTCOMES, Plant
from .plant.codes import REST, SEPARATION, STICKING
from .stretches import Stretch, stretches


def simulate(
    plan: Plan,
    seed: int = 0,
    *,
    model: Model = "exact",
    source: Source = "arcs",
    perturbation: Noise | None = None,
) -> Rollout:
    """Rolls a plan out: the fingers move as planned, the object as contact and table let it.

    Each finger sticks, slides left or right, separates, touches again, rolls with its round tip and goes round corners
    (simulation.plant). Where it lands on the object, the object is moved aside first.

    Args:
        seed: number that is drawn from.
        model: limit surface under which the object moves; "exact" is the support's own, or the known one.
        perturbation: what is drawn; without one the run is the nominal one.
        source: the pusher's way: the plan's "arcs" exactly, or straight between its "samples".

    Raises:
        InputError: for what is no Plan, for a plan without a solution, or with a push without motion.
    """
    made_of(Plan, plan, "load_plan")
    plan.check_motion()
    scene = plan.scene
    if perturbation is not None:
        disturbances = Disturbances(scene, perturbation, model)
        scene, model = disturbances.draw(np.random.default_rng(seed)), disturbances.model_of()
    rolled = roll(plan, [scene], model, source)
    n = int(np.count_nonzero(np.isfinite(rolled.object[0, :, 0])))
    return Rollout(
        rolled.final[0],
        rolled.times[:n],
        rolled.object[0, :n],
        rolled.pusher[:n],
        tuple(MODES[code] for code in rolled.modes[0, :n]),
        rolled.outcomes[0],
        None if perturbation is None else seed,
    )


@dataclass(frozen=True, eq=False)
class Rolled:
    """Many runs of one plan; n runs, m samples of the plan.

    Attributes:
        final: X_WO at the end, shape (n, 3).
        outcomes: n words, as of a Rollout.
        sticking: whether every finger stuck from its first touch in each push to the push's end, shape (n,); slides do
            not count.
        times, pusher: of the samples, shapes (m,) and (m, 3).
        object: X_WO at the samples, shape (n, m, 3); nan after the end of a run.
        modes: codes of plant.MODES, shape (n, m). Of two fingers: sticking where both stick, separation where one is
            off the object, else how one slides.
    """

    final: Array
    outcomes: tuple[str, ...]
    sticking: Any
    times: Array
    pusher: Array
    object: Array
    modes: Any


def roll(plan: Plan, scenes: Sequence[Scene], model: Model, source: Source) -> Rolled:
    """Every scene holds a start and an object of its own, of one outline; the pusher moves as planned.

    Args:
        model, source: as of simulate.
    """
    way = stretches(plan, source)
    n = len(scenes)
    q = np.array([scene.start_pose for scene in scenes])
    going, outcomes = np.ones(n, dtype=bool), np.full(n, "completed", dtype=object)
    sticking = np.ones(n, dtype=bool)
    objects, modes = [q[:, None].copy()], [np.zeros((n, 1), dtype=int)]
    times, hands = [np.zeros(1)], [way[0].hand[:1] if way else q[:1]]
    for stretch in way:
        poses = np.full((n, len(stretch.hand), 3), np.nan)
        seen = np.zeros((n, len(stretch.hand)), dtype=int)
        here = np.flatnonzero(going)
        if stretch.lifted:
            poses[here] = q[here, None]
        elif len(here):
            runs = _push(plan, [scenes[int(i)] for i in here], stretch, q[here], model)
            touching = (runs.modes != SEPARATION) & (runs.modes != REST)
            poses[here], seen[here] = runs.object, _together(runs.modes)
            q[here] = runs.final
            for code in np.unique(runs.outcome[runs.outcome > 0]):
                stopped = here[runs.outcome == code]
                outcomes[stopped], going[stopped], sticking[stopped] = OUTCOMES[code], False, False
            if stretch.push is not None and isinstance(plan.on_table[stretch.push], PushSegment):
                touched = np.logical_or.accumulate(touching, axis=1)
                sticking[here] &= np.all(~touched | (runs.modes == STICKING), axis=(1, 2))
                lost = here[~np.any(touching[:, -1], axis=1) & (runs.outcome == 0)]
                outcomes[lost], going[lost], sticking[lost] = "lost contact", False, False
                corner = here[passed_a_corner(plan.scene.object.outline, runs.points, touching)]
                outcomes[corner] = np.where(
                    outcomes[corner] == "completed", "passed a corner", outcomes[corner]
                )
        objects.append(poses[:, 1:])
        modes.append(seen[:, 1:])
        times.append(stretch.times[1:])
        hands.append(stretch.hand[1:])
    return Rolled(
        q,
        tuple(outcomes),
        sticking,
        np.concatenate(times),
        np.concatenate(hands),
        np.concatenate(objects, axis=1),
        np.concatenate(modes, axis=1),
    )


def _push(plan: Plan, scenes: Sequence[Scene], stretch: Stretch, q: Array, model: Model) -> Any:
    """The runs of one stretch on the table."""
    segment = plan.on_table[stretch.fingers]
    if isinstance(segment, PushSegment):
        contact = placement_of(plan.scene, named(plan.scene, segment.push)).virtual_point
    else:
        tip = transform(inverse(segment.object[0]), segment.pusher[0, :2])
        contact = plan.scene.object.outline.nearest(tip).point
    surfaces = [_surface(scene, contact, model) for scene in scenes]
    thing = scenes[0].object
    plant = Plant(thing, segment.fingers, plan.scene.pusher.tip_radius, surface=surfaces[0])
    same = all(surface is surfaces[0] for surface in surfaces)
    return plant.many(
        q,
        stretch.hand,
        friction=[scene.object.friction for scene in scenes],
        surfaces=None if same else surfaces,
        cofs=np.array([scene.object.cof for scene in scenes]),
        body=stretch.body,
        record=True,
    )


def _surface(scene: Scene, contact: Array, model: Model) -> LimitSurface:
    p = scene.object.cof - contact
    return surface_of(scene.object, model, p / np.hypot(*p))


def _together(modes: Any) -> Any:
    """One mode for all fingers, codes (..., k) to (...)."""
    least, most = modes.min(axis=-1), modes.max(axis=-1)
    return np.where(least == REST, most, np.where(most == SEPARATION, SEPARATION, most))
