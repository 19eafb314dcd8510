"""How long verify and certify take, in CPU seconds, here and on an older checkout.

    python benchmarks/gate.py [CHECKOUT]

The plan of each example named below is made by each checkout itself, and verified and certified as often as a second
allows; the least time counts.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

EXAMPLES = ("triangle", "rectangle_boundary", "triangle_one_finger")


def least(call: Callable[[], object]) -> float:
    """CPU seconds of the fastest of the calls of a second, the first one aside."""
    call()
    times, end = [], time.process_time() + 1.0
    while not times or time.process_time() < end:
        began = time.process_time()
        call()
        times.append(time.process_time() - began)
    return min(times)


def measure() -> None:
    """Prints name, verify and certify of each example with the flatpush of this process."""
    import flatpush as fp
    from flatpush.simulation import certify

    for name in EXAMPLES:
        plan = fp.plan(fp.load_scene(Path("examples", f"{name}.yaml"), {"planning": {"iterations": 300}}))
        ways = least(lambda p=plan: fp.verify(p)), least(lambda p=plan: certify(p.scene, p.segments))  # type: ignore[misc]
        print(name, *ways, flush=True)


def measured(checkout: Path) -> dict[str, list[float]]:
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    command = [sys.executable, "-W", "ignore", str(Path(__file__).resolve()), "--measure"]
    text = subprocess.run(
        command, cwd=checkout, env=environment, capture_output=True, text=True, check=True
    ).stdout
    return {name: [float(t) for t in times] for name, *times in map(str.split, text.splitlines())}


def main() -> None:
    here = measured(Path(__file__).resolve().parents[1])
    before = measured(Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else {}
    for name, times in here.items():
        for what, k in (("verify", 0), ("certify", 1)):
            told = f"{name}: {what} {1e3 * times[k]:.2f} ms"
            if name in before:
                told += f", before {1e3 * before[name][k]:.2f} ms, {times[k] / before[name][k]:.2f} times"
            print(told)


if __name__ == "__main__":
    measure() if "--measure" in sys.argv else main()
