"""The study of `flatpush experiment feedback`, of the horizon controller: what a user may expect of it."""

import pytest

from flatpush.experiments.feedback import attempt, task

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("first", range(0, 80, 20))
def test_of_twenty_tasks_at_most_one_ends_beside_its_goal(first):
    """`python benchmarks/feedback_study.py 400` runs them all."""
    asked = [t for t in map(task, range(first, first + 20)) if t.steerable]
    assert len(asked) >= 18
    ends = [attempt(t)[0] for t in asked]
    assert sum(end.good for end in ends) >= len(ends) - 1
    # What ends off the goal says so, or what it was doing when the study's time was over.
    assert all(end.outcome.startswith(("still ", "no ", "out of time ")) for end in ends if not end.good)


@pytest.mark.parametrize("kind", ["displaced", "lost"])
def test_a_finger_that_is_moved_or_lifted_in_mid_push_is_recovered_from(kind):
    """Few tasks, to be quick; `python benchmarks/feedback_study.py 100 horizon displaced` runs more."""
    asked = [t for t in (task(k, 1, near=0.1) for k in range(14)) if t.steerable]
    assert sum(attempt(t, disturbance=kind)[0].good for t in asked) >= len(asked) - 1 >= 12
