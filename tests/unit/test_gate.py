"""The gate: what a robot would execute is checked, sample by sample; dangerous edits of plans are refused."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from tests.listed import listed

import flatpush as fp
from flatpush.documents import parse_plan, plan_document
from flatpush.errors import InputError
from flatpush.problem import TransitSegment

EDITS = listed(Path(__file__).parents[1] / "data" / "plan_edits.yaml")
BLOCK = [(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)]


def scene(kind):
    if kind == "slides":
        return fp.Scene(fp.Object(BLOCK, friction=0.0), (0.05, 0.02, 0.6))
    thing = fp.Object(BLOCK, friction=0.4)
    pushes = tuple(fp.Push(f"edge {k}", thing.outline.at(k, 0.5), 1) for k in (0, 1))
    planning = fp.Planning(iterations=1)
    if kind in ("one", "free"):
        goal = (0.0, 0.0, "free" if kind == "free" else 0.0)
        return fp.Scene(thing, (0.01, -0.12, 0.3), goal, pushes=pushes[:1], planning=planning)
    two = tuple(fp.Push(push.name, push.at, 2, 0.015) for push in pushes)
    pusher = fp.Pusher(fingers=2, spacing=0.015, transit="planar" if kind == "planar" else "lift")
    workspace = fp.Workspace()
    if kind == "walls":
        workspace = fp.Workspace(
            (-0.3, -0.3, 0.3, 0.3), ([(0.13, -0.2), (0.15, -0.2), (0.15, 0.2), (0.13, 0.2)],)
        )
    return fp.Scene(thing, (0.08, -0.08, 0.0), (0, 0, 0), pusher, two, workspace, planning)


def two_pushes(asked):
    """Along one edge, then along the other, with a transit between."""
    from flatpush.planning import Planner
    from flatpush.planning.assembly import assemble
    from flatpush.planning.path import Path
    from flatpush.simulation import certify

    planner = Planner(asked)
    first, second = sorted(range(2), key=lambda k: planner.usable[k].push.name)
    path = Path.of(planner.fleet, planner.scene.start_pose, [(first, 1, 0.08), (second, 1, 0.08)])
    segments = assemble(planner.scene, planner.transits, planner.usable, path)
    certificate = certify(planner.scene, segments)
    return fp.Plan("solved", planner.scene, certificate.cost, certificate.duration, segments, certificate)


@pytest.fixture(scope="module")
def documents():
    plans = {kind: two_pushes(scene(kind)) for kind in ("two", "planar", "walls")} | {
        kind: fp.plan(scene(kind)) for kind in ("one", "free", "slides")
    }
    return {kind: plan_document(plan) for kind, plan in plans.items()}


def thinned(segment, every=1, ends=False):
    count = len(segment["times"])
    keep = [0, count - 1] if ends else [*range(0, count - 1, every), count - 1]
    if ends and segment["kind"] == "push":
        clock = np.cumsum([0.0, *(arc["duration"] for arc in segment["arcs"])])
        keep = [int(np.argmin(np.abs(np.array(segment["times"]) - t))) for t in clock]
    for key in ("times", "object", "pusher", "height"):
        if key in segment:
            segment[key] = [segment[key][k] for k in keep]


def retimed(segment, factor):
    segment["times"] = [factor * t for t in segment["times"]]


def hurried(segment):
    """Full speed at once: a hand that stands for an instant at every sample, shorter than places can be told apart."""
    P = np.array(segment["pusher"])
    P = np.column_stack([P, segment.get("height", np.zeros(len(P)))])
    steps = np.abs(np.diff(P, axis=0))
    ways = np.hypot(np.hypot(steps[:, 0], steps[:, 1]), steps[:, 3]) + 0.2 * steps[:, 2]
    speed = 0.1 if segment["kind"] == "transit" else 0.01
    begin = np.concatenate([[0.0], np.cumsum(ways / speed + 1e-13)])
    segment["times"] = [t + dt for t in begin.tolist() for dt in (0.0, 1e-14)]
    for key in ("object", "pusher", "height"):
        if key in segment:
            segment[key] = [value for value in segment[key] for _ in range(2)]


def edited(document, edit):
    d = copy.deepcopy(document)
    S = d["segments"]
    transits = [s for s in S if s["kind"] == "transit"]
    push = next(s for s in S if s["kind"] != "transit")
    names = {"d": d, "S": S, "push": push, "first": transits[0], "last": transits[-1], "np": np}
    names |= {
        "between": transits[1],
        "n": len(transits[0]["times"]) // 2,
        "retimed": retimed,
        "hurried": hurried,
        "thinned": thinned,
    }
    exec(edit, names)
    return d


@pytest.mark.parametrize("kind", ["one", "two", "planar", "walls", "slides", "free"])
def test_an_honest_plan_is_accepted_and_is_for_its_scene(documents, kind):
    plan = parse_plan(documents[kind])
    for report in (fp.verify(plan), fp.verify(plan, scene=scene(kind))):
        assert report.ok, report.failed


@pytest.mark.parametrize("kind", ["one", "two", "walls", "slides", "free"])
def test_a_plan_that_was_written_otherwise_is_the_same(documents, kind):
    """Another order of keys, another indentation, a sample twice."""
    text = json.dumps(
        edited(documents[kind], "[push[k].insert(5, push[k][5]) for k in ('times', 'object', 'pusher')]")
    )
    turned = json.loads(text, object_pairs_hook=lambda pairs: dict(reversed(pairs)))
    report = fp.verify(parse_plan(json.loads(json.dumps(turned, indent=3))), scene=scene(kind))
    assert report.ok, report.failed


@pytest.mark.parametrize("case", EDITS, ids=lambda case: f"{case['plan']}: {case['edit'][:60]}")
def test_a_dangerous_edit_is_refused(documents, case):
    changed = edited(documents[case["plan"]], case["edit"])
    if case["claim"] == "load":
        with pytest.raises(InputError):
            parse_plan(changed)
        return
    failed = [claim.name for claim in fp.verify(parse_plan(changed)).failed]
    assert any(case["claim"] in name for name in failed), failed


@pytest.mark.parametrize("walled", [False, True])
def test_a_hand_that_moves_where_nothing_is_to_be_pushed_is_refused(walled):
    """There is no push whose fingers could be looked at."""
    box = (-0.3, -0.3, 0.3, 0.3) if walled else None
    there = fp.Scene(fp.Object(BLOCK, friction=0.4), (0, 0, 0), workspace=fp.Workspace(box))
    document = plan_document(fp.plan(there))
    assert document["segments"] == []
    through = {
        "kind": "transit",
        "pusher": [[-0.1, 0, 0], [0.1, 0, 0]],
        "height": [0.0, 0.0],
        "times": [0.0, 9.0],
    }
    document.update(segments=[through], duration=9.0)
    document["certificate"]["duration"] = 9.0
    failed = [claim.name for claim in fp.verify(parse_plan(document)).failed]
    assert failed == ["executed: transits without a push"]


def test_there_are_enough_edits():
    assert len(EDITS) >= 60
    assert {case["plan"] for case in EDITS} == {"one", "two", "planar", "walls", "slides", "free"}


def test_a_scene_that_is_believed_is_compared_with_one_that_is_trusted(documents):
    """With its digest taken out, a plan for other obstacles, friction and speed can be verified by itself only."""
    trusted = scene("walls")
    document = edited(
        documents["walls"], "d['scene']['workspace'].update(obstacles=[]); d.pop('scene_digest')"
    )
    document["certificate"]["clearance"] = fp.verify(parse_plan(document)).failed[0].recomputed
    plan = parse_plan(document)
    assert fp.verify(plan).ok
    failed = fp.verify(plan, scene=trusted).failed
    assert [claim.name for claim in failed] == ["scene: workspace.obstacles"]


def test_a_difference_of_the_scene_is_named_with_both_values(documents):
    document = edited(documents["one"], "d['scene']['pusher'].update(lift=0.04)")
    (claim,) = (
        c for c in fp.verify(parse_plan(document), scene=scene("one")).failed if c.name.startswith("scene: ")
    )
    assert (claim.name, claim.stated, claim.recomputed) == ("scene: pusher.lift", 0.04, 0.03)


def test_an_older_plan_loads_with_the_defaults(documents):
    document = edited(
        documents["two"],
        "d.pop('scene_digest');"
        "[d['scene']['pusher'].pop(k) for k in ('turn_rate', 'travel_speed', 'travel_acceleration')]",
    )
    plan = parse_plan(document)
    assert plan.scene.pusher == fp.Pusher(fingers=2, spacing=0.015)
    assert fp.verify(plan).ok


def test_what_no_friction_is_enough_for_is_as_stated():
    """A margin of -inf differed from itself (found by benchmarks/soak.py) and was as good as any other number."""
    from flatpush.simulation.verify import _agree

    assert _agree(-np.inf, -np.inf)
    assert not _agree(-np.inf, np.inf)
    assert not _agree(-np.inf, 0.3)
    assert not _agree(float("nan"), 0.3)


def test_a_failed_claim_says_where_by_how_much_and_what_is_allowed(documents):
    document = edited(documents["two"], "first['height'].__setitem__(n, -0.05)")
    (claim,) = (c for c in fp.verify(parse_plan(document)).failed if "below the table" in c.name)
    middle = len(documents["two"]["segments"][0]["times"]) // 2
    assert claim.rule == f"segment 0 (transit), sample {middle}: 50 mm, at most 0 mm"


@pytest.mark.parametrize(
    "start",
    [
        (0.01, -0.12, 3.4),
        *(pytest.param(s, marks=pytest.mark.slow) for s in ((0.01, 0.12, -3.3), (-0.1, 0.02, 6.0))),
    ],
)
def test_yaw_goes_on_through_the_whole_plan(start):
    """Of 16 plans from beyond ±180°, 6 jumped by 2π between a transit and the next push."""
    thing = fp.Object(BLOCK, friction=0.4)
    plan = fp.plan(
        fp.Scene(thing, start, pusher=fp.Pusher(fingers=2, spacing=0.015), planning=fp.Planning(iterations=1))
    )
    assert plan.status == "solved"
    yaw = np.concatenate([segment.pusher[:, 2] for segment in plan.segments])
    assert np.max(np.abs(np.diff(yaw))) < 0.2
    assert fp.verify(plan).ok, fp.verify(plan).failed


def test_whole_turns_are_taken_over_from_the_segment_before():
    from flatpush.planning.assembly import following

    before = TransitSegment(np.zeros(1), np.array([[0.1, 0.2, 9.0]]), np.zeros(1))
    after = TransitSegment(
        np.arange(2.0), np.array([[0.1, 0.2, 9.0 - 4 * np.pi], [0.1, 0.3, 9.5 - 4 * np.pi]]), np.zeros(2)
    )
    assert following(after, before).pusher[:, 2] == pytest.approx([9.0, 9.5])


def test_limits_are_kept_by_differences_of_the_samples(documents):
    """Computed another way: each fingertip's places, twice differenced."""
    for document in documents.values():
        pusher = fp.Pusher()
        for segment in document["segments"]:
            t, X = np.array(segment["times"]), np.array(segment["pusher"])
            h = np.array(segment.get("height", np.zeros(len(t))))
            fingers = np.array(segment.get("fingers", [[0.0, 0.0075], [0.0, -0.0075]]))
            assert np.max(np.abs(np.diff(X[:, 2])) / np.diff(t)) <= pusher.turn_rate * (1 + 1e-6)
            for x, y in fingers:
                c, s = np.cos(X[:, 2]), np.sin(X[:, 2])
                tips = np.stack([X[:, 0] + c * x - s * y, X[:, 1] + s * x + c * y, h], axis=1)
                v = np.diff(tips, axis=0) / np.diff(t)[:, None]
                lifted = np.maximum(h[:-1], h[1:]) > 0
                most = np.where(lifted, pusher.travel_speed, pusher.speed)
                assert np.all(np.linalg.norm(v, axis=1) <= most * (1 + 1e-6))
                a = np.linalg.norm(np.diff(v, axis=0), axis=1) / (0.5 * (t[2:] - t[:-2]))
                both = np.where(lifted[1:] | lifted[:-1], pusher.travel_acceleration, pusher.acceleration)
                assert np.all(a <= both * (1 + 1e-6))
