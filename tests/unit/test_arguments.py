"""Whatever a public function takes as a number: words, truth values and the like are refused as bad input."""

from collections.abc import Callable

import numpy as np
import pytest

import flatpush as fp
from flatpush.errors import InputError

CORNERS = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
FEET = fp.Support.points([(-0.02, -0.01), (0.02, -0.01), (0, 0.02)])
EXACT, ELLIPSOID = fp.Exact(FEET.centred()), fp.Ellipsoid(np.diag([1.0, 1.0, 5000.0]))
QUARTIC = fp.Quartic([1, 1, 1, 0, 0, 0, 0, 0, 0, 2, 2, 2, 0, 0, 0])
CONTACT = fp.PointContact([0, -0.012], [0, 1], 0.3)
THING = fp.Object(CORNERS)
FLAT = fp.flat_output(CONTACT, ELLIPSOID)
WRENCHES = np.random.default_rng(0).normal(size=(20, 3)).tolist()
TWISTS = (np.array(WRENCHES) @ ELLIPSOID.matrix).tolist()
CALLS: dict[str, Callable[[object], object]] = {
    "shortest_path start": lambda x: fp.dubins.shortest_path((0, 0, x), (1, 0, 0), 1.0),
    "shortest_path goal": lambda x: fp.dubins.shortest_path((0, 0, 0), (1, x, 0), 1.0),
    "shortest_path radius": lambda x: fp.dubins.shortest_path((0, 0, 0), (1, 0, 0), x),
    "shortest_length starts": lambda x: fp.dubins.shortest_length([0, 0, x], [(1, 0, 0)], 1.0),
    "shortest_length radius": lambda x: fp.dubins.shortest_length([0, 0, 0], [(1, 0, 0)], x),
    "Support.points xy": lambda x: fp.Support.points([(0, x), (1, 0), (0, 2)]),
    "Support.points weights": lambda x: fp.Support.points([(0, 0), (1, 0), (0, 2)], [1, x, 1]),
    "Support.polygon": lambda x: fp.Support.polygon([(0, 0), (x, 0), (0, 1)]),
    "Support.outline": lambda x: fp.Support.outline([(0, 0), (x, 0), (0, 1)]),
    "Support.disc": lambda x: fp.Support.disc(x),
    "Support.ring": lambda x: fp.Support.ring(1.0, (0, x)),
    "Support.wrench twist": lambda x: FEET.wrench((1, x, 2)),
    "Support.wrench friction": lambda x: FEET.wrench((1, 0, 2), friction=x),
    "Support.wrench load": lambda x: FEET.wrench((1, 0, 2), load=x),
    "Exact.twist": lambda x: EXACT.twist((1, x, 0.01)),
    "Exact.wrench": lambda x: EXACT.wrench((1, x, 0.01)),
    "Ellipsoid": lambda x: fp.Ellipsoid([[1, 0, 0], [0, x, 0], [0, 0, 1]]),
    "Ellipsoid.twist": lambda x: ELLIPSOID.twist((1, x, 0.01)),
    "Ellipsoid.wrench": lambda x: ELLIPSOID.wrench((1, x, 0.01)),
    "Quartic": lambda x: fp.Quartic([x, 1, 1] + [0] * 12),
    "Quartic.twist": lambda x: QUARTIC.twist((1, x, 0.01)),
    "Quartic.wrench": lambda x: QUARTIC.wrench((1, x, 0.01)),
    "fit_ellipsoid": lambda x: fp.fit_ellipsoid([[x, 1, 1], *WRENCHES], [[1, 1, 1], *TWISTS]),
    "fit_quartic": lambda x: fp.fit_quartic(WRENCHES, [[x, 1, 1], *TWISTS[1:]]),
    "PointContact point": lambda x: fp.PointContact([0, x], [0, 1], 0.3),
    "PointContact normal": lambda x: fp.PointContact([0, -0.01], [0, x], 0.3),
    "PointContact friction": lambda x: fp.PointContact([0, -0.01], [0, 1], x),
    "PointContact.motion": lambda x: CONTACT.motion(ELLIPSOID, [0.002, x]),
    "flat_output along": lambda x: fp.flat_output(CONTACT, ELLIPSOID, along=x),
    "FlatOutput.position": lambda x: FLAT.position([0, 0, x]),
    "FlatOutput.recover": lambda x: FLAT.recover([0, 0], [1, x], [0, 0]),
    "two_point_sticks": lambda x: fp.two_point_sticks([CONTACT, CONTACT], ELLIPSOID, (0.01, x, 0.2)),
    "Outline.polygon": lambda x: fp.Outline.polygon([(x, 0), (1, 0), (0, 1)]),
    "Outline.circle": lambda x: fp.Outline.circle(x),
    "Outline.at edge": lambda x: THING.outline.at(x, 0.5),
    "Outline.at along": lambda x: THING.outline.at(0, x),
    "Object outline": lambda x: fp.Object([(x, 0), (1, 0), (0, 1)]),
    "Object friction": lambda x: fp.Object(CORNERS, friction=x),
    "Uncertainty loads": lambda x: fp.Uncertainty(x),
    "Uncertainty friction": lambda x: fp.Uncertainty(friction=(0.1, x)),
    "Uncertainty offset": lambda x: fp.Uncertainty(offset=x),
    "Pusher fingers": lambda x: fp.Pusher(fingers=x),
    "Pusher spacing": lambda x: fp.Pusher(fingers=2, spacing=x),
    "Pusher speed": lambda x: fp.Pusher(speed=x),
    "Push fingers": lambda x: fp.Push("a", THING.outline.at(0, 0.5), x),
    "Push spacing": lambda x: fp.Push("a", THING.outline.at(0, 0.5), 2, x),
    "Scene start": lambda x: fp.Scene(THING, (0, 0, x)),
    "Scene goal": lambda x: fp.Scene(THING, (0, 0, 0), (0, x, 0)),
    "Workspace bounds": lambda x: fp.Workspace((-1, -1, x, 1)),
    "Workspace obstacles": lambda x: fp.Workspace(None, [[(x, 0), (2, 0), (0, 2)]]),
    "Planning friction_margin": lambda x: fp.Planning(friction_margin=x),
    "Planning clearance": lambda x: fp.Planning(clearance=x),
    "Planning switch_cost": lambda x: fp.Planning(switch_cost=x),
    "Planning goal_tolerance": lambda x: fp.Planning(goal_tolerance=(1, x, 1)),
    "Planning seed": lambda x: fp.Planning(seed=x),
    "Planning iterations": lambda x: fp.Planning(iterations=x),
    "Planning time_limit": lambda x: fp.Planning(time_limit=x),
    "Noise": lambda x: fp.Noise(x),
    "Noise friction_range": lambda x: fp.Noise(friction_range=(0, x)),
    "Noise df": lambda x: fp.Noise(df=x),
}


@pytest.mark.parametrize("value", ["1", "x", True, np.True_, 1 + 2j, float("nan"), [0.1], {}], ids=repr)
@pytest.mark.parametrize("name", CALLS)
def test_what_is_no_number_is_refused(name, value):
    with pytest.raises(InputError):
        CALLS[name](value)


@pytest.mark.parametrize("value", [1, 1.0, np.float32(1), np.int64(1)], ids=repr)
def test_every_kind_of_real_number_is_one(value):
    assert fp.dubins.shortest_path((0, 0, 0), (value, 0, 0), value).length == pytest.approx(1.0)
    assert fp.Support.disc(value).radius == 1.0
    assert fp.Pusher(fingers=1, speed=value).speed == 1
    assert fp.Scene(THING, (0, 0, value)).start_pose[2] == 1.0


@pytest.mark.parametrize("call", [fp.plan, fp.verify, fp.simulate])
def test_the_path_of_a_file_is_told_what_reads_it(call):
    kind = "scene" if call is fp.plan else "plan"
    with pytest.raises(InputError, match=rf"fp\.load_{kind}"):
        call("a.json")
