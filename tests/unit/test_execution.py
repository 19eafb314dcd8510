"""A plan on a robot: what is compared before the first command, what is watched in every cycle, and what is written."""

import io
import math
import resource
import signal
from dataclasses import replace

import numpy as np
import pytest
from tests.broken_off import PHASES, interrupts
from tests.extras import extra

import flatpush as fp
from flatpush.control import Camera, PlanController, SimulatedSensor
from flatpush.documents import load_robot_log
from flatpush.errors import InputError
from flatpush.execution import (
    DONE,
    Address,
    Limits,
    OutOfLimits,
    RobotFault,
    Target,
    Unverified,
    open_robot,
    run,
)
from flatpush.execution.course import Course, approach, planned
from flatpush.execution.egm import egm
from flatpush.execution.run import Played, stream, way
from flatpush.execution.simulated import DryRun, SimRobot, Unknown, home_of
from flatpush.simulation.plant import Plant
from flatpush.simulation.replay import Recording, Registration, replay
from flatpush.testing import NotConforming, check_robot


@pytest.fixture(scope="module")
def short_plan(triangle):
    """One push of two fingers."""
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    return fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))


def straight(speed=0.02, length=0.01, start=(0.0, 0.0, 0.03, 0.0)):
    """To the right at a speed, at rest for a while before and after."""
    a, span = np.array(start, dtype=float), length / speed
    b = a + np.array([length, 0.0, 0.0, 0.0])
    return Course(
        np.array([0, 1, 1 + span, 2 + span]), np.array([a, a, b, b]), np.zeros(4, int), ("a leg",), (-1,)
    )


@pytest.mark.parametrize("address", ["sim", "dry-run", "sim?noise=0.5,0.5&seed=3"])
def test_our_robots_conform(short_plan, address):
    assert len(check_robot(lambda: open_robot(address, short_plan))) == 10


class Deaf(DryRun):
    """Goes nowhere."""

    def send(self, target):
        return target


class Mover(DryRun):
    """Moves when it is connected."""

    def __enter__(self):
        super().__enter__()
        self.send(Target(1.0, self._pose + np.array([0.01, 0, 0, 0]), np.zeros(4)))
        return self


class Open(DryRun):
    """Says where it is after it was let go."""

    def _check(self):
        pass


@pytest.mark.parametrize(
    ("kind", "what"), [(Deaf, "goes where"), (Mover, "nothing moves"), (Open, "after it was let go")]
)
def test_robots_that_do_not_conform_are_named(short_plan, kind, what):
    home = home_of(short_plan)
    with pytest.raises(NotConforming, match=what):
        check_robot(lambda: kind(home))


def test_a_plan_is_run_and_replayed_from_its_log(short_plan, tmp_path):
    path = tmp_path / "run.csv"
    with open_robot("sim?start=0.5,-0.5,1", short_plan) as robot:
        done = run(short_plan, robot, log=path)
    assert done.outcome == DONE
    # The judge's own way: the fingers go as planned, from the same start.
    rolled = fp.simulate(
        replace(
            short_plan,
            scene=replace(
                short_plan.scene,
                start=tuple(short_plan.scene.start_pose + np.array([0.0005, -0.0005, math.radians(1)])),
            ),
        ),
        source="samples",
    )
    assert np.allclose(done.object, rolled.final_pose, atol=[5e-5, 5e-5, 1e-3])
    (recorded,) = load_robot_log(path).runs
    assert recorded.object == "triangle"
    assert set(recorded.actions) == {1}
    recording = Recording.of(recorded)
    segment = short_plan.pushes[0]
    plant = Plant(short_plan.scene.object, segment.fingers, short_plan.scene.pusher.tip_radius)
    again = replay(recording, plant, Registration())
    assert set(again.outcomes) == {""}
    assert np.allclose(again.final, done.object, atol=[1e-4, 1e-4, 3e-3])


