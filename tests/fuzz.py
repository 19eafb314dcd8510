"""Random scenes are planned, verified and exported, and what was exported is checked by itself.

    python tests/fuzz.py N SEED

Plans the scenes SEED .. SEED + N - 1 of benchmarks/random_scenes.py. The check knows the scene, the CSV file and the
object's samples in the plan file, and uses nothing of flatpush: shapely at every 0.1 mm for object and fingertips
against obstacles, bounds and each other; differences of the rows for speed, acceleration, turn rate and heights;
matrix exponentials of the arcs for the goal. Besides, the simulator executes the samples of plans for two fingers.
Prints what is wrong and ends with status 1 if anything is.
"""

import csv
import json
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.linalg import expm

import flatpush as fp

Array = NDArray[np.float64]
STEP = 1e-4  # between places that are looked at [m]
# Straight lines stay within 0.05 mm of the arcs that were proved, and the clearance of those is known to 10 µm [m].
NEAR = 6e-5
LIMIT = 1 + 1e-6
# Two fingers with such a reserve of friction slip nowhere; what is executed ends so near to the plan [m, rad].
RESERVE, BESIDE, BESIDE_ANGLE = 0.02, 5e-5, np.deg2rad(0.05)
# Half a unit of the last place that the file has, and the rounding of places of up to a metre [m, rad; s].
ROUNDING, TICK = 4e-16, 1e-16


def faults(document: dict[str, Any], folder: Path) -> tuple[str, list[str]]:
    """The outcome of planning a scene document, and all that is wrong with it."""
    scene_file = folder / "scene.json"
    scene_file.write_text(json.dumps(document))
    try:
        plan = fp.plan(fp.load_scene(scene_file))
        if plan.status != "solved":
            return plan.status, [] if plan.reason else ["no plan, and no reason"]
        document, rows = exported(plan, folder)
        saved = fp.load_plan(folder / "plan.json")
        report, slipped = fp.verify(saved, fp.load_scene(scene_file)), list(executed(saved))
    except Exception:  # whatever it is, it is what is looked for
        return "exception", [traceback.format_exc()]
    wrong = [f"verify: {c.name}: {c.rule}" for c in report.failed]
    return plan.status, wrong + slipped + list(check(document, rows))


def executed(plan: fp.Plan) -> Iterator[str]:
    """Where two fingers with a reserve, straight from sample to sample, take the object elsewhere than the plan says.

    On the table that was planned for: another model is another table, and the certificate warns of it.
    """
    if not plan.pushes or plan.scene.pusher.fingers != 2 or plan.scene.planning.friction_margin < RESERVE:
        return
    end = fp.simulate(plan, source="samples", model=plan.scene.planning.model).final_pose
    x, y, angle = end - plan.pushes[-1].object[-1]
    angle = (angle + np.pi) % (2 * np.pi) - np.pi
    if np.hypot(x, y) > BESIDE or abs(angle) > BESIDE_ANGLE:
        yield f"executed, it ends {1e3 * np.hypot(x, y)} mm and {np.rad2deg(angle)}° beside the plan"


def exported(plan: fp.Plan, folder: Path) -> tuple[dict[str, Any], Array]:
    """The plan document that is saved of a plan, and the rows of the file that is exported of it."""
    from flatpush.documents import export_csv, load_plan

    plan.save(folder / "plan.json")
    export_csv(load_plan(folder / "plan.json"), folder / "robot.csv")
    with open(folder / "robot.csv", newline="") as file:
        rows = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    return json.loads((folder / "plan.json").read_text()), rows


def check(plan: dict[str, Any], rows: Array) -> Iterator[str]:
    """What is wrong with an exported file: rows of t, x, y, z, yaw, segment."""
    t, hand, z = rows[:, 0], rows[:, [1, 2, 4]], rows[:, 3]
    pusher, segments = plan["scene"]["pusher"], plan["segments"]
    if np.any(np.diff(t) <= 0) or abs(t[-1] - plan["duration"]) > 1e-9:
        yield "the times of the file do not increase to the duration of the plan"
        return
    if segments[0]["kind"] != "transit" or segments[-1]["kind"] != "transit":
        yield "the pusher does not land first and leave last"
    ends = np.cumsum([s["times"][-1] for s in segments])
    turn_rate = np.abs(np.diff(hand[:, 2])) / np.diff(t)
    if np.max(turn_rate) > pusher["turn_rate"] * LIMIT:
        yield f"turn rate {np.max(turn_rate)} at row {np.argmax(turn_rate)}"
    yield from heights(hand, z, pusher["lift"])
    fingers = [f for s in segments if s["kind"] == "push" for f in s["fingers"]]
    for finger in {tuple(f) for f in fingers}:
        yield from limits(t, np.column_stack([moved(hand, np.array([finger]))[:, 0], z]), pusher)
    at, objects = object_samples(plan)
    yield from places(plan, rows, np.column_stack([np.interp(t, at, column) for column in objects.T]), ends)
    yield from goal(plan)


