"""Numbers in the documents that a command writes: python docs/number_blocks.py [--check] [BLOCK…]

A block stands in a page between `<!-- numbers: NAME … -->` and `<!-- /numbers -->`. Without --check it is written anew,
with the commit; with it a block whose words differ, or whose numbers differ by more than 2 % or a unit of their last
digit, ends with status 1. Blocks that read recorded data are left alone where FLATPUSH_DATA names none.

Tables whose command is dear stand as they were measured, below `<!-- measured: `COMMAND`, stood here at COMMIT -->`:
whoever measures them anew writes the commit, too.
"""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

DOCS = Path(__file__).resolve().parent
BLOCK = re.compile(r"<!-- numbers: ([\w-]+)(.*?)-->\n(.*?)<!-- /numbers -->", re.S)
NUMBER = re.compile(r"[−-]?\d+(?:\.\d+)?(?:e-?\d+)?|[−-]?\.\d+")


def data() -> Path | None:
    folder = os.environ.get("FLATPUSH_DATA")
    return Path(folder) if folder and Path(folder).is_dir() else None


def rows(name: str) -> str:
    """The rows of an experiment as a table: what, the paper's, ours."""
    from flatpush.experiments.everything import Job, compute

    found = compute(Job(name, quick=True, data=str(data() or ""))).finding
    assert found.rows, found.missing or found.failed
    lines = ["| | paper | here |", "|---|---|---|"]
    lines += [f"| {row.what} | {row.paper} | {row.ours} |" for row in found.rows]
    return "\n".join(lines) + "\n"


def challenge() -> str:
    """The tables of what the challenge keeps of entries."""
    command = [sys.executable, str(DOCS.parent / "benchmarks" / "challenge" / "run.py"), "--results"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


BLOCKS: dict[str, tuple[str, Callable[[], str]]] = {
    "stored-graphs": ("flatpush experiment stored-graphs --data DIR", lambda: rows("stored-graphs")),
    "open-loop": ("flatpush experiment open-loop", lambda: rows("open-loop")),
    "fig4": ("flatpush experiment fig4", lambda: rows("fig4")),
    "challenge": ("python benchmarks/challenge/run.py --results", challenge),
    "fig3": ("flatpush experiment fig3", lambda: rows("fig3")),
    "duality": ("flatpush experiment duality", lambda: rows("duality")),
}
RECORDED = {"stored-graphs"}
MEASURED = re.compile(r"<!-- measured: `([^`]+)`, stood here at ([0-9a-f]{7}) -->\n\Z")
TABLE = re.compile(r"(?:^\|.*\n)+", re.M)


def untold(text: str) -> list[str]:
    """First rows of the tables of a page that mostly hold numbers and do not say which command prints them."""
    found = []
    for table in TABLE.finditer(BLOCK.sub("", text)):
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table[0].splitlines()]
        cells = [cell for row in rows[2:] for cell in row[1:] if cell]
        numbers = sum(bool(re.match(r"[*−~-]*\d", cell)) for cell in cells)
        if 2 * numbers > len(cells) and not MEASURED.search(table.string[: table.start()]):
            found.append(" | ".join(rows[0]))
    return found


def same(one: str, other: str) -> bool:
    """Whether two texts have the same words, and numbers as near as another machine's rounding leaves them."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
        x, y = (float(text.replace("−", "-")) for text in (a, b))
        mantissa, _, exponent = b.partition("e")
        unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
        # What is rounding error anyway differs from machine to machine.
        if abs(x - y) > max(0.02 * abs(y), 1.01 * unit) and max(abs(x), abs(y)) > 1e-6:
            return False
    return True


def main(words: list[str]) -> int:
    check, wanted = "--check" in words, [word for word in words if word != "--check"]
    unknown = [name for name in wanted if name not in BLOCKS]
    if unknown:
        sys.exit(f"no such block: {', '.join(unknown)}; there are {', '.join(BLOCKS)}")
    stale = []
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=DOCS, capture_output=True, text=True
    ).stdout.strip()
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")

        def anew(found: re.Match[str], page: Path = page) -> str:
            name, _, old = found.groups()
            if (wanted and name not in wanted) or (name in RECORDED and data() is None):
                return found[0]
            command, make = BLOCKS[name]
            new = make()
            if same(new, old):
                return found[0]
            stale.append(f"{page.name}: {name}")
            return f"<!-- numbers: {name}, printed by `{command}` at {commit} -->\n{new}<!-- /numbers -->"

        written = BLOCK.sub(anew, text)
        if not check and written != text:
            page.write_text(written, encoding="utf-8")
    print("\n".join(f"{'stale' if check else 'written'}: {name}" for name in stale) or "all as printed")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