def test_what_is_sent_is_the_plan_and_ends_on_time(short_plan):
    with DryRun([0.0, 0.0, 0.05, 0.0]) as robot:
        whole = way(short_plan, robot, 0.5)
        done = run(short_plan, robot, speed=0.5)
    first = next(k for k, cycle in enumerate(done.cycles) if cycle.leg.startswith("segment 0"))
    sent = np.array([cycle.target.pose for cycle in done.cycles[first - 1 :]])
    times = np.array([cycle.target.time for cycle in done.cycles[first - 1 :]])
    flat = np.concatenate([s.pusher for s in short_plan.segments])
    begins = np.cumsum([0.0, *(s.times[-1] for s in short_plan.segments)])
    knots = np.concatenate([b + s.times for b, s in zip(begins[:-1], short_plan.segments, strict=True)])
    begun = whole.duration - short_plan.duration / 0.5
    for column, k in ((0, 0), (1, 1), (3, 2)):
        wanted = np.interp((times - begun) * 0.5, knots, flat[:, k])
        assert np.max(np.abs(sent[:, column] - wanted)[1:]) < 1e-9
    # Every target's twist leads from the last one to it, but where a sample lies between.
    steps = np.diff(sent, axis=0) / 0.01
    twists = np.array([cycle.target.twist for cycle in done.cycles[first:]])
    assert np.median(np.linalg.norm((steps - twists)[:, :3], axis=1)) < 1e-9


def test_the_yaw_of_the_hand_is_taken_as_it_is(short_plan):
    """A hand that has turned twice does not turn back."""
    near = planned(short_plan, yaw=4 * math.pi + 0.1).poses[0, 3]
    assert abs(near - (4 * math.pi + 0.1)) <= math.pi
    assert (near - planned(short_plan).poses[0, 3]) / (2 * math.pi) == pytest.approx(
        round((near - planned(short_plan).poses[0, 3]) / (2 * math.pi))
    )


@pytest.mark.parametrize(
    ("limits", "rule"),
    [
        (
            {"speed": 0.05},
            r"segment \d \(transit\), \d+\.\d\d s: a speed of 1?\d\d\.\d mm/s is above 50 mm/s",
        ),
        ({"speed": 0.015}, r"a speed of .* is above 15 mm/s"),
        ({"acceleration": 0.05}, r"segment \d .* s: an acceleration of \d+ mm/s² is above 50 mm/s²"),
        ({"heights": (-0.001, 0.02)}, r"height of 30\.0 mm is outside of -1 to 20 mm"),
        ({"heights": (0.001, 0.3)}, r"segment 0 \(transit\), .* a height of .* is outside of 1 to 300 mm"),
        (
            {"workspace": (-1.0, -0.5, 1.0, -0.02)},
            r"segment 1 \(push long edge\), \d+\.\d\d s: y = -\d+\.\d mm is outside",
        ),
    ],
)
def test_what_a_robot_may_not_do_is_refused_before_the_first_command(short_plan, limits, rule):
    home = home_of(short_plan)

    class Counting(DryRun):
        sent = 0

        def send(self, target):
            self.sent += 1
            return super().send(target)

    with Counting(home, replace(Limits(), **limits)) as robot:
        with pytest.raises(OutOfLimits, match=rule):
            run(short_plan, robot)
        assert robot.sent == 0


class Straight:
    """An arm with one joint, that turns with x."""

    speeds = np.array([1.0])

    def unreachable(self, pose):
        return "the elbow is straight" if pose[2] == 0 else ""

    def joints(self, pose):
        return np.array([20 * pose[0]])

    def yaws(self, pose):
        return -math.inf, math.inf


def test_an_arm_says_where_it_cannot_go(short_plan):
    limits = replace(Limits(), arm=Straight())
    with (
        DryRun(home_of(short_plan), limits) as robot,
        pytest.raises(OutOfLimits, match="the elbow is straight"),
    ):
        way(short_plan, robot)


def test_joints_are_no_faster_than_they_can():
    """A joint that turns by 20 rad a metre and at most by 1 rad/s allows 50 mm/s."""
    poses = np.array([[0.0, 0.0, 0.01, 0.0], [0.01, 0.0, 0.01, 0.0], [0.02, 0.0, 0.01, 0.0]])
    limits = replace(Limits(), arm=Straight(), acceleration=100.0)
    course = Course(np.array([0.0, 0.201, 0.402]), poses, np.zeros(3, int), ("a reach",), (-1,))
    course.check(limits)
    quick = replace(course, times=np.array([0.0, 0.201, 0.4]))
    with pytest.raises(
        OutOfLimits, match=r"a reach, 0.40 s: the arm's first joint at 57.6 °/s is above 57.3 °/s"
    ):
        quick.check(limits)


