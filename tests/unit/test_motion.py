"""The table and the finger's friction from poses alone: against a simulated table that is known exactly."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

import flatpush as fp
from flatpush.cli.app import main
from flatpush.documents import columns_of_scene, load_motions, load_robot_log
from flatpush.documents.motion_file import Motion, is_motion_file, own_or_plain
from flatpush.errors import InputError
from flatpush.friction import Support
from flatpush.geometry import Outline, compose, log, rotate, transform
from flatpush.identification import fit_motion, look, radii, suggest, summarise, turning_radius
from flatpush.identification.fit import LIKELIER, _evidence, _fitted, _Search, _with_one_fewer, fit_seen
from flatpush.identification.pressure import SD_FOOT, Density, FreeFeet, KnownFeet
from flatpush.planning.reserve import reserve
from flatpush.problem import Object
from flatpush.simulation.plant import Plant

TIP = 0.0025
CORNERS = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)]
FEET = [(-0.02, -0.01), (0.025, -0.012), (0.0, 0.015)]
LOADS = np.array([2, 4, 3]) / 9
TABLE = Object(CORNERS, support=Support.points(FEET, LOADS), friction=0.3)
EXPECTED = Object(CORNERS, support=Support.points(FEET), friction=0.4)
# Edge, place along it, direction of the finger to the left of the normal [deg].
PUSHES = [(0, 0.3, 25), (0, 0.7, -25), (1, 0.4, 20), (2, 0.3, -30), (2, 0.6, 30), (3, 0.5, -15), (3, 0.7, 0)]


def pushed(thing=TABLE, pushes=PUSHES, length=0.08, noise=(1e-4, 1.7e-3), rate=30, seed=5):
    """Pushes at 20 mm/s of an object that a camera sees with noise."""
    rng, plant, found = np.random.default_rng(seed), Plant(thing, [[0.0, 0.0]], TIP), []
    for k, (edge, along, degrees) in enumerate(pushes):
        at = thing.outline.at(edge, along)
        pose = np.array([0.1, -0.05, rng.uniform(-3, 3)])
        frames = int(length / 0.02 * rate)
        way = np.outer(np.linspace(-0.002, length, frames), rotate(np.deg2rad(degrees), at.normal))
        tips = transform(pose, at.point - TIP * at.normal + way)
        poses = plant.follow(pose, np.column_stack([tips, np.zeros(frames)])).object
        seen = poses + rng.normal(size=poses.shape) * [noise[0], noise[0], noise[1]]
        found.append(Motion(f"push {k}", np.arange(frames) / rate, seen, tips, np.arange(frames) + 2))
    return found


@pytest.fixture(scope="module")
def fitted():
    return fit_motion(pushed(), EXPECTED, TIP)


def test_one_frame_tells_nothing_and_warns_of_nothing():
    """The median of no differences was a warning of numpy's before the refusal."""
    one = Motion("one", np.zeros(1), np.zeros((1, 3)), np.zeros((1, 2)), np.array([2]))
    with pytest.raises(InputError, match="no recording holds a push of 15 mm"):
        look([one], EXPECTED.outline, TIP)


def test_loads_and_friction_come_from_poses_alone(fitted):
    spread = fitted.pressure.at(fitted.numbers)
    summary = summarise(fitted, [], [])
    assert spread.loads == pytest.approx(LOADS, abs=0.01)
    assert np.all(np.abs(spread.loads - LOADS) < 5 * summary.shares_sd)
    assert np.all(summary.shares_sd < 0.01)
    assert fitted.thing.friction == pytest.approx(0.3, rel=0.02)
    assert abs(fitted.thing.friction - 0.3) < 5 * summary.friction_sd
    assert np.hypot(*(fitted.thing.cof - TABLE.cof)) < 3e-4
    assert fitted.scatter < 1.5
    assert summary.slid
    assert summary.untold == ()


