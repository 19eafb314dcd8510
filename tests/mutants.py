"""One-line changes of the program, each of which a named test must notice.

    python tests/mutants.py [PART OF A FILE'S NAME]

Reads tests/mutants/*.yaml, lists of {file, old, new, test}: in src/flatpush/<file> the text `old`, which stands there
once, becomes `new`, and the test (a pytest node, or several) must then fail. The changes are made in copies of src, of
which there are two, so that two tests run at a time; nothing of the checkout is touched. All share the cache of kernels
(NUMBA_CACHE_DIR, or one of their own): a kernel is known by what it computes, so a changed one is compiled anew.
"""

import compileall
import os
import py_compile
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

import yaml

ROOT = Path(__file__).parents[1]
TIMEOUT = 600  # of one test with a change [s]; a test that hangs has noticed it
# Of pytest: tests failed. Others mean that the test was not run.
FAILED = 1
COPIES = 2  # tests that run at a time


def entries(part: str = "") -> list[dict[str, str]]:
    """All changes, in the order of their files."""
    lists = (yaml.safe_load(path.read_text()) for path in sorted((ROOT / "tests" / "mutants").glob("*.yaml")))
    return [entry for listed in lists for entry in listed if part in entry["file"]]


def problems(listed: list[dict[str, str]]) -> Iterator[str]:
    """What is wrong with the lists themselves: a text that does not stand once, a test that is not there."""
    for entry in listed:
        text = (ROOT / "src" / "flatpush" / entry["file"]).read_text()
        if text.count(entry["old"]) != 1:
            yield f"{entry['file']}: {entry['old']!r} stands there {text.count(entry['old'])} times"
        for node in entry["test"].split():
            file, *names = node.split("::")
            name = names[-1].split("[")[0] if names else ""
            if not (ROOT / file).exists() or (name and f"def {name}(" not in (ROOT / file).read_text()):
                yield f"there is no test {node}"


def copied(folder: Path) -> Path:
    """A copy of src, compiled to bytecode that is known by the text it was made of."""
    shutil.copytree(ROOT / "src", folder, ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(folder, quiet=1, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)
    return folder


def survives(entry: dict[str, str], copy: Path, kernels: str) -> str:
    """Why a change of a copy of src counts as not noticed; empty if the test failed with it."""
    file = copy / "flatpush" / entry["file"]
    original = file.read_text()
    environment = {
        **os.environ,
        "PYTHONPATH": str(copy),
        "NUMBA_CACHE_DIR": kernels,
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    file.write_text(original.replace(entry["old"], entry["new"]))
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-n",
        "0",
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "slow or not slow",
        "--hypothesis-profile=not shrunk",
        *entry["test"].split(),
    ]
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return ""
    finally:
        file.write_text(original)
    if done.returncode == FAILED:
        return ""
    return (
        "the test passes"
        if done.returncode == 0
        else f"pytest ended with {done.returncode}: {done.stdout[-300:]}"
    )


def main(part: str = "") -> int:
    listed = entries(part)
    wrong = list(problems(listed))
    print(*wrong, sep="\n")
    alive = 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(COPIES) as workers:
        kernels = os.environ.get("NUMBA_CACHE_DIR") or str(Path(folder, "kernels"))
        copies: SimpleQueue[Path] = SimpleQueue()
        for number in range(COPIES):
            copies.put(copied(Path(folder, f"src{number}")))

        def noticed(entry: dict[str, str]) -> str:
            copy = copies.get()
            try:
                return survives(entry, copy, kernels)
            finally:
                copies.put(copy)

        chosen = [] if wrong else listed
        for entry, why in zip(chosen, workers.map(noticed, chosen), strict=True):
            alive += bool(why)
            print(
                f"{'ALIVE' if why else 'killed'}  {entry['file']}: {entry['old']} → {entry['new']}  {why}",
                flush=True,
            )
    print(f"{len(listed) - alive} of {len(listed)} changes are noticed" if not wrong else "nothing was run")
    return 1 if wrong or alive else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
