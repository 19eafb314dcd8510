"""Draws the pictures of README and docs anew: python docs/make_images.py [NAME…], some minutes for all of them.

Those of recorded data and of timings come from `flatpush experiment` and `benchmarks/`, as their pages say.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
EXAMPLES = ROOT / "examples"

# The picture, and the commands that draw it; {out} is the file, {tmp} a folder for what lies between.
PICTURES: dict[str, list[str]] = {
    "triangle.svg": ["plan {examples}/triangle.yaml --figure {out}"],
    "maze.svg": ["plan {examples}/maze.yaml --figure {out} --snapshots {images}/maze_snapshots.svg"],
    "stable_region.svg": ["describe {examples}/triangle.yaml --figure {out}"],
    "tube.svg": [
        "plan {examples}/rectangle_three_feet.yaml -o {tmp}/plan.json",
        "simulate {tmp}/plan.json --runs 200 --seed 7 --figure {out}",
    ],
    "track.svg": [
        "plan {examples}/disc.yaml -o {tmp}/plan.json",
        "track {tmp}/plan.json --controller path --start 1,1,1 --figure {out}",
    ],
    "horizon.svg": [
        "plan {examples}/triangle_one_finger.yaml -o {tmp}/plan.json",
        "track {tmp}/plan.json --controller horizon --learn --friction 0.25 --centre 0.5,0.5 --seed 1 --figure {out}",
    ],
}


def draw(name: str) -> None:
    """Runs the commands of one picture; a command that fails ends the program."""
    with tempfile.TemporaryDirectory() as folder:
        for command in PICTURES[name]:
            words = command.format(out=IMAGES / name, tmp=folder, images=IMAGES, examples=EXAMPLES).split()
            subprocess.run(
                [sys.executable, "-c", "from flatpush.cli import main; main()", *words], check=True
            )


if __name__ == "__main__":
    wanted = sys.argv[1:] or list(PICTURES)
    unknown = [name for name in wanted if name not in PICTURES]
    if unknown:
        sys.exit(f"no such picture: {', '.join(unknown)}; there are {', '.join(PICTURES)}")
    for name in wanted:
        print(name, flush=True)
        draw(name)
