"""Pushes that slide, under feedback: look at the object at rest, push once, look again."""

from dataclasses import replace

import numpy as np

from ...geometry.pose import Array, pose_error
from ...planning.sliding import slide_planner, slide_plans, slide_segments
from ...planning.sliding.exact import SlidePlan, SlidePlanner, SlidePush
from ...problem import Plan, Scene, Segment, TransitSegment
from ...simulation.plant import MODES
from ...simulation.rollout import roll
from ..loop.closed_loop import ClosedLoopRun
from ..loop.controller import ARRIVED
from ..loop.sensor import SimulatedSensor
from .plan_controller import goal_error

LOOK = 0.5  # time at rest whose frames are averaged [s]
MOST_SLIDES = 40


def slide_by_slide(
    plan: Plan, world: Scene, sensor: SimulatedSensor, within: tuple[float, float]
) -> ClosedLoopRun:
    """Makes the first slide of a plan, looks, adjusts the rest or plans again, until the object is seen at the goal.

    Args:
        world: the plan's scene as it is, start and object, which only the simulator knows.
        sensor: sees the object.
        within: distance [m] and angle [rad] of the goal at which it has arrived.
    """
    scene, planner = plan.scene, slide_planner(plan.scene)
    pose, hand, clock = world.start_pose, None, 0.0
    first = plan.segments[0].pusher[0]
    rows: list[tuple[Array, ...]] = []
    modes: list[str] = []
    contacts: list[str] = []
    rest: tuple[SlidePush, ...] = ()
    outcome = f"{MOST_SLIDES} slides were not enough"
    for made in range(MOST_SLIDES + 1):
        at = first if hand is None else hand
        seen, clock = _looked(sensor, clock, pose, at)
        lifted = scene.pusher.lift if hand is None and scene.pusher.transit == "lift" else 0.0
        rows.append((np.array([clock]), pose[None], at[None], np.array([lifted])))
        modes.append("look")
        contacts.append("rest")
        distance, turn = goal_error(plan, seen)
        if distance <= within[0] and turn <= within[1]:
            outcome = ARRIVED
            break
        if made == MOST_SLIDES:
            break
        asked = replace(scene, start=seen)
        found = _next(planner, asked, rest, None if hand is None else hand[:2])
        if found is None:
            outcome = "there is no plan from here: " + planner.refusal(seen, np.nan_to_num(scene.goal_pose))
            break
        rest = found.pushes[1:]
        part = slide_segments(asked, found.pushes[:1], hand)[:-1]
        rolled = roll(Plan("solved", scene, segments=part), [replace(world, start=pose)], "exact", "samples")
        if rolled.outcomes[0] != "completed":
            outcome = rolled.outcomes[0]
            break
        rows.append((clock + rolled.times[1:], rolled.object[0, 1:], rolled.pusher[1:], _heights(part)[1:]))
        modes += [mode for segment in part for mode in [_mode(segment)] * (len(segment.times) - 1)]
        contacts += [MODES[code] for code in rolled.modes[0, 1:]]
        pose, hand = rolled.final[0], rolled.pusher[-1]
        clock += float(rolled.times[-1])
    times, objects, pushers, heights = (np.concatenate(part) for part in zip(*rows, strict=True))
    return ClosedLoopRun(times, objects, pushers, heights, tuple(modes), tuple(contacts), outcome)


def _next(
    planner: SlidePlanner, asked: Scene, rest: tuple[SlidePush, ...], tip: Array | None
) -> SlidePlan | None:
    """The rest of a plan, adjusted, or else a new one."""
    if rest and not asked.free_angle:
        found = planner.continued(rest, asked.start_pose, asked.goal_pose, tip)
        if found is not None:
            return found
    plans = list(slide_plans(planner, asked, tip))
    return plans[-1] if plans else None


def _looked(sensor: SimulatedSensor, clock: float, pose: Array, hand: Array) -> tuple[Array, float]:
    """The mean of the frames taken while the object rests, and the time when the last has come."""
    rate, state = sensor.camera.rate, sensor.start()
    frames: list[Array] = []
    k = 0
    while not frames or k < LOOK * rate:
        state = sensor.expose(replace(state, next_frame=0), k / rate, pose, hand)
        state, came = sensor.arrived(state, np.inf)
        frames += [frame.object for frame in came]
        k += 1
    return pose + np.mean(
        [pose_error(frame, pose) for frame in frames], axis=0
    ), clock + k / rate + sensor.camera.latency


def _heights(part: tuple[Segment, ...]) -> Array:
    heights = [s.height if isinstance(s, TransitSegment) else np.zeros(len(s.times)) for s in part]
    return np.concatenate([heights[0][:1], *(h[1:] for h in heights)])


def _mode(segment: Segment) -> str:
    return "transit" if isinstance(segment, TransitSegment) else "push"