def test_loads_are_held_to_what_is_expected_as_much_as_the_data_bear_out(fitted):
    """Three noisy pushes: where the scene's loads are true they are held to them within 10 %, where not, not. The
    evidence for that, foretold from one fit, is what the other fit gives."""
    assert fitted.pressure.sd == SD_FOOT
    few, places = PUSHES[::3], np.array(FEET)
    for table, held in ((Object(CORNERS, Support.points(FEET), friction=0.3), True), (TABLE, False)):
        seen = look(pushed(table, few, 0.06), EXPECTED.outline, TIP)
        fit = fit_seen(seen, EXPECTED, TIP)
        assert (fit.pressure.sd == 0.1) == held
        if held:
            expected = EXPECTED.support.feet[1]
            wide, narrow = (
                _fitted(KnownFeet(places, expected, sd), None, seen, EXPECTED, TIP) for sd in (SD_FOOT, 0.1)
            )
            assert _evidence(wide, 0.1) == pytest.approx(narrow.evidence, abs=0.3)
            assert narrow.evidence < wide.evidence - 1
            clear = wide.evidence - fit.evidence > LIKELIER
            assert np.allclose(fit.covariance, (narrow if clear else wide).covariance)


def test_radii_lie_within_what_they_are_said_to(fitted):
    places = [TABLE.outline.at(edge, along) for edge in range(4) for along in (0.3, 0.5, 0.7)]
    found = radii(fitted, places)
    true = np.array([turning_radius(TABLE, at) for at in places])
    seen = np.array([[r.value, r.sd] for r in found])
    turns = np.isfinite(true)
    assert turns.sum() >= 6
    assert np.all(np.abs(seen[turns, 0] - true[turns]) < 5 * seen[turns, 1])
    near = turns & (true < 0.1)
    assert seen[near, 0] == pytest.approx(true[near], rel=0.03)


def test_turning_centres_are_those_of_an_object_that_a_sliding_finger_turns():
    """A finger that slides off to either side turns the object about the two centres; the plant says where they are."""
    plant = Plant(TABLE, [[0.0, 0.0]], TIP)
    for edge, along in ((1, 0.5), (3, 0.5), (3, 0.3)):
        at = TABLE.outline.at(edge, along)
        centres = []
        for side in (1, -1):
            step = 1e-6 * rotate(side * np.deg2rad(70), at.normal)
            begin = np.array([*(at.point - TIP * at.normal), 0.0])
            turned = plant.follow(np.zeros(3), [begin, begin + np.array([*step, 0.0])]).object[-1]
            V = log(turned)
            centres.append(np.array([-V[1], V[0]]) / V[2])
        assert turning_radius(TABLE, at) == pytest.approx(np.hypot(*(centres[0] - centres[1])) / 2, rel=1e-3)


@pytest.mark.parametrize("family", ["feet", "density", "free"])
def test_derivatives_are_those_of_the_plant(family):
    """Ends of stretches are moved by small changes of each number as the equations of motion say."""
    seen = look(pushed(noise=(1e-6, 1e-6)), TABLE.outline, TIP)
    family = {
        "feet": KnownFeet(np.array(FEET), LOADS),
        "density": Density(TABLE.outline),
        "free": FreeFeet(TABLE.outline, 3),
    }[family]
    x = family.numbers(np.array(FEET), LOADS) if isinstance(family, FreeFeet) else family.mean
    search = _Search(family, seen, EXPECTED, TIP, np.log(0.3))
    z = np.append(x, np.log(0.3))
    here = search.roll(z)
    misses = []
    for k in (0, 1, len(z) - 2, len(z) - 1):
        step = np.zeros(len(z))
        step[k] = 1e-4
        numeric = (search.roll(z - step).errors - search.roll(z + step).errors) / 2e-4
        size = np.linalg.norm(numeric, axis=1)
        tells = size > 0.1 * size.max()
        misses += (np.linalg.norm(numeric - here.jacobian[:, :, k], axis=1)[tells] / size[tells]).tolist()
    assert np.median(misses) < 0.03  # stretches in which the contact changes its mode are off by more
    assert np.percentile(misses, 75) < 0.3