def test_turns_are_limited():
    a, b = np.zeros(4), np.array([0.0, 0.0, 0.0, 1.0])
    course = Course(np.array([0.0, 0.5]), np.array([a, b]), np.zeros(2, int), ("a turn",), (-1,))
    course.check(replace(Limits(), turn_rate=2.01))
    with pytest.raises(OutOfLimits, match=r"a turn, 0.50 s: a turn rate of 114.6 °/s is above 114"):
        course.check(replace(Limits(), turn_rate=1.99))


def test_a_plan_that_fails_its_verification_is_not_run(short_plan):
    with DryRun([0.0, 0.0, 0.05, 0.0]) as robot, pytest.raises(Unverified, match="cost") as refused:
        run(replace(short_plan, cost=2 * short_plan.cost), robot)
    assert [claim.name for claim in refused.value.failed] == ["cost"]


def test_the_approach_goes_up_over_and_down_within_the_limits():
    pusher = fp.Pusher(fingers=2, spacing=0.02)
    course = approach(np.array([0.1, 0.0, 0.0, 3.0]), np.array([-0.1, 0.05, 0.01, -3.0]), 0.03, pusher, 0.01)
    x, z = course.poses[:, 0], course.poses[:, 2]
    assert np.all(z[np.abs(np.diff(x, prepend=x[0])) > 0] == 0.03)
    assert np.allclose(course.poses[-1, :3], [-0.1, 0.05, 0.01])
    assert course.poses[-1, 3] == -3.0  # no turn is taken off
    rates = np.diff(course.poses, axis=0) / np.diff(course.times)[:, None]
    assert np.max(np.linalg.norm(rates[:, :3], axis=1)) <= pusher.travel_speed + 1e-9
    assert np.max(np.abs(rates[:, 3])) <= pusher.turn_rate + 1e-9
    higher = approach(np.array([0.1, 0.0, 0.08, 0.0]), np.array([0.0, 0.0, 0.03, 0.0]), 0.03, pusher, 0.01)
    assert np.max(higher.poses[:, 2]) == 0.08
    still = approach(np.array([0.1, 0.0, 0.03, 0.0]), np.array([0.1, 0.0, 0.03, 0.0]), 0.03, pusher, 0.01)
    assert np.all(still.poses == [0.1, 0.0, 0.03, 0.0])


class Drifting(DryRun):
    """Not where it was sent."""

    def state(self):
        found = super().state()
        return replace(found, pose=found.pose + np.array([0, 0.02 * found.stamp, 0, 0]))


def test_a_tool_that_is_not_where_it_was_sent_ends_the_run():
    with Drifting([0.0, 0.0, 0.03, 0.0], replace(Limits(), deviation=0.01)) as robot:
        ended = stream(Played(straight(), 0.01), robot, robot.clock)
    assert "10.0 mm from where it was sent, more than 10 mm" in ended.outcome
    assert ended.cycles[-1].time == pytest.approx(0.49)


def test_a_tool_outside_of_its_workspace_ends_the_run():
    limits = replace(Limits(), workspace=(-1.0, -1.0, 1.0, 0.005), deviation=1.0)
    with Drifting([0.0, 0.0, 0.03, 0.0], limits) as robot:
        ended = stream(Played(straight(), 0.01), robot, robot.clock)
    assert ended.outcome.startswith("the tool is where it may not be: y = 7.0 mm")


def test_a_cycle_that_is_late_is_not_made_up_for():
    """The next targets come a period apart, however late one cycle was; so no target is farther than a period's way."""

    class Slow:
        def __init__(self, clock):
            self.clock, self.waits = clock, 0

        def now(self):
            return self.clock.now()

        def wait(self, until):
            self.waits += 1
            self.clock.wait(until + 0.035 * (self.waits == 120))

    with DryRun([0.0, 0.0, 0.03, 0.0]) as robot:
        ended = stream(Played(straight(), 0.01), robot, Slow(robot.clock))
    assert ended.outcome == DONE
    times = np.array([cycle.time for cycle in ended.cycles])
    assert np.diff(times).min() >= 0.005 - 1e-9
    assert max(cycle.late for cycle in ended.cycles) == pytest.approx(0.035)
    steps = np.diff([cycle.target.pose[0] for cycle in ended.cycles])
    assert np.max(steps) == pytest.approx(0.02 * 0.01)


