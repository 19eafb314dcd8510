"""Whether two checkouts of flatpush give the same answers: the guard of every change of how the program is built.

    python benchmarks/same_answers.py OLD NEW [--scenes N] [--first K] [--no-examples]

OLD and NEW are folders of checkouts; their dependencies are those of this Python. Each plans the examples and N random
scenes (`random_scenes.py`, by iterations and not by the clock) in one process and simulates what it planned. Status,
words, pushes, cost, certificate, simulated end and outcome are compared: numbers within 1e-9 (absolute below one,
relative above). Every difference is printed with its scene and field; the exit status is 1 if there is one. What a
clean commit answered is kept in the system's folder for temporary files, scene by scene, and not computed again. A
scene that takes one of them more than two minutes is left out of the comparison, and said.

What differs from commit 96bcf2f (random scenes 0 to 22: all are solved by both, all differ), and why:
* Margins are what the scene asks for: the least of friction_margin and spacing_margin is the scene's margin. Old
  plans kept less (scene 4: 0.108 of 0.19, so that the new one is 9 % dearer; 5, 6, 7, 13, 16 alike) or another part
  (1, 8, 11, 12, 14: from 0.8 % cheaper to 0.3 % dearer now). The centres of the cars follow, and so do the simulated
  ends where the plan is made with another model than the exact one.
* `iterations` count otherwise, among obstacles and for many pushes: 300, as here, once were thousands of poses and now
  are a glance. Scenes that are dearer for that cost at the default of 10000, against the old plans: 0: -0.7 %,
  2: +0.3 %, 5: -1.3 %, 10: -44 %, 16: -26 %, 17: +0.4 %, each in less than a second.
* Push points of a circle stand at the points of the compass instead of at angles of their own. All places of a circle
  are equal, but not for one query: scene 9 is 12 % dearer at 10000 iterations.
* Lifted hands travel at travel_speed: plans take less time, by a quarter where they are short, and cost so much less
  where the cost is time (3, 15, 19, 20, 21).
* Every example is cheaper (maze.yaml by half) but for triangle_one_finger.yaml, 0.07 % dearer.
* motion_cone_margin_degrees and curvature_margin of two fingers end on the cone's edge; they ended up to 4e-5° and 6e-8
  short of it.
* Sides of outlines of many corners are named by the compass; None stands for what was -9; numbers in warnings follow.
"""

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

TOLERANCE = 1e-9
PATIENCE = 120  # of a scene [CPU s], compiling included; old commits took hours for some
HERE = Path(__file__).parent
SLOW = "took too long"


def answer(scene: object) -> dict[str, object]:
    """What the flatpush of this process answers to a scene document or the path of one; runs inside a checkout."""
    import flatpush as fp
    from flatpush.errors import FlatpushError

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scene.json")
        if isinstance(scene, dict):
            file.write_text(json.dumps(scene))
        else:
            file = Path(str(scene))
        try:
            plan = fp.plan(fp.load_scene(file))
            if plan.status != "solved":
                return {"status": plan.status}
            saved = Path(folder, "plan.json")
            plan.save(saved)
            certificate = json.loads(saved.read_text())["certificate"]
            end = fp.simulate(plan, seed=None)
        except TimeoutError:
            raise
        except FlatpushError as error:
            return {"status": "refused", "error": type(error).__name__}
        except Exception as error:  # what a comparison must not stop at
            return {"status": "failed", "error": repr(error)}
    return {
        "status": plan.status,
        "cost": plan.cost,
        "duration": plan.duration,
        "pushes": [s.push for s in plan.pushes],
        "words": [s.word for s in plan.pushes],
        "certificate": certificate,
        "end": [float(x) for x in end.final_pose],
        "outcome": end.outcome,
    }


