"""Closed-loop runs compiled from laws.rollout, many at a time."""

from ...compiled import kernel
from ...geometry.pose import Array
from .rollout import Loop, rollout


@kernel()
def many(
    first: int,
    last: int,
    loop: Loop,
    starts: Array,
    surfaces: Array,
    cofs: Array,
    mus: Array,
    tips: Array,
    noises: Array,
    ways: Array,
    out: Array,
) -> None:
    """rollout for the runs first to last; surfaces, cofs, mus and noises have one row for all or one for each.

    ways: (n, ticks + 1, 3) or (n, 0, 3). out: rows with the columns of many_runs.ENDED, shape (n,), written.
    """
    for r in range(first, last):
        A = surfaces[r if surfaces.shape[0] > 1 else 0]
        cof = cofs[r if cofs.shape[0] > 1 else 0]
        mu = mus[r if mus.shape[0] > 1 else 0]
        noise = noises[r if noises.shape[0] > 1 else 0]
        found, row = rollout(loop, starts[r], A, cof, mu, tips, noise, ways[r]), out[r]
        row.x, row.y, row.turn, row.worst = found.x, found.y, found.turn, found.worst
        row.stuck, row.along, row.outcome = found.stuck, found.along, found.outcome
