"""Formatting, lint, types, import layers, and documents that tell the truth: the same here and wherever tests run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "format", "--check", "--quiet"],
        ["ruff", "check", "--quiet"],
        ["mypy", "--no-error-summary"],
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_tools_agree(command):
    ended = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=600
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_imports_go_up_the_list_only():
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports())"
    ended = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


def python_blocks() -> list[tuple[str, str]]:
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    found = []
    for page in pages:
        for k, block in enumerate(
            re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)
        ):
            found.append((f"{page.name}-{k}", block))
    return found


@pytest.mark.parametrize(
    ("name", "block"), python_blocks(), ids=lambda value: value if "\n" not in value else ""
)
def test_the_python_in_the_documents_runs(name, block, tmp_path, monkeypatch):
    for folder in ("examples", "docs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, name, "exec"), {"__name__": name})


def test_every_file_and_test_that_the_documents_name_exists():
    missing = []
    for page in [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for path in re.findall(r"`((?:tests|src|docs|examples|benchmarks)/[\w./-]+)(?:::(\w+))?`", text):
            target = ROOT / path[0]
            if not target.exists() or (
                path[1] and f"def {path[1]}" not in target.read_text(encoding="utf-8")
            ):
                missing.append((page.name, *path))
        for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
            if not (page.parent / link).exists():
                missing.append((page.name, link))
        for name in re.findall(r"`flatpush\.([\w.]+)`", text):
            parts = name.split(".")
            module = ROOT / "src" / "flatpush" / Path(*parts[:-1])
            home = module / f"{parts[-1]}.py"
            files = [module.with_suffix(".py"), module / "__init__.py"]
            named = any(
                f.exists() and re.search(rf"\b{parts[-1]}\b", f.read_text(encoding="utf-8")) for f in files
            )
            if not (home.exists() or (module / parts[-1]).is_dir() or named):
                missing.append((page.name, name))
    assert not missing


def test_no_sentence_of_the_documents_is_cut():
    """Brackets and emphasis close within their paragraph, item or row."""
    cut = []
    for page in [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]:
        words = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
        for part in re.split(r"\n(?=[*|#]|\n)", re.sub(r"`[^`]*`", "", words)):
            if part.count("(") != part.count(")") or part.count("**") % 2:
                cut.append((page.name, part))
    assert not cut


def test_every_citation_is_resolved_on_one_page():
    key = re.compile(r"\[([A-Z][A-Za-z]+[12]\d{3}[a-z]?)\]")
    listed = set(key.findall((ROOT / "docs" / "references.md").read_text(encoding="utf-8")))
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "src").rglob("*.py")]
    used = {k for page in pages for k in key.findall(page.read_text(encoding="utf-8"))}
    assert used == listed
