"""The study of `flatpush experiment feedback`, of the horizon controller: what a user may expect of it."""

import pytest

from flatpush.experiments.feedback import attempt, task

pytestmark = pytest.mark.slow


def test_nearly_all_of_two_hundred_tasks_end_within_the_tolerance():
    asked = [t for t in map(task, range(200)) if t.steerable]
    assert len(asked) >= 190
    ends = [attempt(t)[0] for t in asked]
    assert sum(end.good for end in ends) >= 0.95 * len(ends)
    # What ends off the goal says so.
    assert all(end.outcome.startswith(("still ", "no ")) for end in ends if not end.good)


@pytest.mark.parametrize("kind", ["displaced", "lost"])
def test_a_finger_that_is_moved_or_lifted_in_mid_push_is_recovered_from(kind):
    """Few tasks, to be quick; `python benchmarks/feedback_study.py 100 horizon displaced` runs more."""
    asked = [t for t in (task(k, 1, near=0.1) for k in range(14)) if t.steerable]
    assert sum(attempt(t, disturbance=kind)[0].good for t in asked) >= len(asked) - 1 >= 12
