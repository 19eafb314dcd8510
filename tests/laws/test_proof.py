"""Plans that are proved for a set of tables, rolled out in the plant on tables of the set."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import WrenchCone
from flatpush.geometry import compose, perpendicular, pose_error, shift_twist
from flatpush.problem.mechanics import contacts_of, named, placement_of

RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
FEET = [(-0.018, -0.012), (0.02, -0.01), (0.004, 0.014), (-0.02, 0.008)]
PUSHER = fp.Pusher(fingers=2, spacing=0.018)


@pytest.fixture(scope="module")
def plan():
    thing = fp.Object(RECTANGLE, fp.Support.points(FEET, [1, 1.2, 1, 0.8]), friction=0.4)
    push = fp.Push("side", thing.outline.nearest((0.0, -0.0175)), fingers=2, spacing=0.018)
    return fp.plan(fp.Scene(thing, (0.05, -0.12, 0.8), pusher=PUSHER, pushes=(push,)))


def on(plan, weights):
    """The plan on another table."""
    thing = replace(plan.scene.object, support=fp.Support.points(FEET, weights))
    return fp.simulate(replace(plan, scene=replace(plan.scene, object=thing)), seed=None)


def corners(weights, share):
    """The loads at the corners of the set, as the ends of all ranges but one that makes the sum right."""
    for signs in product((-1, 1), repeat=3):
        for k in range(4):
            loads = weights * (1 + share * np.insert(np.array(signs, dtype=float), k, 0))
            loads[k] += weights.sum() - loads.sum()
            if abs(loads[k] - weights[k]) <= share * weights[k] + 1e-12:
                yield loads


def heights(plan, loads, way):
    """n · W of the faces of the fingers' cone, by the nominal wrench's size, for all motions of a plan with one push.

    The object is off along its side: under a hand that moves as planned, its feet lie elsewhere.
    """
    scene, segment = plan.scene, plan.pushes[0]
    contacts = contacts_of(scene, placement_of(scene, named(scene, segment.push)))
    cone = WrenchCone.of(contacts)
    feet, weights = scene.object.support.feet
    at = feet - scene.object.cof + way * perpendicular(contacts[0].normal)
    found = []
    for arc in segment.arcs:
        if arc.duration > 0:
            V = shift_twist(arc.twist, scene.object.cof)
            unit = V[:2] + V[2] * perpendicular(at)
            unit /= np.linalg.norm(unit, axis=1)[:, None]
            rows = np.column_stack([unit, (at[:, 0] * unit[:, 1] - at[:, 1] * unit[:, 0]) / cone.lever])
            found.append(cone.faces @ (loads @ rows) / np.linalg.norm(weights @ rows))
    return np.array(found)


@pytest.mark.parametrize("offset", [0.0, 0.001, 0.004])
def test_the_margin_of_a_set_is_the_least_over_the_corners_of_the_loads_and_the_faces(plan, offset):
    """And, of an object that may be off in the hand, over all its places, a little on the safe side. The contacts were
    moved along the object instead, and the hand's turning centres were not, which is another motion."""
    _, weights = plan.scene.object.support.feet
    found = fp.prove(plan, 0.1, offset=offset)
    least = min(
        np.min(heights(plan, loads, way))
        for loads in corners(weights, 0.1)
        for way in np.linspace(-offset, offset, 9 if offset else 1)
    )
    assert least - (0.005 if offset else 1e-12) <= found.margin <= least + 1e-12
    worst = found.nearest
    assert heights(plan, found.worst, worst.offset)[worst.arc].min() == pytest.approx(worst.depth, abs=1e-12)
    assert (worst.number, worst.push, abs(worst.offset)) == (0, "side", offset)
    assert (found.bounds.loads, found.bounds.friction, found.bounds.offset) == (0.1, 0.4, offset)


