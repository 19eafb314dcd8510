"""Moving switch poses to where it costs least to replan from where they are missed, compiled.

What replanning costs is Query.replanning, in plain Python; only the search for its least value needs a compiler.
"""

import numpy as np

from ...compiled import inner, kernel
from ...geometry.pose import Array
from ...steering.six_words import Records, chain_cost, cheapest_word

PASSES = 12  # most passes over the switch poses with one size of step


@inner
def _mean_cost(cars: Records, pushes: np.ndarray, poses: Array, offsets: Array, word: Records) -> float:
    """Mean cost of the legs when each but the first starts from where an offset, of (m, 3) in W, puts it."""
    here = np.empty(3)
    total = cheapest_word(cars[pushes[0]], poses[0], poses[1], word[0])
    for i in range(1, len(pushes)):
        for d in range(len(offsets)):
            for j in range(3):
                here[j] = poses[i, j] + offsets[d, j]
            total += cheapest_word(cars[pushes[i]], here, poses[i + 1], word[0]) / len(offsets)
    return total


@kernel()
def settle(
    cars: Records,
    pushes: np.ndarray,
    poses: Array,
    offsets: Array,
    least: float,
    steps: Array,
    words: Records,
) -> None:
    """Moves the switch poses to lower _mean_cost, by trying steps of falling size along fixed directions."""
    best = _mean_cost(cars, pushes, poses, offsets, words)
    radius = cars[pushes[0]].radius
    for step in steps:
        for _ in range(PASSES):
            improved = False
            for i in range(1, len(poses) - 1):
                for direction in range(26):
                    trit = direction if direction < 13 else direction + 1  # all of {-1, 0, 1}³ but the middle
                    x, y, theta = poses[i, 0], poses[i, 1], poses[i, 2]
                    poses[i, 0] = x + step * (trit % 3 - 1)
                    poses[i, 1] = y + step * (trit // 3 % 3 - 1)
                    poses[i, 2] = theta + step / radius * (trit // 9 - 1)
                    value = _mean_cost(cars, pushes, poses, offsets, words)
                    if value < best - 1e-9 * best:
                        chain_cost(cars, pushes, poses, words)
                        shortest = np.inf
                        for j in range(len(words)):
                            shortest = min(shortest, words[j].flat)
                        if shortest >= least:
                            best = value
                            improved = True
                            continue
                    poses[i, 0], poses[i, 1], poses[i, 2] = x, y, theta
            if not improved:
                break