def test_what_the_model_leaves_out_grows_with_the_way():
    """An end of a stretch is so much less sure, in proportion to the finger's way."""
    seen = look(pushed(), EXPECTED.outline, TIP)
    z = np.append(KnownFeet(np.array(FEET), LOADS).mean, np.log(0.3))
    few, many = (
        _Search(KnownFeet(np.array(FEET), LOADS), one, EXPECTED, TIP, np.log(0.3)).roll(z).covariance
        for one in (replace(seen, model=(0.0, 0.0)), replace(seen, model=(0.1, 2.0)))
    )
    way = np.hypot(*(seen.stretches.tips[:, -1] - seen.stretches.tips[:, 0]).T)
    assert np.diagonal(many - few, axis1=1, axis2=2) == pytest.approx(
        np.outer(way**2, [0.01, 0.01, 4.0]), rel=1e-6
    )


@pytest.mark.slow
def test_an_unknown_face_is_told_from_a_rim():
    """Places whose line of force passes far from the centre turn widely, and their radii are the least certain."""
    for word, most in (("uniform", 0.1), ("outline", 0.25)):
        table = Object(CORNERS, support=word, friction=0.3)
        fit = fit_motion(pushed(table), Object(CORNERS, friction=0.4), TIP)
        places = [table.outline.at(edge, along) for edge in range(4) for along in (0.3, 0.5, 0.7)]
        true = np.array([turning_radius(table, at) for at in places])
        errors = np.array([turning_radius(fit.thing, at) for at in places]) / true - 1
        wide = true > 2 * table.outline.size
        assert fit.pressure.name == "density"
        assert np.nanmax(np.abs(errors[~wide])) < 0.05, word
        assert np.nanmax(np.abs(errors[wide])) < most, word
        assert fit.thing.friction == pytest.approx(0.3, rel=0.05)
        covariance = table.support.covariance
        assert np.trace(fit.thing.support.covariance) == pytest.approx(np.trace(covariance), rel=0.05), word


@pytest.mark.slow
def test_unknown_feet_are_found_in_their_number():
    """From one start for three, four and six feet the search ended in minima far from the feet that stood there: radii
    were off by a third, and a plan lost the object. What is found is as likely as what a search finds that begins at
    the truth."""
    feet = [(-0.025, -0.015), (0.02, -0.017), (0.027, 0.012), (-0.012, 0.016)]
    table = Object(CORNERS, Support.points(feet, [0.9, 0.35, 0.8, 0.4]), friction=0.3)
    fit = fit_motion(pushed(table, length=0.1), Object(CORNERS, friction=0.4), TIP)
    family = FreeFeet(table.outline, 4)
    start = family.numbers(np.array(feet), table.support.feet[1] / table.support.feet[1].sum())
    true = _fitted(family, start, fit.seen, Object(CORNERS, friction=0.4), TIP)
    assert fit.evidence <= true.evidence + 0.5
    (four,) = (one for one in (fit, *fit.others) if one.pressure.name == "4 feet")
    found = four.pressure.at(four.numbers)
    away = np.linalg.norm(np.array(feet)[:, None] - found.places, axis=2)
    assert np.all(away.min(axis=1) < 0.003)
    places = [table.outline.at(edge, along) for edge in range(4) for along in (0.3, 0.5, 0.7)]
    true = np.array([turning_radius(table, at) for at in places])
    errors = np.array([turning_radius(fit.thing, at) for at in places]) / true - 1
    assert np.nanmax(np.abs(errors)) < 0.03
    counts = {one.pressure.name for one in (fit, *fit.others)}
    assert {"density", "4 feet", "5 feet", "6 feet", "7 feet"} <= counts


def test_a_foot_fewer_begins_where_two_stood_for_one():
    """Of starts with a foot left out or two put together the first is the one that splits none."""
    family = FreeFeet(TABLE.outline, 4)
    split = np.array([*FEET[:2], (0.0, 0.013), (0.0, 0.017)])
    loads = np.array([*LOADS[:2], LOADS[2] / 2, LOADS[2] / 2])
    seen = look(pushed(), TABLE.outline, TIP)
    search = _Search(family, seen, TABLE, TIP, np.log(0.3))
    at = search.roll(np.append(family.numbers(split, loads), np.log(0.3)))
    places, shares = _with_one_fewer(search.result((at, 1.0)), seen, TIP)[0]
    assert places == pytest.approx(np.array(FEET))
    assert shares == pytest.approx(LOADS)


