"""Numbers in the documents that a command writes: compared as numbers, and the quick ones stand as printed."""

import importlib.util
import re
from pathlib import Path

import pytest
from tests.waiting import python

from flatpush.experiments import EXPERIMENTS

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "docs" / "number_blocks.py"


@pytest.fixture(scope="module")
def blocks():
    spec = importlib.util.spec_from_file_location("number_blocks", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("printed", "written", "same"),
    [
        ("a 10.0 mm", "a 10.1 mm", True),  # a unit of the last digit
        ("a 10.0 mm", "a 10.4 mm", False),
        ("a 1000 mm", "a 1015 mm", True),  # 2 %
        ("a 1000 mm", "b 1000 mm", False),
        ("-6.70°", "−6.71°", True),
        ("-6.70°", "6.70°", False),
        ("5.2e-14 mm", "1.0e-13 mm", True),  # rounding error
        ("1 2", "1", False),
    ],
)
def test_numbers_are_compared_as_numbers(blocks, printed, written, same):
    assert blocks.same(printed, written) is same


def test_every_block_has_a_command_and_is_filled(blocks):
    found = {}
    for page in sorted((ROOT / "docs").glob("*.md")):
        for name, told, inside in blocks.BLOCK.findall(page.read_text("utf-8")):
            found[name] = told, inside
    assert set(found) == set(blocks.BLOCKS)
    for name, (told, inside) in found.items():
        assert blocks.BLOCKS[name][0] in told
        assert inside.count("|") > 8


@pytest.mark.parametrize(
    ("above", "told"),
    [
        ("", False),
        ("<!-- measured: `flatpush experiment cone`, stood here at 5e4d1f9 -->\n", True),
        ("<!-- measured: `flatpush experiment cone`, stood here at 5e4d1f9 -->\nWords.\n\n", False),
        ("<!-- measured: `flatpush experiment cone` -->\n", False),
    ],
)
def test_a_table_of_numbers_says_which_command_prints_it(blocks, above, told):
    table = "| | here |\n|---|---|\n| error | 0.13 mm |\n"
    assert blocks.untold(above + table) == ([] if told else [" | here"])
    assert blocks.untold("| key | meaning |\n|---|---|\n| circle | a radius |\n") == []


def test_every_table_of_numbers_in_the_documents_says_it(blocks):
    for page in sorted((ROOT / "docs").glob("*.md")):
        text = page.read_text("utf-8")
        assert blocks.untold(text) == [], page.name
        for command in re.findall(r"<!-- measured: `([^`]+)`", text):
            named = re.findall(r"benchmarks/\w+\.py", command)
            assert all((ROOT / file).exists() for file in named)
            experiments = set(command.removeprefix("flatpush experiment ").split(" --")[0].split())
            assert named or experiments <= set(EXPERIMENTS), command


@pytest.mark.slow
def test_blocks_stand_as_their_commands_print_them():
    ended = python(SCRIPT, "--check", patience=500)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_every_page_is_in_the_site_and_in_the_readme():
    """But the site's own first page, and those that only the site can fill."""
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")}
    listed = set((ROOT / "docs" / "index.md").read_text("utf-8").splitlines())
    assert pages - listed == {"index"}
    readme = (ROOT / "README.md").read_text("utf-8")
    assert {page for page in pages if f"docs/{page}.md" not in readme} == {"index", "api", "cli"}