def moved(poses: Array, points: Array) -> Array:
    """Points of a frame in W, shape (poses, points, 2)."""
    c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x, y = points[:, 0], points[:, 1]
    return np.stack([poses[:, :1] + c * x - s * y, poses[:, 1:2] + s * x + c * y], axis=2)


def heights(hand: Array, z: Array, lift: float) -> Iterator[str]:
    if np.min(z) < 0 or np.max(z) > lift + 1e-9:
        yield f"heights from {np.min(z)} to {np.max(z)}"
    between = (np.maximum(z[1:], z[:-1]) > 0) & (np.minimum(z[1:], z[:-1]) < lift - 1e-9)
    aside = np.max(np.abs(np.diff(hand, axis=0)[between]), initial=0.0)
    if aside > 1e-9:
        yield f"moves by {aside} on the way up or down"


def limits(t: Array, tips: Array, pusher: dict[str, float]) -> Iterator[str]:
    """Speed and acceleration of a fingertip, from rest to rest."""
    dt, lifted = np.diff(t), np.maximum(tips[1:, 2], tips[:-1, 2]) > 0
    v = np.diff(tips, axis=0) / dt[:, None]
    wrong = 2 * ROUNDING / dt + np.linalg.norm(v, axis=1) * TICK / dt
    speed = (np.linalg.norm(v, axis=1) - wrong) / np.where(lifted, pusher["travel_speed"], pusher["speed"])
    if np.max(speed) > LIMIT:
        yield f"fingertip speed {np.max(speed)} of the limit at row {np.argmax(speed)}"
    gain = np.where(lifted, pusher["travel_acceleration"], pusher["acceleration"]) * dt
    v, gain, wrong = (np.concatenate([0 * a[:1], a, 0 * a[:1]]) for a in (v, gain, wrong))
    change = np.linalg.norm(np.diff(v, axis=0), axis=1) - wrong[1:] - wrong[:-1]
    ratio = change / (0.5 * (gain[1:] + gain[:-1]))
    if np.max(ratio) > LIMIT:
        yield f"fingertip acceleration {np.max(ratio)} of the limit at row {np.argmax(ratio)}"


def object_samples(plan: dict[str, Any]) -> tuple[Array, Array]:
    """Times and poses of the object through the plan, at rest in transits."""
    times, poses, clock = [0.0], [plan["scene"]["start"]], 0.0
    for segment in plan["segments"]:
        if segment["kind"] == "push":
            times += [clock + t for t in segment["times"]]
            poses += segment["object"]
        clock += segment["times"][-1]
        times.append(clock)
        poses.append(poses[-1])
    return np.array(times), np.array(poses)