def test_a_robot_that_fails_while_it_is_stopped_leaves_a_log(tmp_path):
    class Breaking(DryRun):
        def send(self, target):
            if self.clock.now() > 0.505:
                raise RobotFault("the cable is out")
            return super().send(target)

    path = tmp_path / "log.csv"
    with Breaking([0.0, 0.0, 0.0, 0.0]) as robot:
        ended = stream(Played(straight(start=(0, 0, 0, 0)), 0.01), robot, robot.clock, path)
    assert ended.outcome == "the cable is out"
    assert path.read_text().endswith("# ended: the cable is out\n")
    rows = load_robot_log(path).runs[0]
    assert rows.times[-1] == pytest.approx(0.5)
    assert np.median(np.diff(rows.times)) == pytest.approx(0.02)
    assert not np.any(rows.seen)


@pytest.mark.parametrize("ending", ["csv", "mcap"])
def test_a_full_disk_ends_the_run_and_its_log_is_read(tmp_path, ending):
    """Half a row stayed at the end of the file, and the error did not say of which."""
    if ending == "mcap":
        pytest.importorskip("mcap", reason=extra("export"))
    path, free = tmp_path / f"run.{ending}", resource.getrlimit(resource.RLIMIT_FSIZE)
    with DryRun([0.0, 0.0, 0.0, 0.0]) as robot:
        stopped, before = robot.stop, signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        stops: list[float] = []
        robot.stop = lambda: (stops.append(robot.clock.now()), stopped())
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000 if ending == "mcap" else 5_000, free[1]))
        try:
            ended = stream(Played(straight(start=(0, 0, 0, 0)), 0.01), robot, robot.clock, path)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, free)
            signal.signal(signal.SIGXFSZ, before)
    assert f"run.{ending}: this log cannot be written any more" in ended.outcome
    assert 0.2 < ended.cycles[-1].time < 2.0
    assert stops
    times = load_robot_log(path).runs[0].times if ending == "csv" else stamps(path)
    assert times[-1] == pytest.approx(ended.cycles[-1].time, abs=0.0301)
    short = tmp_path / f"at-once.{ending}"
    short.symlink_to("/dev/full")
    with pytest.raises(InputError, match=r"this log cannot be written \(no space left on device\)"):
        stream(Played(straight(start=(0, 0, 0, 0)), 0.01), robot, robot.clock, short)