def two_fingers(thing):
    return fp.Scene(thing, (0.1, 0, 0), pusher=fp.Pusher(fingers=2, spacing=0.012, tip_radius=TIP))


def test_plans_allow_for_what_the_motion_leaves_open(fitted):
    """A scene fitted to motion said nothing of how well its loads are known: a plan from one lost the object."""
    sure = reserve(fitted, two_fingers(fitted.thing))
    assert (sure.loads, sure.held, sure.untold) == (0.0, 1.0, "")
    assert "on 100 % of the tables" in sure.text
    vague = replace(fitted, covariance=600 * fitted.covariance)
    kept = reserve(vague, two_fingers(vague.thing))
    assert kept.loads > 0
    assert kept.without < 0.95 < kept.held + 0.2
    assert kept.held > kept.without
    assert "(object: uncertainty)" in kept.text
    known = replace(fitted.thing, uncertainty=fp.Uncertainty(0.3))
    assert reserve(fitted, two_fingers(known)).loads == 0.3
    lost = reserve(replace(fitted, covariance=1e5 * fitted.covariance), two_fingers(fitted.thing))
    assert lost.held < 0.95
    assert f"in turns of {lost.push}" in lost.untold
    one = fp.Scene(fitted.thing, (0.1, 0, 0), pusher=fp.Pusher(fingers=1, tip_radius=TIP))
    assert reserve(fitted, one) is None


def test_drawn_tables_are_of_families_as_likely_as_they_are(fitted):
    other = replace(
        fitted, thing=replace(fitted.thing, friction=0.9), evidence=fitted.evidence + 2 * np.log(3)
    )
    drawn = replace(fitted, others=(other,)).drawn(400, np.random.default_rng(0))
    friction = np.array([thing.friction for thing in drawn])
    assert np.mean(friction > 0.6) == pytest.approx(0.25, abs=0.06)
    mine = np.log(friction[friction < 0.6] / fitted.thing.friction)
    assert np.std(mine) == pytest.approx(np.sqrt(fitted.covariance[-1, -1]), rel=0.15)


def test_what_pushes_do_not_tell_is_said_and_stays_as_expected():
    """Two short pushes that only stick: a good fit, but friction has only a bound."""
    fit = fit_motion(pushed(pushes=[(0, 0.6, 0), (2, 0.4, 0)], length=0.04), EXPECTED, TIP)
    at = TABLE.outline.at(1, 0.5)
    found = radii(fit, [at])
    summary = summarise(fit, ["east"], found)
    assert not summary.slid
    assert fit.thing.friction == pytest.approx(0.4, rel=0.01)
    assert summary.friction_sd > 0.15
    assert any("friction" in text for text in summary.untold)
    assert any("fit at noise level" in text for text in summary.untold)
    assert found[0].sd > 0.1 * found[0].value
    assert any("turning radius of east" in text for text in summary.untold)


def test_a_mirrored_picture_of_a_symmetric_outline_is_told_by_its_scatter(fitted):
    """Fingers touch where they should, and numbers came out with small uncertainties and no other word."""
    flip = [1, -1, -1]
    motions = [replace(m, poses=m.poses * flip, tips=m.tips * flip[:2]) for m in pushed()]
    fit = fit_motion(motions, EXPECTED, TIP)
    assert fit.scatter > 5
    assert any("a mirrored image" in text for text in summarise(fit, [], []).untold)
    assert not any("scatter" in text for text in summarise(fitted, [], []).untold)


