"""Recorded runs as the page plays them: where object and pusher were, and what the pusher did."""

import os
from pathlib import Path

import numpy as np

from ..documents.motion_file import bag_messages
from ..documents.robot_log import RobotRun, load_robot_log
from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Plan, Push, Scene
from ..view import palette
from ..view.table import MM
from .plain import plain

LOGS = ".csv", ".mcap", ".txt"
OBJECT, TOOL, SAID = "/flatpush/object", "/flatpush/tool", "/flatpush/state"
PUSH = "(push "  # before the name of a push in what a run says
ACTION = "action "  # before the number of a push that the scene does not know
ON_TABLE = 0.0005  # a tool lower than this is on the table [m]
MOST_ROWS, MOST_RUNS = 3000, 40  # that the page is told


def recorded(path: str | os.PathLike[str], scene: Scene, plan: Plan | None = None) -> list[dict[str, object]]:
    """The runs of a log of `flatpush run` (.csv or .mcap) or of a robot that was recorded, in the order of the file.

    Args:
        scene: of the object that was pushed.
        plan: that was run, if it is known: which fingers pushed when.

    Returns:
        for each run its name, how it ended, and its motion as view.page.plan_data has that of a plan.

    Raises:
        InputError: for what is no such log.
    """
    source = os.fspath(path)
    if Path(source).suffix.lower() == ".mcap":
        runs = [_from_bag(source)]
    else:
        text = Path(source).read_text(encoding="utf-8", errors="replace") if os.path.isfile(source) else ""
        said = [line for line in text.splitlines() if line.startswith("# ended: ")]
        ended = said[-1].removeprefix("# ended: ") if said else ""
        runs = [(run.name, ended, *_rows(run, scene)) for run in load_robot_log(path).runs[:MOST_RUNS]]
    return [
        {"name": name, "outcome": outcome, "motion": _motion(rows, names, scene, plan)}
        for name, outcome, rows, names in runs
    ]


def _rows(run: RobotRun, scene: Scene) -> tuple[Array, list[str]]:
    """Times, object, hand and height (n, 8), and the name of what goes on at each."""
    if not run.seen.any():
        raise InputError("the camera never saw the object in this run", value=run.name)
    poses = run.poses[_last(run.seen)]
    rows = np.column_stack([run.times, poses, run.hands, np.zeros(len(run.times))])
    # A run of ours counts the pushes of its scene from 1; others count as they like.
    pushes = [f"{PUSH}{push.name})" for push in scene.pushes if isinstance(push, Push)]
    return rows, [pushes[k - 1] if 0 < k <= len(pushes) else f"{ACTION}{k}" for k in run.actions.tolist()]


def _from_bag(source: str) -> tuple[str, str, Array, list[str]]:
    """At every pose of the tool the newest of the object, and what was said last."""
    times, tools, objects, names = list[float](), list[list[float]](), list[list[float] | None](), list[str]()
    seen: list[float] | None = None
    said = outcome = ""
    for topic, stamp, pose, text in bag_messages(source, (OBJECT, TOOL, SAID)):
        if topic == SAID:
            outcome, said = text, text
        elif topic == OBJECT:
            seen = pose[:3]
        if topic != TOOL:  # of the same cycle, behind the tool
            if times and times[-1] == stamp:
                objects[-1] = seen
                names[-1] = names[-1] or said.rsplit(":", 1)[0]
        else:
            times.append(stamp)
            tools.append(pose)
            objects.append(seen)
            names.append(said.rsplit(":", 1)[0])
    known = np.array([pose is not None for pose in objects], dtype=bool)
    if len(times) < 2 or not known.any():
        raise InputError(f"the bag holds no poses on {OBJECT} and {TOOL}", source=source)
    poses = np.array([pose or [0.0, 0.0, 0.0] for pose in objects])[_last(known)]
    rows = np.column_stack([np.array(times) - times[0], poses, np.array(tools)])
    return Path(source).stem, outcome, rows, names


def _last(known: np.ndarray) -> np.ndarray:
    """Number of the last row that is known, for every row; before the first that one."""
    rows = np.where(known, np.arange(len(known)), -1)
    return np.maximum(np.maximum.accumulate(rows), int(np.argmax(known)))


def _motion(rows: Array, names: list[str], scene: Scene, plan: Plan | None) -> dict[str, object]:
    step = -(-len(rows) // MOST_ROWS)
    rows, names = rows[::step], names[::step]
    rows[:, 3], rows[:, 6] = np.unwrap(rows[:, 3]), np.unwrap(rows[:, 6])
    first = [k for k, name in enumerate(names) if k == 0 or name != names[k - 1]]
    lengths = np.diff([*first, len(names)])
    pushes = list[str]()
    segments = list[dict[str, object]]()
    for k, length in zip(first, lengths.tolist(), strict=True):
        text = names[k]
        low = rows[k : k + length, 7].min() < ON_TABLE and (PUSH in text or text.startswith(ACTION))
        push = text.partition(PUSH)[2][:-1] if PUSH in text else text
        if low and push not in pushes:
            pushes.append(push)
        number = pushes.index(push) if low else -1
        segments.append({
            "start": round(float(rows[k, 0]), 4), "push": push if low else None, "number": number + 1,
            "colour": palette.push_colour(max(number, 0)), "text": text.removeprefix(PUSH).removesuffix(")"),
            "flat": None, "turns": [], "tips": plain(MM * _fingers(scene, plan, push), 3),
        })  # fmt: skip
    return {
        "times": plain(rows[:, 0], 4),
        "object": plain(rows[:, 1:4] * [MM, MM, 1.0], 4),
        "pusher": plain(rows[:, 4:7] * [MM, MM, 1.0], 4),
        "height": plain(MM * rows[:, 7], 2),
        "segment": np.repeat(np.arange(len(first)), lengths).tolist(),
        "segments": segments,
    }


def _fingers(scene: Scene, plan: Plan | None, name: str) -> Array:
    """Fingertips in E of a push of this name, or of the scene's pusher."""
    for push in () if plan is None else plan.pushes:
        if push.push == name:
            return push.fingers
    half = 0.5 * scene.pusher.spacing
    return np.array([[0.0, half], [0.0, -half]] if scene.pusher.fingers == 2 else [[0.0, 0.0]])