def stamps(path):
    """Times of the targets in a bag [s]."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        messages = make_reader(file).iter_messages(["/flatpush/target"])
        return [message.log_time / 1e9 for _, _, message in messages]


@pytest.mark.parametrize("address", ["dry-run", "sim"])
def test_an_interrupt_stops_in_every_phase(short_plan, tmp_path, address):
    with open_robot(address, short_plan) as robot:
        assert interrupts(robot, short_plan, tmp_path, 1e-9) == PHASES


def test_bags_hold_standard_messages(tmp_path):
    reader = pytest.importorskip("mcap.reader", reason=extra("export"))
    typesys = pytest.importorskip("rosbags.typesys", reason=extra("export"))
    path = tmp_path / "log.mcap"
    left = []

    def told(cycle):
        # What a program that is killed now leaves.
        if len(left) < 20:
            left.append(path.read_bytes())

    with DryRun([0.0, 0.0, 0.03, 0.5]) as robot:
        ended = stream(Played(straight(start=(0, 0, 0.03, 0.5)), 0.01), robot, robot.clock, path, told)
    for count, data in enumerate(left, 1):
        messages = list(reader.make_reader(io.BytesIO(data)).iter_messages(topics=["/flatpush/tool"]))
        assert len(messages) == count
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    found = {}
    with path.open("rb") as file:
        for schema, channel, message in reader.make_reader(file).iter_messages():
            found.setdefault(channel.topic, []).append(store.deserialize_cdr(message.data, schema.name))
    targets = found["/flatpush/target"]
    assert len(targets) == len(ended.cycles)
    last, sent = targets[-1], ended.cycles[-1].target.pose
    assert (last.pose.position.x, last.pose.position.z) == (pytest.approx(sent[0]), pytest.approx(sent[2]))
    turned = 2 * math.atan2(last.pose.orientation.z, last.pose.orientation.w)
    assert turned == pytest.approx(0.5)
    assert last.header.stamp.sec + 1e-9 * last.header.stamp.nanosec == pytest.approx(ended.cycles[-1].time)
    assert found["/flatpush/state"][-1].data == DONE
    assert "/flatpush/object" not in found


@pytest.mark.slow
def test_a_controller_runs_on_a_robot(short_plan):
    law = PlanController.of(short_plan, "path", 50.0, stale=0.6, tolerance=(0.001, 0.01))
    unknown = Unknown(start=(0.002, -0.002, 0.03))
    with SimRobot(short_plan, unknown) as robot:
        eyes = SimulatedSensor(Camera(), np.random.default_rng(1))
        ended = run(short_plan, robot, law, eyes)
    assert ended.outcome == "arrived"
    off = ended.object[:2] - short_plan.scene.goal_pose[:2]
    assert np.hypot(*off) < 0.001
    assert "looking" in {cycle.mode for cycle in ended.cycles}
    # Open loop it ends beside the goal.
    with SimRobot(short_plan, unknown) as robot:
        blind = run(short_plan, robot)
    assert np.hypot(*(blind.object[:2] - short_plan.scene.goal_pose[:2])) > 0.001


def test_controllers_that_do_not_fit_are_refused(short_plan):
    with SimRobot(short_plan) as robot:
        law = PlanController.of(short_plan, "path", 60.0)
        with pytest.raises(fp.InputError, match=r"a tick of the controller .* Take 50 Hz"):
            run(short_plan, robot, law, SimulatedSensor(Camera(), np.random.default_rng(1)))
        with pytest.raises(fp.InputError, match="a controller needs eyes"):
            run(short_plan, robot, law)


def test_addresses():
    found = Address.parse(
        "egm://192.168.125.1:6510?workspace=-100,-200,300,400&speed=50", (0.4, 0, 0.02, 1.5)
    )
    assert (found.name, found.host, found.port) == ("egm", "192.168.125.1", 6510)
    limits = found.limits(Limits())
    assert limits.workspace == (-0.1, -0.2, 0.3, 0.4)
    assert limits.speed == 0.05
    assert Address.parse("dry-run?speed=9999").limits(Limits()).speed == Limits().speed  # never wider
    assert Address.parse("sim").options == {}
    with pytest.raises(fp.InputError, match="speed takes a number"):
        Address.parse("sim?speed=fast").limits(Limits())
    with pytest.raises(fp.InputError, match="no address of a robot"):
        Address.parse("egm://host:port")


def test_no_controller_sends_to_port_0(short_plan):
    """`egm://host:0` took the usual port without a word."""
    with pytest.raises(fp.InputError, match="a port from 1 to 65535"):
        egm(Address.parse("egm://127.0.0.1:0"), short_plan)


def test_robots_of_others_come_by_entry_points(short_plan, monkeypatch):
    import flatpush.execution.addresses as addresses

    class Point:
        name = "mine"

        def load(self):
            return lambda address, plan: DryRun([0, 0, address.numbers("z", 1, (0,))[0], 0])

    monkeypatch.setattr(
        addresses, "entry_points", lambda group: [Point()] if group == "flatpush.robots" else []
    )
    with open_robot("mine://?z=0.1", short_plan) as robot:
        assert robot.state().pose[2] == 0.1
    with pytest.raises(fp.InputError, match=r"There are: dry-run, egm, franka, mine, mujoco, sim, ur"):
        open_robot("yours", short_plan)


def test_tools_that_change_between_pushes_are_refused(short_plan):
    other = replace(short_plan.pushes[0], push="long edge", fingers=np.array([[0.0, 0.01], [0.0, -0.01]]))
    with pytest.raises(fp.InputError, match="A robot holds one tool"):
        planned(replace(short_plan, segments=(*short_plan.segments, other)))
    for speed in (0.0, 1.5, math.nan):
        with pytest.raises(fp.InputError, match="at most 1 times its speed"):
            planned(short_plan, speed)