def test_suggested_pushes_teach_what_they_promise():
    """The uncertainty after making the pushes is what was foretold; others leave more."""
    first = pushed(pushes=[(0, 0.6, 10), (2, 0.4, -30)])
    fit = fit_motion(first, EXPECTED, TIP)
    places = [TABLE.outline.at(edge, 0.5) for edge in (1, 3)]
    before = np.sqrt(np.mean([(r.sd / r.value) ** 2 for r in radii(fit, places)]))
    next_ = suggest(fit, places, TIP, length=0.08)
    assert len(next_) == 3
    assert next_[0].uncertainty < before
    assert next_[2].uncertainty < next_[1].uncertainty < next_[0].uncertainty
    more = [(s.at.edge, s.at.along, np.rad2deg(s.direction)) for s in next_]
    again = fit_motion(first + pushed(pushes=more, seed=8), EXPECTED, TIP)
    after = np.sqrt(np.mean([(r.sd / r.value) ** 2 for r in radii(again, places)]))
    assert after < 0.8 * before
    assert after == pytest.approx(next_[2].uncertainty, rel=0.6)


def test_free_feet_and_densities_are_pressures():
    outline = Outline.polygon(CORNERS)
    for family in (Density(outline), FreeFeet(outline, 4), KnownFeet(np.array(FEET), LOADS)):
        rng = np.random.default_rng(0)
        for _ in range(5):
            x = family.mean + 0.3 * rng.normal(size=len(family.mean))
            spread = family.at(x)
            assert np.sum(spread.loads) == pytest.approx(1)
            assert np.min(spread.loads) >= 0
            for k in range(len(x)):
                step = np.eye(len(x))[k] * 1e-6
                numeric = (family.at(x + step).loads - family.at(x - step).loads) / 2e-6
                assert numeric == pytest.approx(spread.by_loads[:, k], abs=1e-6)


def written(motions, path, header="t,x [mm],y [mm],theta [deg],px [mm],py [mm],push"):
    lines = [header]
    for k, m in enumerate(motions):
        for t, (x, y, turn), (px, py) in zip(m.times, m.poses, m.tips, strict=True):
            numbers = [t, 1e3 * x, 1e3 * y, np.rad2deg(turn), 1e3 * px, 1e3 * py]
            lines.append(",".join(f"{value:.5f}" for value in numbers) + f",{k}")
    path.write_text("\n".join(lines) + "\n")
    return path


