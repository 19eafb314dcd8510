"""Many disturbed runs of a plan, told as they finish: the tube in which the object stays, and the errors at the end."""

from collections.abc import Iterator, Mapping

import numpy as np

from ..problem import Plan
from ..simulation import Noise
from ..simulation.study import Chunk, Runs, run_chunk, together
from ..view.table import MM
from ..view.tube import tubes
from .plain import plain
from .values import number_of, whole_of

FIRST, EACH = 10, 20  # runs that are told at once
MOST, MOST_SEED = 1000, 2**31
MARKS = 200  # points of a tube


def many_runs(plan: Plan, value: Mapping[str, object]) -> Iterator[dict[str, object]]:
    """The runs so far, again and again until there are as many as were asked for.

    Args:
        plan: that is rolled out.
        value: count of the runs; seed; position [mm] and angle [°] of the start, and friction of the fingers [%],
            standard deviations.

    Raises:
        InputError: for anything else.
    """
    count, seed = whole_of(value, "count", 1, MOST), whole_of(value, "seed", 0, MOST_SEED)
    position, angle, friction = (number_of(value, key) for key in ("position", "angle", "friction"))
    noise = Noise(position=position / MM, angle=float(np.deg2rad(angle)), friction=friction / 100)
    parts: list[Runs] = []
    done = 0
    while done < count:
        numbers = range(done, min(done + (EACH if done else FIRST), count))
        parts.append(run_chunk(Chunk(plan, numbers, seed, noise, "exact", "arcs", True)))
        done = numbers.stop
        yield {"count": count, **told(together(plan, parts))}


def told(runs: Runs) -> dict[str, object]:
    """Recorded runs as plain values: bands of the tube and ends [mm], and the errors in mm and degrees."""
    errors = runs.errors * [MM, 180 / np.pi]
    middle, worst = np.quantile(errors, [0.5, 0.95], axis=0), errors.max(axis=0)
    bands: list[dict[str, object]] = []
    for way, across, some in tubes(runs):
        step = max(1, len(way) // MARKS)
        for low, high, opacity in some:
            one, other = (way + side[:, None] * across for side in (low, high))
            ring = np.concatenate([one[::step], one[-1:], other[-1:], other[::-step]])
            bands.append({"ring": plain(ring, 2), "opacity": opacity})
    return {
        "kind": "runs",
        "done": len(runs),
        "bands": bands,
        "ends": plain(runs.final * [MM, MM, 1.0], 3),
        "stuck": runs.sticking.tolist(),
        "sticking": runs.sticking_share,
        "outcomes": {name: runs.outcomes.count(name) for name in dict.fromkeys(runs.outcomes)},
        "errors": [
            {"name": name, "distance": float(distance), "turn": float(turn)}
            for name, (distance, turn) in zip(
                ("half within", "95 % within", "worst"), (*middle, worst), strict=True
            )
        ],
    }
