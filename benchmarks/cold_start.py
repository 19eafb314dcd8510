"""CPU seconds of commands from an empty kernel cache and warm, of two checkouts taking turns; and whether a first plan
is every later one.

python benchmarks/cold_start.py OLD NEW             prints CPU seconds (user and system) of both, and their ratios
python benchmarks/cold_start.py --twice CHECKOUT    plans each example from an empty cache and again, and compares

Bytecode is compiled beforehand, as an installation does, also that of numba. A certificate, of pushes that nothing is
known of and of pushes that another plan had (as the planner's own is), and a start through one Planner (the mean over
STARTS), are timed within a process that has loaded its kernels.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

STARTS = 100
ROUNDS = 3  # of what is warm; the least counts
COMMANDS = {  # what a line measures; DIR holds the plans of this checkout
    "plan triangle": "plan examples/triangle.yaml -o DIR/triangle.json",
    "simulate it": "simulate DIR/triangle.json",
    "plan maze": "plan examples/maze.yaml -o DIR/maze.json",
    "track triangle": "track DIR/triangle.json",
    "plan triangle --figure": "plan examples/triangle.yaml --figure DIR/triangle.svg",
}
TIMED = """
import sys, time, numpy as np, flatpush as fp
from flatpush.simulation.claims import certify
def took(count, work):
    begun = time.process_time()
    work()
    print((time.process_time() - begun) / count)
from dataclasses import replace
other, scene = (fp.load_scene(f"examples/{name}.yaml") for name in ("rectangle_boundary", "triangle"))
x, y, angle = scene.start
other, plan, beside = (fp.plan(one) for one in (other, scene, replace(scene, start=(x + 1e-3, y, angle))))
assert {one.push for one in beside.pushes} <= {one.push for one in plan.pushes}
own = [module for name, module in sys.modules.items() if name.startswith("flatpush.")]
clear = [f.cache_clear for module in own for f in vars(module).values() if hasattr(f, "cache_clear")]
certify(other.scene, other.segments)
for forget in clear:
    forget()
took(1, lambda: certify(plan.scene, plan.segments))
took(1, lambda: certify(beside.scene, beside.segments))
planner = fp.Planner(fp.load_scene("examples/rectangle_boundary.yaml"))
planner.plan()
starts = np.random.default_rng(0).uniform(-1, 1, (int(sys.argv[1]), 3)) * [0.15, 0.15, np.pi]
took(len(starts), lambda: planner.plans(starts))
"""


class Checkout:
    """One source tree with its own kernels, bytecode and plans."""

    def __init__(self, root: str, room: Path) -> None:
        self.root, self.room = Path(root).resolve(), room
        room.mkdir()
        kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        paths = {"PYTHONPATH": str(self.root / "src"), "PYTHONPYCACHEPREFIX": str(room / "bytecode")}
        self.environment = {**kept, **paths}
        self.run([sys.executable, "-m", "compileall", "-q", "src"], "none")
        self.run([sys.executable, "-c", "import numba, flatpush.cli; numba.njit(lambda x: x + 1)(1)"], "none")

    def run(self, arguments: list[str], kernels: str) -> tuple[float, str]:
        """CPU seconds and output of a process whose kernels are kept under a name."""
        environment = {**self.environment, "NUMBA_CACHE_DIR": str(self.room / kernels)}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ended = subprocess.run(arguments, cwd=self.root, env=environment, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if ended.returncode:
            sys.exit(f"{self.root}: {' '.join(arguments)[:80]}\n{ended.stderr[-2000:]}")
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, ended.stdout

    def command(self, line: str, kernels: str) -> float:
        words = line.replace("DIR", str(self.room)).split()
        return self.run([sys.executable, "-m", "flatpush", *words], kernels)[0]


def compare(old: Checkout, new: Checkout) -> None:
    print(f"{'CPU time':38}{'old':>9}{'new':>9}{'ratio':>7}")
    for name, line in COMMANDS.items():
        tell(f"{name}, empty cache [s]", *(one.command(line, name) for one in (old, new)))
        rounds = [[one.command(line, name) for one in (old, new)] for _ in range(ROUNDS)]
        tell(f"{name}, warm [s]", *map(min, zip(*rounds, strict=True)))
    asked = [sys.executable, "-c", TIMED, str(STARTS)]
    rounds = [
        [list(map(float, one.run(asked, "plan triangle")[1].split())) for one in (old, new)] for _ in range(2)
    ]
    certificates = ("certificate, two fingers [ms]", "of known pushes [ms]")
    for i, name in enumerate((*certificates, f"one of {STARTS} starts [ms]")):
        tell(name, *(1e3 * min(both[k][i] for both in rounds) for k in (0, 1)))


def tell(name: str, old: float, new: float) -> None:
    print(f"{name:38}{old:9.2f}{new:9.2f}{new / old:7.2f}", flush=True)


def twice(checkout: Checkout) -> bool:
    """Whether the first plan of each example and the second are byte-identical, `run` aside; prints it."""
    same = True
    for scene in sorted((checkout.root / "examples").glob("*.yaml")):
        plans = []
        for _ in "ab":
            checkout.command(f"plan {scene} -o DIR/plan.json", scene.stem)
            document = json.loads((checkout.room / "plan.json").read_text(encoding="utf-8"))
            document.pop("run")
            plans.append(json.dumps(document))
        same = same and plans[0] == plans[1]
        print(f"{scene.stem:24}{'the same' if plans[0] == plans[1] else 'DIFFERENT'}", flush=True)
    return same


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as room:
        options, places = (
            [a for a in sys.argv[1:] if a[:2] == "--"],
            [a for a in sys.argv[1:] if a[:2] != "--"],
        )
        checkouts = [Checkout(place, Path(room, str(i))) for i, place in enumerate(places)]
        if options == ["--twice"] and len(checkouts) == 1:
            sys.exit(not twice(checkouts[0]))
        elif not options and len(checkouts) == 2:
            compare(*checkouts)
        else:
            sys.exit(__doc__)