SCENE = """# a comment
flatpush: scene/1
units: {length: mm, angle: deg}
object:
  outline: [[-30, -20], [30, -20], [30, 20], [-30, 20]]
  support: {points: [[-20, -10, 1], [25, -12, 1], [0, 15, 1]]}
  friction: 0.4
pusher: {fingers: 1, tip_radius: 2.5}
start: [60, 20, 135]
goal: [0, 0, 0]
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def run(monkeypatch, capsys):
    """The command: status, standard output, standard error."""

    def identify(*arguments):
        monkeypatch.setattr("sys.argv", ["flatpush", "identify", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return identify


def test_from_a_log_with_names_of_its_own_to_a_scene(tmp_path, scene, run):
    """Two commands: identify, and whatever uses the scene; everything but support and friction stays."""
    log = written(pushed(), tmp_path / "log.csv", "stamp,ox,oy,yaw,fx_mm,fy_mm,push")
    target = tmp_path / "sub" / "fitted.yaml"
    target.parent.mkdir()
    names = "t=stamp,x=ox[mm],y=oy[mm],theta=yaw[deg],px=fx_mm[mm],py=fy_mm[mm]"
    status, out, err = run(log, "--scene", scene, "--columns", names, "-o", target, "--json")
    assert status == 0, err
    told = json.loads(out)
    assert told["friction"] == pytest.approx(0.3, rel=0.02)
    assert told["shares"] == pytest.approx(LOADS, abs=0.01)
    assert all(sd > 0 for sd in told["shares_sd"])
    before, after = fp.load_scene(scene), fp.load_scene(target)
    assert after.object.friction == pytest.approx(told["friction"], rel=1e-5)
    assert after.object.support.feet[1] == pytest.approx(told["shares"], rel=1e-5)
    raw = yaml.safe_load(target.read_text())
    assert raw["pusher"] == {"fingers": 1, "tip_radius": 2.5}
    assert after.start == pytest.approx(before.start)


def test_the_scene_of_two_fingers_is_written_with_what_plans_must_allow_for(tmp_path, scene, run):
    log = written(pushed(pushes=PUSHES[1:4], length=0.04), tmp_path / "log.csv")
    scene.write_text(
        SCENE.replace("fingers: 1", "fingers: 2, spacing: 12").replace(
            "friction: 0.4", "friction: 0.4\n  uncertainty: {friction: [0.35, 0.4], loads: 0.01}"
        )
    )
    target = tmp_path / "fitted.yaml"
    status, out, err = run(log, "--scene", scene, "-o", target, "--json")
    assert status == 0, err
    told = json.loads(out)
    after = fp.load_scene(target)
    assert told["reserve"]["loads"] >= 0.01
    assert after.object.uncertainty.loads == told["reserve"]["loads"]
    low, high = after.object.uncertainty.friction
    assert low <= after.object.friction <= high
    assert low < 0.35
    status, out, err = run(log, "--scene", scene)
    assert "two fingers: every push holds on " in out


def test_a_scene_gives_names_and_units_of_its_recordings_once(tmp_path, scene, run):
    motions = pushed(pushes=PUSHES[:2])
    log = written(motions, tmp_path / "log.csv", "stamp,ox,oy,yaw,tip_x,tip_y,try")
    assert columns_of_scene(scene) is None
    names = "{t: stamp, x: ox, y: oy, theta: yaw, px: tip_x, py: tip_y, push: try}"
    scene.write_text(SCENE + f"logs: {{columns: {names}, length: mm, angle: deg}}\n")
    columns, length, angle = columns_of_scene(scene)
    read = load_motions(log, columns=columns, length=length, angle=angle).motions
    assert [len(m.times) for m in read] == [len(m.times) for m in motions]
    assert np.allclose(read[0].poses, motions[0].poses, atol=1e-6)
    assert np.allclose(read[1].tips, motions[1].tips, atol=1e-6)
    assert fp.load_scene(scene).object.friction == 0.4
    # The command takes them from there: with another name its message has that.
    scene.write_text(scene.read_text().replace("tip_x,", "gx,"))
    assert "line 1 names no column gx" in run(log, "--scene", scene)[2]
    scene.write_text(scene.read_text().replace("{t: stamp", "{time: stamp"))
    assert "logs.columns.time" in run(log, "--scene", scene)[2]


def test_a_run_under_feedback_is_logged_as_a_robots(tmp_path):
    from flatpush.control import ClosedLoopRun
    from flatpush.documents.motion_file import load_motions
    from flatpush.execution.log import save_followed

    times = np.arange(8) / 25
    poses, hands = (
        np.column_stack([0.1 + 0.05 * times, 0 * times, times]),
        np.column_stack([0.07 + 0.05 * times, 0 * times, 0 * times]),
    )
    heights = np.array([0.0, 0.0, 0.01, 0.01, 0.0, 0.0, 0.0, 0.0])  # at the ends of the ticks
    words = ("sticking",) * 8
    run = ClosedLoopRun(times, poses, hands, heights, words, words, "arrived")
    save_followed(run, "block", tmp_path / "run.csv")
    (one,) = load_robot_log(tmp_path / "run.csv").runs
    assert one.actions.tolist() == [1, 1, 1, 2, 2, 2]
    assert one.times.tolist() == pytest.approx(times[[0, 1, 2, 5, 6, 7]].tolist())
    assert np.allclose(one.hands, hands[[0, 1, 2, 5, 6, 7]], atol=1e-8)
    assert load_motions(tmp_path / "run.csv").motions[0].poses[1].tolist() == pytest.approx(poses[1].tolist())
    with pytest.raises(fp.InputError, match=r"ends in \.csv"):
        save_followed(run, "block", tmp_path / "run.mcap")


def test_the_log_of_a_run_and_its_bag_hold_the_same_motion(tmp_path):
    from types import SimpleNamespace

    from flatpush.execution.log import open_log

    motion = pushed(pushes=PUSHES[:1])[0]
    for name in ("run.csv", "run.mcap"):
        with open_log(tmp_path / name, "block") as log:
            for t, pose, tip in zip(motion.times, motion.poses, motion.tips, strict=True):
                tool = np.array([*tip, 0.0, 0.0])
                log.write(
                    SimpleNamespace(
                        time=t, leg="push", push=0, mode="sticking", object=pose,
                        state=SimpleNamespace(pose=tool), target=SimpleNamespace(pose=tool, twist=np.zeros(4)),
                    )
                )  # fmt: skip
        (read,) = load_motions(tmp_path / name).motions
        assert read.tips == pytest.approx(motion.tips, abs=1e-8), name
        assert read.times == pytest.approx(motion.times, abs=1e-6)
        assert rotate(read.poses[:, 2], [1.0, 0.0]) == pytest.approx(
            rotate(motion.poses[:, 2], [1.0, 0.0]), abs=1e-6
        )


def test_the_log_of_two_fingers_is_no_push_at_one_point(tmp_path, scene, run):
    """Midway between two fingers is a tip radius from a straight side, as one finger is: nothing else would tell."""
    motion = pushed(pushes=PUSHES[:1])[0]
    rows = ["t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id"]
    for t, (x, y, turn), (px, py) in zip(motion.times, motion.poses, motion.tips, strict=True):
        rows.append(f"{t},{1e3 * x},{1e3 * y},{turn},{1e3 * px},{1e3 * py},0,1")
    log = tmp_path / "run.csv"
    log.write_text("\n".join(rows) + "\n")
    assert run(log, "--scene", scene)[0] == 0
    scene.write_text(SCENE.replace("fingers: 1", "fingers: 2, spacing: 10"))
    status, _, err = run(log, "--scene", scene)
    assert status == 2
    assert "two fingers do not push at one point" in err


def changed(how):
    """Recordings with one thing wrong."""
    motions = pushed()[:2]
    m = motions[1]
    poses, tips, times, lines = m.poses.copy(), m.tips.copy(), m.times.copy(), m.lines
    if how == "rest":
        return [Motion("rest", times, np.tile(poses[:1], (len(poses), 1)), tips, lines)]
    if how == "jump":
        poses[60:] = compose(poses[60:], [0.02, 0.0, 0.0])
    if how == "mirrored":
        poses[:, [0, 2]] *= -1
        tips[:, 0] *= 1
    if how == "scaled":
        poses[:, :2] = poses[0, :2] + 1.3 * (poses[:, :2] - poses[0, :2])
    return [motions[0], Motion(m.name, times, poses, tips, lines)]


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("rest", "no recording holds a push"),
        ("jump", "line 62: the object jumps by"),
        ("mirrored", "the object moves while the finger is"),
        ("scaled", "the object moves while the finger is"),
    ],
)
def test_impossible_recordings_are_named(how, words):
    with pytest.raises(InputError, match=words):
        look(changed(how), TABLE.outline, TIP)


def test_the_scene_of_another_object_is_noticed():
    with pytest.raises(InputError, match="scene of another object"):
        look(pushed(), Outline.circle(0.04), TIP)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda rows: [*rows[:5], rows[4], *rows[5:]], "line 6: its stamp .* repeats that of line 5"),
        (
            lambda rows: [*rows[:5], rows[3], *rows[5:]],
            "line 6: its stamp .* runs back behind that of line 5",
        ),
        (lambda rows: [*rows[:7], "1,2,3", *rows[7:]], "line 8: it has 3 of 7 columns"),
        (
            lambda rows: [*rows[:7], rows[7].replace(rows[7].split(",")[2], "nan"), *rows[8:]],
            "line 8: y is not finite",
        ),
        (lambda rows: ["t,x,y,theta,qx,qy,push", *rows[1:]], "line 1 names no column px"),
        (lambda rows: [rows[0].replace("[deg]", "[turns]"), *rows[1:]], "a unit among rad, deg"),
        (lambda rows: rows[:1], "no usable row"),
    ],
)
def test_bad_rows_are_named_by_line_and_leave_no_traceback(tmp_path, scene, run, edit, words):
    path = written(pushed(pushes=PUSHES[:1]), tmp_path / "log.csv")
    path.write_text("\n".join(edit(path.read_text().splitlines())) + "\n")
    status, _, err = run(path, "--scene", scene, "-o", tmp_path / "fitted.yaml")
    assert status == 2
    assert re.search(words, err), err
    assert "Traceback" not in err
    assert not (tmp_path / "fitted.yaml").exists()


def test_a_column_fx_makes_no_wrench(tmp_path, scene, run):
    """A finger's own names fx, fy made the file a table of wrenches, although the names said what they are."""
    log = written(
        pushed(pushes=PUSHES[:2]), tmp_path / "log.csv", "t,x [mm],y [mm],theta [deg],fx [mm],fy [mm],push"
    )
    own = {"px": "fx", "py": "fy"}
    assert is_motion_file(log, own)
    assert is_motion_file(log)  # and then px is missed, not tau
    status, _, err = run(log, "--scene", scene)
    assert status == 2
    assert "names no column px" in err
    assert "--columns px=NAME" in err
    both = tmp_path / "both.csv"
    both.write_text("t,x,y,theta,px,py,fx,fy,tau,vx,vy,omega\n")
    assert not is_motion_file(both)
    assert is_motion_file(both, {"x": "x"})
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("fx,fy,tau,vx,vy,omega\n1,0,0,1,0,0\n")
    assert not is_motion_file(pairs, own)
    scene.write_text(SCENE + "logs: {columns: {px: fx, py: fy}}\n")
    log.write_text("t,x,y,theta,fx,fy\n0,0,0,0,1,a\n")
    status, _, err = run(log, "--scene", scene)
    assert status == 2
    assert "line 2: py is not a number" in err