def test_on_no_table_of_a_proved_set_does_anything_slide(plan):
    found = fp.prove(plan, 0.0)
    share = 0.999 * found.loads
    assert fp.prove(plan, share).proved
    assert share > 0.02
    _, weights = plan.scene.object.support.feet
    end = on(plan, weights).final_pose
    tables = list(corners(weights, share))
    assert len(tables) >= 6
    for loads in tables:
        run = on(plan, loads)
        assert not [mode for mode in run.modes if mode.startswith("sliding")]
        assert pose_error(run.final_pose, end) == pytest.approx(np.zeros(3), abs=1e-9)


@pytest.mark.slow
def test_an_object_off_along_its_side_stays_so_and_loses_all_other_errors(plan):
    """On the tables at the corners of the set: from offsets within the set it ends in the box that is certified.

    From starts that are off in place and angle the side comes to rest against both fingers: what is left lies along
    it, and is no more than the start was off there, the angle at the side's distance and the gap that is closed.
    """
    offset = 4e-4
    known = fp.Uncertainty(0.02, None, offset)
    thing = replace(plan.scene.object, uncertainty=known)
    scene = replace(plan.scene, object=thing, start=(0.05, -0.12, 0.8))
    proved = fp.plan(scene)
    box = np.array(proved.certificate.set_end)
    assert box == pytest.approx([offset, 0.0], abs=1e-9)
    _, weights = thing.support.feet
    rng = np.random.default_rng(6)
    ways = [(offset, 0.0, 0.0), (-offset, 0.0, 0.0)]
    ways += [tuple(rng.uniform(-1, 1, 3) * [5e-4, 5e-4, np.deg2rad(0.5)]) for _ in range(4)]
    for loads in list(corners(weights, 0.02))[::3]:
        for i, way in enumerate(ways):
            table = replace(thing, support=fp.Support.points(FEET, loads))
            start = compose(scene.start_pose, np.array(way))
            run = fp.simulate(replace(proved, scene=replace(proved.scene, object=table, start=start)))
            x, y, angle = pose_error(run.final_pose, proved.scene.goal)
            assert (y, angle) == pytest.approx((0.0, 0.0), abs=1e-6)
            if i < 2:
                assert abs(x) <= box[0] + 1e-7
                assert x == pytest.approx(way[0], abs=1e-7)
                assert "sliding" not in " ".join(run.modes)
            else:
                assert abs(x) <= abs(way[0]) + 0.0175 * abs(way[2]) + abs(way[1])


def test_the_worst_table_slips_as_soon_as_the_set_is_larger(plan):
    """The largest share is not only safe but true: just beyond it the table that is named lets the object slide."""
    share = 1.05 * fp.prove(plan, 0.0).loads + 0.01
    found = fp.prove(plan, share)
    assert not found.proved
    assert found.worst.sum() == pytest.approx(1)
    run = on(plan, found.worst)
    assert any(mode.startswith("sliding") for mode in run.modes)
    way = found.nearest.gives_way.rpartition(" ")[2]
    assert found.nearest.gives_way == f"both fingers slide to the {way}"
    assert f"sliding_{way}" in "+".join(run.modes)


def test_less_friction_and_a_grasp_that_is_off_leave_less(plan):
    whole = fp.prove(plan, 0.0).loads
    assert fp.prove(plan, 0.0, friction=0.36).loads < whole
    assert fp.prove(plan, 0.0, offset=0.004).loads < whole
    assert fp.prove(plan, 0.1).margin < fp.prove(plan, 0.05).margin


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"loads": 1.0}, "less than 1"),
        ({"loads": float("nan")}, "less than 1"),
        ({"friction": 0.5}, "at most the object's"),
        ({"offset": -0.001}, "0 or more"),
    ],
)
def test_sets_that_are_none(plan, options, message):
    with pytest.raises(fp.InputError, match=message):
        fp.prove(plan, **options)


def test_one_finger_is_never_proved(one_finger_plan):
    with pytest.raises(fp.InputError, match="two fingers"):
        fp.prove(one_finger_plan)