def work() -> None:
    """Answers the scenes that standard input names, one JSON line a scene."""
    sys.path.insert(0, str(HERE))
    from random_scenes import scene

    def stop(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGPROF, stop)

    for line in sys.stdin:
        name = line.strip()
        seed = name.removeprefix("random ")
        case: object = scene(int(seed)) if seed != name else Path("examples", name)
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)
        try:
            found = answer(case)
        except TimeoutError:
            found = {"status": SLOW}
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(json.dumps({"name": name, **found}), flush=True)


def differences(old: object, new: object, where: str = "") -> list[str]:
    """The fields in which two answers differ by more than the tolerance."""
    if isinstance(old, dict) and isinstance(new, dict):
        keys = [*old, *(k for k in new if k not in old)]
        return [d for k in keys for d in differences(old.get(k), new.get(k), f"{where}.{k}".lstrip("."))]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return [
            d
            for i, (a, b) in enumerate(zip(old, new, strict=True))
            for d in differences(a, b, f"{where}[{i}]")
        ]
    if isinstance(old, float | int) and isinstance(new, float | int) and not isinstance(old, bool):
        same = old == new or abs(old - new) <= TOLERANCE * max(1.0, abs(old)) or (old != old and new != new)
        return [] if same else [f"{where}: {old!r} -> {new!r}"]
    return [] if old == new else [f"{where}: {old!r} -> {new!r}"]


def answers(checkout: Path, arguments: argparse.Namespace) -> dict[str, dict[str, object]]:
    """By name; from what is kept, if the checkout is clean."""
    git = ["git", "-C", str(checkout)]
    commit = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
    clean = not subprocess.run([*git, "status", "--porcelain"], capture_output=True, text=True).stdout.strip()
    kept = Path(tempfile.gettempdir(), f"flatpush-answers-{commit}.jsonl") if clean else Path(os.devnull)
    rows = map(json.loads, kept.read_text().splitlines() if kept.exists() else [])
    known: dict[str, dict[str, object]] = {row["name"]: row for row in rows}
    wanted = [f"random {s}" for s in range(arguments.first, arguments.first + arguments.scenes)]
    if arguments.examples:
        wanted += [path.name for path in sorted((checkout / "examples").glob("*.yaml"))]
    missing = [name for name in wanted if name not in known]
    if missing:
        command = [sys.executable, str(HERE / "same_answers.py"), "--work", ".", "."]
        environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
        pipe = subprocess.PIPE
        with (
            open(kept, "a") as file,
            subprocess.Popen(
                command, cwd=checkout, env=environment, stdin=pipe, stdout=pipe, text=True
            ) as process,
        ):
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write("\n".join(missing) + "\n")
            process.stdin.close()
            for count, line in enumerate(process.stdout, 1):
                file.write(line)
                file.flush()
                row = json.loads(line)
                known[row["name"]] = row
                print(f"\r{checkout.name}: {count} of {len(missing)}", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        if process.returncode:
            raise SystemExit(f"{checkout}: ended with status {process.returncode}")
    return {name: known[name] for name in sorted(wanted)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--no-examples", dest="examples", action="store_false")
    parser.add_argument("--work", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work:
        work()
        return 0
    old, new = (answers(path.resolve(), arguments) for path in (arguments.old, arguments.new))
    different, cheaper, dearer = 0, 0, 0
    for name in old:
        if SLOW in (old[name]["status"], new[name]["status"]):
            print(f"{name}: {' → '.join(str(side[name]['status']) for side in (old, new))}, not compared")
            continue
        found = differences(old[name], new[name])
        if found:
            different += 1
            a, b = old[name].get("cost"), new[name].get("cost")
            if isinstance(a, float) and isinstance(b, float) and not math.isclose(a, b, rel_tol=1e-9):
                cheaper, dearer = cheaper + (b < a), dearer + (b > a)
            print(f"{name}: {'; '.join(found[:4])}{f' and {len(found) - 4} more' if len(found) > 4 else ''}")
    solved = sum(row["status"] == "solved" for row in new.values())
    print(
        f"{len(old)} scenes, {solved} solved; {different} differ, {cheaper} of them cheaper now and {dearer} dearer"
    )
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
