"""The numbered examples: at most forty lines, shown in the documents, and running as they stand."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("[01][0-9]_*.py"))
NEEDS = {"09_robot_in_the_cell.py": "mujoco"}


def test_they_are_short_numbered_and_shown():
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, 11))
    shown = re.findall(
        r"literalinclude} \.\./examples/(\w+\.py)", (ROOT / "docs/examples.md").read_text("utf-8")
    )
    assert shown == [path.name for path in EXAMPLES]
    assert {path.name: n for path in EXAMPLES if (n := len(path.read_text("utf-8").splitlines())) > 40} == {}


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_it_runs_and_says_what_it_found(path, capsys):
    """Each asserts what it shows; the thousand starts are thirty here."""
    needed = NEEDS.get(path.name)
    if needed and importlib.util.find_spec(needed) is None:
        pytest.skip(f"{path.name} needs {needed}")
    source = path.read_text("utf-8")
    if path.name.startswith("03"):
        source = source.replace("(1000, 3)", "(30, 3)")
        assert "(30, 3)" in source
    exec(compile(source, str(path), "exec"), {"__name__": "__main__", "__file__": str(path)})
    assert len(capsys.readouterr().out.splitlines()) >= 1
