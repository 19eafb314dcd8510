"""Runs an entry on scenes of the challenge, keeps its verdicts, and prints its table.

    python benchmarks/challenge/run.py ENTRY [N] [--first K] [--judge plant|mujoco] [-o FILE]
    python benchmarks/challenge/run.py --results

ENTRY is flatpush, flatpush-looking, ompl, policy, or MODULE:NAME of your own. N scenes (default 200), from K on. The
judge is MuJoCo where it is installed, else flatpush's own simulator; the table says which. With --results the tables
of all that is kept in benchmarks/challenge/results.
"""

import argparse
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path

from entries import ENTRIES
from judge import PHYSICS, Entry, Verdict, judged, table
from scenes import COUNT, FILE

from flatpush.documents import parse_scene
from flatpush.errors import FlatpushError
from flatpush.problem import Scene

RESULTS = FILE.with_name("results")
PLACES = {"cost": 4, "seconds": 2, "distance": 6, "angle": 5}  # that are kept of a number


def scenes(count: int, first: int = 0) -> list[Scene]:
    lines = FILE.read_text(encoding="utf-8").splitlines()[first : first + count]
    return [parse_scene(json.loads(line)) for line in lines]


def entry_of(name: str) -> Entry:
    if name in ENTRIES:
        return ENTRIES[name]
    module, _, attribute = name.partition(":")
    sys.path.insert(0, str(Path.cwd()))
    try:
        return getattr(importlib.import_module(module), attribute)  # type: ignore[no-any-return]
    except (ImportError, AttributeError, ValueError) as error:
        sys.exit(f"no entry {name} ({error}): there are {', '.join(ENTRIES)}, or MODULE:NAME")


def kept(name: str, judge: str, first: int, verdicts: list[Verdict]) -> str:
    """What is kept of a run, as a document of one line for each scene."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=RESULTS.parent, capture_output=True, text=True
    ).stdout.strip()
    head = {"entry": name, "judge": judge, "first": first, "commit": commit}
    rows = []
    for verdict in verdicts:
        row = {k: round(v, PLACES[k]) if k in PLACES else v for k, v in asdict(verdict).items()}
        rows.append(json.dumps(row))
    return json.dumps(head)[:-1] + ', "verdicts": [\n' + ",\n".join(rows) + "\n]}\n"


def told(document: str) -> Iterator[str]:
    """Heading and table of what is kept of a run."""
    run = json.loads(document)
    verdicts = [Verdict(**row) for row in run["verdicts"]]
    yield f"**{run['entry']}**, judge {run['judge']}, {len(verdicts)} scenes, commit {run['commit']}:"
    yield ""
    yield from table(verdicts, scenes(len(verdicts), run["first"]))


def main(words: list[str]) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("entry", nargs="?")
    parser.add_argument("count", nargs="?", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--judge", choices=sorted(PHYSICS))
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--results", action="store_true")
    asked = parser.parse_args(words)
    if asked.results:
        files = sorted(RESULTS.glob("*.json"))
        print("\n\n".join("\n".join(told(path.read_text(encoding="utf-8"))) for path in files))
        return
    name = asked.judge or ("mujoco" if find_spec("mujoco") else "plant")
    if asked.entry is None or not 0 <= asked.first < asked.first + asked.count <= COUNT:
        parser.error(f"an entry is needed, and scenes from 0 to {COUNT - 1}")
    if name == "mujoco" and not find_spec("mujoco"):
        sys.exit('the judge mujoco needs MuJoCo: pip install "flatpush[sim]"')
    entry, verdicts = entry_of(asked.entry), []
    for k, scene in enumerate(scenes(asked.count, asked.first), start=asked.first):
        try:
            verdicts.append(judged(scene, entry, PHYSICS[name]))
        except FlatpushError as error:
            sys.exit(f"scene {k}: {error}")
        print(f"scene {k}: {verdicts[-1].reason or 'solved'}", file=sys.stderr, flush=True)
    document = kept(asked.entry, name, asked.first, verdicts)
    if asked.output:
        asked.output.write_text(document, encoding="utf-8")
    print("\n".join(told(document)))


if __name__ == "__main__":
    main(sys.argv[1:])