def places(plan: dict[str, Any], rows: Array, objects: Array, ends: Array) -> Iterator[str]:
    """Object and fingertips at every 0.1 mm: on each other in pushes, off in transits, and clear of all else."""
    scene = plan["scene"]
    outline, tip = scene["object"]["outline"], scene["pusher"]["tip_radius"]
    disc = isinstance(outline, dict)
    centre = np.array(outline.get("centre", [0.0, 0.0])) if disc else np.zeros(2)
    corners = np.array([centre]) if disc else np.array(outline)
    radius = outline["circle"] if disc else 0.0
    shape = shapely.Point(centre) if disc else shapely.Polygon(corners)
    shapely.prepare(shape)
    work = scene.get("workspace", {})
    need = scene["planning"]["margin"]["clearance"]
    obstacles = shapely.MultiPolygon([shapely.Polygon(o) for o in work.get("obstacles", [])])
    bounds = work.get("bounds") or [-np.inf, -np.inf, np.inf, np.inf]
    pushes = [s for s in plan["segments"] if s["kind"] == "push"]
    fingers = np.array(pushes[0]["fingers"])
    yaws = np.unwrap(objects[:, 2])
    if np.any(np.diff(np.asarray(objects[:, 2])) != np.diff(yaws)):
        yield "the object's angle jumps"
    reach = np.max(np.linalg.norm(corners, axis=1)) + radius
    for k, segment in enumerate(plan["segments"]):
        first = max(0, int(np.searchsorted(rows[:, 0], (ends[k] - segment["times"][-1]) - 1e-9)))
        last = int(np.searchsorted(rows[:, 0], ends[k] - 1e-9))
        part = slice(first, last + 1)
        if segment["kind"] == "push":
            fingers = np.array(segment["fingers"])
        else:
            after = [s for s in plan["segments"][k:] if s["kind"] == "push"]
            if len(after) and len(after[0]["fingers"]) > len(fingers):
                fingers = np.array(after[0]["fingers"])
        both = np.column_stack([objects[part], rows[part][:, [1, 2, 4]], rows[part, 3]])
        both = dense(both, max(reach, float(np.max(np.linalg.norm(fingers, axis=1)))))
        things, hands, height = both[:, :3], both[:, 3:6], both[:, 6]
        label = f"segment {k} ({segment['kind']})"
        # From here on as seen from the object, which costs no polygon for each place.
        for finger in fingers:
            tips = moved(hands, finger[None])[:, 0]
            local = tips - things[:, :2]
            c, s = np.cos(things[:, 2]), np.sin(things[:, 2])
            local = np.column_stack([c * local[:, 0] + s * local[:, 1], -s * local[:, 0] + c * local[:, 1]])
            gap = shapely.distance(shape, shapely.points(local)) - radius - tip
            low = height < scene["pusher"]["lift"] - 1e-9
            if np.min(gap, where=low, initial=np.inf) < (-1e-8 if segment["kind"] == "transit" else -NEAR):
                yield f"{label}: a fingertip {-1e3 * np.min(gap[low])} mm in the object"
            if segment["kind"] == "push" and np.max(gap) > NEAR:
                yield f"{label}: a fingertip {1e3 * np.max(gap)} mm off the object"
            free = np.minimum(tips - bounds[:2], np.array(bounds[2:]) - tips).min(axis=1)
            if not obstacles.is_empty:
                near = shapely.distance(obstacles, shapely.points(tips))
                free = np.minimum(free, np.where(low, near, np.inf))
            if np.min(free) - tip < need - NEAR:
                yield f"{label}: a fingertip has {1e3 * (np.min(free) - tip)} mm, needs {1e3 * need}"
        if segment["kind"] == "push":
            outlines = moved(things, corners)
            solid = outlines - radius, outlines + radius
            free = np.minimum(solid[0].min(axis=1) - bounds[:2], bounds[2:] - solid[1].max(axis=1)).min()
            if not obstacles.is_empty:
                shapes = shapely.points(outlines[:, 0]) if disc else shapely.polygons(outlines)
                free = min(free, np.min(shapely.distance(obstacles, shapes)) - radius)
            if free < need - NEAR:
                yield f"{label}: the object has {1e3 * free} mm, needs {1e3 * need}"


def dense(poses: Array, reach: float) -> Array:
    """Straight from row to row, so that nothing moves further than STEP."""
    step = np.abs(np.diff(poses, axis=0))
    travel = np.hypot(step[:, 0], step[:, 1]) + np.hypot(step[:, 3], step[:, 4])
    travel += (step[:, 2] + step[:, 5]) * reach + step[:, 6]
    count = np.maximum(1, np.ceil(travel / STEP)).astype(int)
    which = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / count[which]
    inner = poses[which] + share[:, None] * (poses[which + 1] - poses[which])
    return np.concatenate([inner, poses[-1:]])


def goal(plan: dict[str, Any]) -> Iterator[str]:
    """Whether the arcs end at the goal."""

    def matrix(x: float, y: float, angle: float) -> Array:
        return np.array([[np.cos(angle), -np.sin(angle), x], [np.sin(angle), np.cos(angle), y], [0, 0, 1]])

    X = matrix(*plan["scene"]["start"])
    for segment in plan["segments"]:
        for arc in segment.get("arcs", []):
            x, y, w = np.array(arc["twist"]) * arc["duration"]
            X = X @ expm(np.array([[0, -w, x], [w, 0, y], [0, 0, 0]]))
    x, y, angle = plan["scene"]["goal"]
    turned = np.arctan2(X[1, 0], X[0, 0]) - (0.0 if angle == "free" else angle)
    error = [abs(X[0, 2] - x), abs(X[1, 2] - y), abs((turned + np.pi) % (2 * np.pi) - np.pi)]
    error[2] *= angle != "free"
    if np.any(np.array(error) > plan["scene"]["planning"]["goal_tolerance"]):
        yield f"ends {error} from the goal"


def random_scene(seed: int) -> dict[str, Any]:
    spec = spec_from_file_location("random_scenes", Path(__file__).parents[1] / "benchmarks/random_scenes.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.scene(seed)  # type: ignore[no-any-return]


def main(count: int, first: int) -> int:
    """Prints the faults of scenes; 1 if there are any."""
    outcomes: Counter[str] = Counter()
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            outcome, found = faults(random_scene(seed), Path(folder))
            outcomes[outcome] += 1
            wrong += bool(found)
            for fault in found:
                print(f"scene {seed}: {fault}", flush=True)
    print(f"{count} scenes from {first}: {dict(outcomes)}, {wrong} with faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
