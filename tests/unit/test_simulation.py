"""The judge: rollouts and claims, and that they notice what is wrong."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.conftest import final_error

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import pose_error, relative
from flatpush.steering.car import Car

HUNDREDTH, TWENTIETH = 1e-5, 5e-5


def test_a_two_finger_plan_is_carried_to_the_goal(two_finger_plan):
    rollout = fp.simulate(two_finger_plan)
    assert rollout.outcome == "completed"
    distance, turn = final_error(rollout, two_finger_plan.scene.goal)
    assert distance < 1e-9
    assert turn < 1e-9


def test_a_one_finger_plan_sticks_all_the_way(one_finger_plan):
    rollout = fp.simulate(one_finger_plan)
    distance, turn = final_error(rollout, one_finger_plan.scene.goal)
    assert distance < TWENTIETH
    assert turn < np.deg2rad(0.05)
    assert set(rollout.modes) == {"rest", "separation", "sticking"}


def test_the_simulated_object_keeps_to_the_fingertip(one_finger_plan):
    rollout = fp.simulate(one_finger_plan)
    outline, tip = one_finger_plan.scene.object.outline, one_finger_plan.scene.pusher.tip_radius
    sticks = np.array(rollout.modes) == "sticking"
    assert np.sum(sticks) > 50
    for X_WO, X_WE in zip(rollout.object[sticks], rollout.pusher[sticks], strict=True):
        finger = relative(X_WO, X_WE)[:2]
        assert outline.nearest(finger).distance - tip == pytest.approx(0, abs=1e-8)


def test_swapped_turning_centres_fail_both_the_claims_and_the_rollout(triangle, rectangle, monkeypatch):
    """A car whose left and right turns are exchanged still steers on paper; the judge must see both failures."""
    good = Car.of.__func__

    def broken(cls, *args, **kwargs):
        car = good(cls, *args, **kwargs)
        # Mirror the centres about the straight direction through the contact.
        p = car.contact.point + car.cof
        d = car.direction

        def mirror(c):
            return p + 2 * ((c - p) @ d) * d - (c - p) - 0.02 * d

        return replace(car, left_centre=mirror(car.right_centre), right_centre=mirror(car.left_centre))

    for thing, start in ((triangle, (0.03, -0.06, 0.5)), (rectangle, (0.02, -0.05, 0.3))):
        with monkeypatch.context() as patch:
            patch.setattr(Car, "of", classmethod(broken))
            plan = fp.plan(fp.Scene(thing, start))
        assert plan.status == "solved"
        assert not fp.verify(plan).ok
        distance, turn = final_error(fp.simulate(plan), plan.scene.goal)
        assert distance > 1e-3 or turn > np.deg2rad(2)


def test_a_sliding_finger_is_reported(rectangle):
    """A plan made with more friction than there is slides."""
    optimistic = replace_friction(rectangle, 0.6)
    plan = fp.plan(fp.Scene(optimistic, (0.02, -0.05, 0.3)))
    real = replace(plan, scene=replace(plan.scene, object=replace_friction(rectangle, 0.15)))
    rollout = fp.simulate(real)
    assert {"sliding_left", "sliding_right"} & set(rollout.modes)
    assert not fp.verify(real).ok


def test_two_fingers_slip_without_friction_enough(two_finger_plan, triangle):
    scene = replace(two_finger_plan.scene, object=replace_friction(triangle, 0.02))
    rollout = fp.simulate(replace(two_finger_plan, scene=scene))
    assert {"sliding_left", "sliding_right"} & set(rollout.modes)
    distance, turn = final_error(rollout, scene.goal)
    assert distance > 1e-3 or turn > np.deg2rad(2)


def test_two_fingers_straighten_a_start_that_is_off(two_finger_plan):
    """They land on an object that is turned and shifted; each finger touches when it meets the edge, and both stick."""
    noise = fp.Noise(position=0.0003, angle=np.deg2rad(1.0), friction=0.0)
    for seed in range(5):
        rollout = fp.simulate(two_finger_plan, seed, perturbation=noise)
        assert rollout.outcome == "completed"
        start = rollout.object[0]
        off = abs(pose_error(start, two_finger_plan.scene.start)[2])
        _, turn = final_error(rollout, two_finger_plan.scene.goal)
        assert turn < 0.02 * off + 1e-6


def test_landing_on_the_object_moves_it_aside(one_finger_plan):
    """The object stands 3 mm nearer than the finger, which comes from 2 mm behind the contact."""
    push = one_finger_plan.pushes[0]
    ahead = np.array([np.cos(push.pusher[0, 2]), np.sin(push.pusher[0, 2]), 0.0])
    scene = replace(one_finger_plan.scene, start=one_finger_plan.scene.start_pose - 0.003 * ahead)
    rollout = fp.simulate(replace(one_finger_plan, scene=scene))
    assert rollout.outcome == "completed"
    outline, tip = scene.object.outline, scene.pusher.tip_radius
    for pose, pusher, mode in zip(rollout.object, rollout.pusher, rollout.modes, strict=True):
        if mode != "rest":
            local = relative(pose, pusher)[:2]
            assert outline.nearest(local).distance - tip > -1e-6


def test_a_finger_that_misses_loses_contact(one_finger_plan):
    away = replace(one_finger_plan, scene=replace(one_finger_plan.scene, start=(0.2, -0.05, 0.3)))
    # The object waits elsewhere; the pusher moves as planned and never meets it.
    segments = one_finger_plan.segments
    rollout = fp.simulate(replace(away, segments=segments))
    assert rollout.outcome == "lost contact"
    assert rollout.final_pose == pytest.approx(away.scene.start)


def test_a_late_touch_pushes_the_object_from_where_it_is(one_finger_plan):
    """The object stands 1 mm further: the finger first travels through air."""
    push = one_finger_plan.pushes[0]
    ahead = np.array([np.cos(push.pusher[0, 2]), np.sin(push.pusher[0, 2]), 0.0])
    scene = replace(one_finger_plan.scene, start=one_finger_plan.scene.start_pose + 0.001 * ahead)
    rollout = fp.simulate(replace(one_finger_plan, scene=scene))
    first = rollout.modes.index("sticking")
    assert "separation" in rollout.modes[:first]
    assert np.all(rollout.object[first - 2] == scene.start_pose)


def test_perturbed_runs_are_seeded(one_finger_plan):
    noise = fp.Noise()
    a, b, c = (fp.simulate(one_finger_plan, seed, perturbation=noise) for seed in (1, 1, 2))
    assert np.array_equal(a.object, b.object)
    assert not np.array_equal(a.final_pose, c.final_pose)
    with pytest.raises(InputError, match="0 or more"):
        fp.Noise(friction=-1)


def test_the_finger_that_keeps_its_direction_rolls(rectangle):
    """The contact moves by tip_radius · Δθ to the left when the object turns left; the simulator finds it by itself."""
    scene = fp.Scene(
        rectangle, (0.02, -0.06, 0.2), pusher=fp.Pusher(turns=False, tip_radius=0.004), pushes="auto"
    )
    plan = fp.plan(scene)
    push = plan.pushes[0]
    assert np.ptp(push.pusher[:, 2]) == 0
    rollout = fp.simulate(plan)
    distance, turn = final_error(rollout, scene.goal)
    assert distance < TWENTIETH
    assert turn < np.deg2rad(0.05)
    touches = [i for i, m in enumerate(rollout.modes) if m == "sticking"]
    contacts = []
    for i in (touches[0], touches[len(touches) // 2], touches[-1]):
        pose, tip = rollout.object[i], rollout.pusher[i][:2]
        local = np.array([[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]]) @ (
            tip - pose[:2]
        )
        contacts.append((rectangle.outline.nearest(local), pose[2]))
    for (a, angle_a), (b, angle_b) in pairwise(contacts):
        left = np.array([-a.normal[1], a.normal[0]])
        assert (b.point - a.point) @ left == pytest.approx(0.004 * (angle_b - angle_a), abs=1e-6)
    assert abs(contacts[-1][1] - contacts[0][1]) > 0.1


def test_verify_recomputes_what_is_stated(one_finger_plan, two_finger_plan):
    for plan in (one_finger_plan, two_finger_plan):
        report = fp.verify(plan)
        assert report.ok, report.failed
        assert {"cost", "duration", "goal_error", "friction_margin"} <= {
            claim.name for claim in report.claims
        }


@pytest.mark.parametrize(
    "key", ["friction_margin", "growth", "curvature_margin", "motion_cone_margin_degrees"]
)
def test_an_edited_claim_is_refused(one_finger_plan, key):
    stated = one_finger_plan.certificate
    edited = replace(stated, **{key: getattr(stated, key) * (1 + 1e-5)})
    report = fp.verify(replace(one_finger_plan, certificate=edited))
    assert [claim.name for claim in report.failed] == [key]


def test_edited_plans_are_refused(one_finger_plan):
    plan, push = one_finger_plan, one_finger_plan.pushes[0]

    def with_push(**changes):
        edited = replace(push, **changes)
        return replace(plan, segments=tuple(edited if s is push else s for s in plan.segments))

    def shifted(array, row, by):
        copy = array.copy()
        copy[row] += by
        return copy

    arc = push.arcs[0]
    edits = {
        "cost": replace(plan, cost=plan.cost + 1e-6),
        "duration": replace(plan, duration=plan.duration - 1e-4),
        "object sample": with_push(object=shifted(push.object, 5, 1e-7)),
        "pusher sample": with_push(pusher=shifted(push.pusher, 5, 1e-7)),
        "fingers": with_push(fingers=push.fingers + 1e-6),
        "word": with_push(word="LLL"),
        "twist": with_push(arcs=(replace(arc, twist=arc.twist * (1 + 1e-6)), *push.arcs[1:])),
        "arc cost": with_push(arcs=(replace(arc, cost=arc.cost * 1.001), *push.arcs[1:])),
        "turn": with_push(arcs=(replace(arc, turn="straight"), *push.arcs[1:])),
        "times": with_push(times=push.times * 0.9),
        "goal": replace(plan, scene=replace(plan.scene, goal=plan.scene.goal_pose + np.array([1e-3, 0, 0]))),
        "friction": replace(
            plan, scene=replace(plan.scene, object=replace_friction(plan.scene.object, 0.31))
        ),
        "push name": with_push(push="nowhere"),
        "no retreat": replace(plan, segments=plan.segments[:-1]),
    }
    for name, edited in edits.items():
        assert not fp.verify(edited).ok, name


def test_no_plan_cannot_be_verified_or_rolled_out(rectangle):
    never = fp.Planning(slides="never")
    plan = fp.plan(fp.Scene(replace_friction(rectangle, 0.0), (0.02, -0.05, 0.3), planning=never))
    assert plan.status == "no_plan"
    assert "without friction" in plan.reason
    for judge in (fp.verify, fp.simulate):
        with pytest.raises(InputError, match="there is no plan"):
            judge(plan)


def test_a_start_at_the_goal_is_an_empty_plan(triangle):
    plan = fp.plan(fp.Scene(triangle, (0.0, 0.0, 2 * np.pi)))
    assert plan.status == "solved"
    assert plan.segments == ()
    assert plan.cost == 0
    assert fp.verify(plan).ok
    assert pose_error(fp.simulate(plan).final_pose, [0, 0, 0]) == pytest.approx([0, 0, 0], abs=1e-12)


def replace_friction(thing, mu):
    return fp.Object(thing.outline, thing.support, mu, thing.surface, thing.name)
