"""Tables of twist-angle errors: experiments in rows, models in columns."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..friction.cross_validation import Judgement, interval

Judged = Mapping[str, Mapping[str, Judgement]]


def angle_table(judged: Judged) -> str:
    """Mean with its 95 % confidence interval, and median, in degrees, of every experiment and of all of them.

    Args:
        judged: experiment → model → what it predicts. The last row averages over the experiments that a model has.
    """
    models = list(dict.fromkeys(model for row in judged.values() for model in row))
    wide = max(22, *(len(name) + 2 for name in judged))
    lines = [f"{'mean [95 %] (median) in °':<{wide}}  n  " + "".join(f"{model:>27}" for model in models)]
    for name, row in judged.items():
        n = next(iter(row.values())).angles.shape[1]
        cells = (_cell([row[model]]) if model in row else "—" for model in models)
        lines.append(f"{name:<{wide}}{n:>3}  " + "".join(f"{cell:>27}" for cell in cells))
    if len(judged) > 1:
        cells = (_cell([row[model] for row in judged.values() if model in row]) for model in models)
        lines.append(
            f"{f'mean of {len(judged)} experiments':<{wide}}     " + "".join(f"{cell:>27}" for cell in cells)
        )
    return "\n".join(lines)


def angle_numbers(judgements: Sequence[Judgement]) -> dict[str, object]:
    """Mean, median and their intervals, averaged over experiments, as plain numbers in degrees."""
    return {
        "mean": float(np.degrees(np.mean([j.mean for j in judgements]))),
        "mean_interval": np.degrees(interval(judgements, np.mean)).tolist(),
        "median": float(np.degrees(np.mean([j.median for j in judgements]))),
        "median_interval": np.degrees(interval(judgements, np.median)).tolist(),
    }


def _cell(judgements: Sequence[Judgement]) -> str:
    mean, median = (
        np.degrees(np.mean([getattr(j, what) for j in judgements])) for what in ("mean", "median")
    )
    low, high = np.degrees(interval(judgements, np.mean))
    return f"{mean:.1f} [{low:.1f}, {high:.1f}] ({median:.1f})"