@pytest.mark.parametrize(
    ("columns", "row", "words"),
    [
        ("{x: [1]}", "0,0,0,0,0,0", "logs.columns.x: the name of a column is a text"),
        ("{x: y}", "0,0,0,0,0,0", "column y stands for two things, x and y"),
        ("{}", "0,1e300,0,0,0,0", "line 2: x is beyond"),
    ],
)
def test_names_and_numbers_that_make_no_sense_are_told(tmp_path, scene, run, columns, row, words):
    log = tmp_path / "log.csv"
    log.write_text(f"t,x,y,theta,px,py\n{row}\n")
    scene.write_text(SCENE + f"logs: {{columns: {columns}}}\n")
    status, _, err = run(log, "--scene", scene)
    assert status == 2
    assert words in err
    with pytest.raises(InputError):
        load_robot_log(log, columns=columns_of_scene(scene)[0])


def test_our_own_logs_are_read_in_spite_of_the_names_that_a_scene_gives(tmp_path, scene):
    own = {"x": "ox", "px": "tip_x"}
    plain = written(pushed(pushes=PUSHES[:1]), tmp_path / "watched.csv")
    named = written(pushed(pushes=PUSHES[:1]), tmp_path / "own.csv", "t,ox,y,theta,tip_x,py,push")
    assert own_or_plain(plain, own) is None
    assert own_or_plain(named, own) == own
    followed = tmp_path / "followed.csv"
    followed.write_text(
        "t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id\n"
        "0,1,2,0,3,4,0,1\n0.1,1,2,0,3,4,0,1\n"
    )
    (motion,) = load_motions(followed, columns=own).motions
    assert motion.tips[0] == pytest.approx([0.003, 0.004])


def test_motion_needs_a_scene_and_wrenches_no_columns(tmp_path, scene, run):
    path = written(pushed(pushes=PUSHES[:1]), tmp_path / "log.csv")
    assert "--scene SCENE" in run(path)[2]
    assert "roles are t, x, y" in run(path, "--scene", scene, "--columns", "a=b")[2]
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("fx,fy,tau,vx,vy,omega\n1,0,0,1,0,0\n")
    assert "not both" in run(path, pairs, "--scene", scene)[2]
    assert "are for recordings of motion" in run(pairs, "--suggest")[2]
