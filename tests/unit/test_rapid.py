"""The RAPID module, read again by a small reader of ours: the way of the tool and its times, against the plan."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest

import flatpush as fp
from flatpush.documents import export_rapid
from flatpush.geometry import wrap_angle

NUMBER = r"-?[0-9.]+(?:[eE][-+]?[0-9]+)?"
POSE = re.compile(
    rf"MoveL \[\[({NUMBER}),({NUMBER}),({NUMBER})\],\[({NUMBER}),({NUMBER}),({NUMBER}),({NUMBER})\],"
)
TIME = re.compile(rf"\\T:=({NUMBER}), (z0|fine)")


def read(path):
    """Times, poses (x, y, height, yaw) in m and rad, which stop, and the work object's frame."""
    text = path.read_text(encoding="ascii")
    assert text.startswith("MODULE flatpush\n")
    assert text.endswith("  ENDPROC\nENDMODULE\n")
    frame = re.search(r"wobjdata flatpush_table:=\[FALSE,TRUE,\"\",\[\[(.*?)\],\[(.*?)\]\]", text)
    place, turn = ([float(v) for v in group.split(",")] for group in frame.groups())
    time, times, poses, stops = 0.0, [], [], []
    for line in text.splitlines():
        if (found := POSE.search(line)) is None:
            assert "MoveL" not in line
            continue
        assert line.endswith(" flatpush_tool \\WObj:=flatpush_table;")
        x, y, z, *turned = (float(v) for v in found.groups())
        assert np.linalg.norm(turned) == pytest.approx(1, abs=1e-7)
        assert turned[0] == turned[3] == 0
        if (lasts := TIME.search(line)) is not None:
            time += float(lasts[1])
        elif poses:  # down to the first pose
            times, poses, stops = [], [], []
        yaw = 2 * math.atan2(turned[2], turned[1])
        times.append(time)
        poses.append([x / 1000, y / 1000, z / 1000, yaw])
        stops.append(lasts is None or lasts[2] == "fine")
    return np.array(times), np.array(poses), stops, (np.array(place) / 1000, turn)


def test_the_moves_make_the_plans_way_in_its_time(triangle, tmp_path):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    plan = fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))
    path = tmp_path / "push.mod"
    count = export_rapid(plan, path, (0.4, -0.1, 0.02, 0.3))
    times, poses, stops, (place, turn) = read(path)
    assert len(times) == count + 1
    assert place == pytest.approx([0.4, -0.1, 0.02])
    assert turn == pytest.approx([math.cos(0.15), 0, 0, math.sin(0.15)])
    assert times[-1] == pytest.approx(plan.duration, abs=1e-3)
    poses = np.unwrap(poses, axis=0, period=2 * np.pi)
    share = np.linspace(0, 1, 200)[:, None]
    begin, most = 0.0, 0
    for segment in plan.segments:
        # At rest between segments the arm stops.
        first, last = (int(np.argmin(np.abs(times - t))) for t in (begin, begin + segment.times[-1]))
        assert times[last] == pytest.approx(begin + segment.times[-1], abs=2e-4)
        assert stops[last]
        way = np.concatenate([(1 - share) * a + share * b for a, b in pairwise(poses[first : last + 1])])
        height = getattr(segment, "height", np.zeros(len(segment.times)))
        for place, high in zip(segment.pusher, height, strict=True):
            off = way - [place[0], place[1], high, place[2]]
            off[:, 3] = wrap_angle(off[:, 3])
            assert np.min(np.linalg.norm(off * [1, 1, 1, 0.03], axis=1)) < 1e-4
        begin, most = begin + segment.times[-1], most + len(segment.times)
    assert count < most / 4


def test_a_plan_that_was_not_verified_says_so(triangle, tmp_path):
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    plan = fp.plan(
        fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=fp.Pusher(fingers=2, spacing=0.018), pushes=pushes)
    )
    export_rapid(plan, tmp_path / "push.mod", unverified="cost\nENDMODULE")
    assert "  ! NOT VERIFIED: cost ENDMODULE\n" in (tmp_path / "push.mod").read_text()
