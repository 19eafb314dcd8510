"""A plan beside the bound on what plans cost, and a cheaper one where the search for the bound finds it."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...errors import FlatpushError, InputError
from ...problem import Plan
from ...simulation import certify
from ..assembly import assemble
from ..path import Path, pieces_of
from ..query import Query
from .bound import bounds, check_bound

if TYPE_CHECKING:
    from ..planner import Planner
    from ..refine.problem import Candidate


def bounded(planner: "Planner", plan: Plan) -> Iterator[Plan]:
    """The plan with better and better bounds, endless until nothing is left to do or there is no room for more.

    The entry `bound` of its `run` holds, in the unit of the cost: what no plan of these pushes costs less than, with at
    most one change of contact (`least_one_change`), with two (`least_two_changes`) and with any number (`least`);
    `above`: by which part the plan is dearer than the last, at most; how many `boxes` were looked at, whether the plan
    is the cheapest of at most two changes (`complete`), and whether the search had no room left (`full`).

    Args:
        planner: that found the plan.
        plan: solved, with at least one push.

    Raises:
        InputError: for a scene of which no bound is known, see check_bound, and for a plan with slides.
    """
    scene = plan.scene
    check_bound(scene)
    if plan.slides:
        raise InputError(
            "a bound is known for pushes that steer, but this plan's slide", key="planning.slides",
            value=scene.planning.slides, hint="Leave out --bound.",
        )  # fmt: skip
    goal, slack = np.nan_to_num(scene.goal_pose), scene.goal_slack
    query = Query(
        planner.fleet,
        scene.start_pose,
        goal,
        free=scene.free_angle,
        slack=slack if scene.wide_goal else 0 * slack,
    )
    # Landing and leaving count in the cost of the pusher's way, and depend on the push alone.
    landing = 0.0
    if scene.planning.cost == "pusher":
        placements = [option.placement for option in planner.usable if option.placement is not None]
        landing = 2 * min(planner.transits.landing(place).pusher_length for place in placements)
    seen, cheapest = None, plan
    for bound in bounds(query, plan.cost - landing):
        if bound.found is not None and bound.found is not seen:
            seen = bound.found
            better = _plan_of(planner, plan, query, seen)
            cheapest = better if better is not None and better.cost < cheapest.cost else cheapest
        one, two = (least + landing for least in bound.least)
        least = min(bound.least_of_all + landing, cheapest.cost)
        found = {
            "least": least, "least_one_change": min(one, cheapest.cost), "least_two_changes": min(two, cheapest.cost),
            "above": cheapest.cost / least - 1, "boxes": bound.boxes, "complete": bound.complete, "full": bound.full,
        }  # fmt: skip
        yield replace(cheapest, run={**cheapest.run, "bound": found})


def _plan_of(planner: "Planner", plan: Plan, query: Query, found: "Candidate") -> Plan | None:
    """A sequence with its switch poses as a plan; None where the pusher has no way."""
    from ..refine.problem import Sequences

    _, words = Sequences.of(query, 0.0).chain(found.pushes, found.poses)
    pieces = [
        piece for push, word in zip(found.pushes, words, strict=True) for piece in pieces_of(int(push), word)
    ]
    try:
        path = Path.of(query.fleet, query.start, pieces)
        segments = assemble(plan.scene, planner.transits, planner.usable, path)
    except FlatpushError:
        return None
    certificate = certify(plan.scene, segments)
    return replace(
        plan, cost=certificate.cost, duration=certificate.duration, segments=segments, certificate=certificate
    )
