"""Closed-loop runs compiled from laws.rollout, many at a time."""

from ...compiled import inner, kernel
from ...geometry.pose import Array
from . import formula_kernels as laws
from . import rollout as one

contact_twist = inner(one.contact_twist)
_names = {
    name: getattr(laws, name)
    for name in ("along_path", "linearised", "nearest", "place", "point_velocity", "wrapped")
}
rollout = inner(laws.calling(one.rollout, {**_names, "contact_twist": contact_twist}))


@kernel()
def many(
    first: int,
    last: int,
    law: int,
    hold: int,
    table: Array,
    speed: float,
    model: Array,
    gains: Array,
    rate: float,
    ticks: int,
    starts: Array,
    surfaces: Array,
    cofs: Array,
    mus: Array,
    half: float,
    noises: Array,
    ways: Array,
    out: Array,
) -> None:
    """rollout for the runs first to last; surfaces, cofs, mus and noises have one row for all or one for each.

    ways: (n, ticks + 1, 3) or (n, 0, 3). out: (n, 7), written.
    """
    for r in range(first, last):
        found = rollout(
            law,
            hold,
            table,
            speed,
            model,
            gains,
            rate,
            ticks,
            starts[r],
            surfaces[r if surfaces.shape[0] > 1 else 0],
            cofs[r if cofs.shape[0] > 1 else 0],
            mus[r if mus.shape[0] > 1 else 0],
            half,
            noises[r if noises.shape[0] > 1 else 0],
            ways[r],
        )
        x, y, turn, worst, stuck, along, outcome = found
        out[r, 0], out[r, 1], out[r, 2], out[r, 3] = x, y, turn, worst
        out[r, 4], out[r, 5], out[r, 6] = stuck, along, outcome
