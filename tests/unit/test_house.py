"""Formatting, lint, types, import layers, and documents that tell the truth: the same here and wherever tests run."""

import ast
import dataclasses
import functools
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import pytest
from tests.mutants import entries, problems
from tests.waiting import python

ROOT = Path(__file__).parents[2]
# What breaks the rule of Any below and is still to be mended: it only shrinks.
MOST_ANY = 18


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "format", "--check", "--quiet"],
        ["ruff", "check", "--quiet"],
        pytest.param(["mypy", "--no-error-summary"], marks=pytest.mark.slow),  # a minute without its cache
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_tools_agree(command):
    ended = python("-m", *command, cwd=ROOT, patience=500)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_imports_go_up_the_list_only():
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports())"
    ended = python("-c", code, cwd=ROOT)
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
def test_the_python_in_the_documents_runs(name, block, tmp_path, monkeypatch, capsys):
    for folder in ("examples", "docs", "benchmarks"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, name, "exec"), {"__name__": name})
    assert capsys.readouterr().out or "assert " in block  # a reader sees what it does


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


# Rows of docs/equations.md whose tests are slow, read recorded data, or that have nothing to compute: it only shrinks.
UNBROKEN = {
    "Fig. 5",
    "Sec. 5.1, many pushes",
    "Sec. 5.2, Figs. 10–11",
    "Sec. 6, future work",
    "Eq. 1 under an unknown force",
    "a side at rest against both fingers",
}


def test_every_row_of_the_equations_has_a_change_that_its_own_test_must_notice():
    broken = (ROOT / "tests" / "mutants" / "equations.yaml").read_text(encoding="utf-8")
    named = set(re.findall(r'^  test: "(.*)"', broken, re.M))
    table = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if "`tests/" in line
    ]
    rows = [row for row in rows if len(row) == 4]
    assert len(rows) > 35
    unbroken = set()
    for name, _, _, tests in rows:
        own = re.findall(r"`(tests/[^`]+)`", tests)
        if not any(test == one or test.startswith(f"{one}::") for test in named for one in own):
            unbroken.add(name)
    assert unbroken == UNBROKEN


def test_each_change_that_tests_must_notice_stands_in_the_source_once():
    assert not list(problems(entries()))


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


@functools.cache
def trees() -> dict[str, ast.Module]:
    """Dotted name of each module of flatpush → its syntax tree."""
    found = {}
    for path in sorted((ROOT / "src").rglob("*.py")):
        parts = path.relative_to(ROOT / "src").with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8"))
        found[name].is_package = parts[-1] == "__init__"  # type: ignore[attr-defined]
    return found


def imported(name: str) -> set[str]:
    """The modules of flatpush that one imports, at its top or within its functions, but not for types alone."""
    tree, found = trees()[name], set()
    nodes = list(ast.walk(tree))
    types_only = {
        id(inside)
        for node in nodes
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inside in ast.walk(node)
    }
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and id(node) not in types_only:
            home = name.split(".")
            if node.level:
                home = home[: len(home) - node.level + tree.is_package]  # type: ignore[attr-defined]
            else:
                home = []
            base = ".".join([*home, *(node.module or "").split(".")]).strip(".")
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                found.add(inner if inner in trees() else base)
    return {other for other in found if other in trees() and other != name}


def circles(edges: dict[str, set[str]]) -> set[frozenset[str]]:
    """The groups of more than one name, each of which reaches every other."""
    reach: dict[str, set[str]] = {}
    for a in edges:
        found, ahead = set(), [a]
        while ahead:
            new = edges[ahead.pop()] - found
            found |= new
            ahead += new
        reach[a] = found
    groups = {frozenset({a, *(b for b in reach[a] if a in reach[b])}) for a in edges}
    return {group for group in groups if len(group) > 1}


def test_no_import_circle():
    edges = {a: imported(a) for a in trees()}
    # Plan.save is a one-line call, made when it is used; it is written in the import contract as well.
    edges["flatpush.problem.plan"].discard("flatpush.documents")
    edges["flatpush.problem.plan"].discard("flatpush.documents.plan_file")
    assert not circles(edges)
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == {frozenset({"b", "c"})}


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    for name, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                yield f"{name.removeprefix('flatpush.')}.{node.name}", node


def is_compiled(node: ast.FunctionDef) -> bool:
    names = {n.id for d in node.decorator_list for n in ast.walk(d) if isinstance(n, ast.Name)}
    return bool(names & {"kernel", "inner", "block", "shared"})


def test_kernels_read_named_columns():
    """No integer above 2 as an index: data have names."""
    bare = set()
    for name, node in functions():
        if is_compiled(node):
            for part in ast.walk(node):
                if isinstance(part, ast.Subscript):
                    axes = part.slice.elts if isinstance(part.slice, ast.Tuple) else [part.slice]
                    for axis in axes:
                        if isinstance(axis, ast.Constant) and isinstance(axis.value, int) and axis.value > 2:
                            bare.add(name)
    assert not bare


def test_no_function_has_more_than_twelve_parameters():
    long = set()
    for name, node in functions():
        arguments = node.args
        count = len([*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs])
        # A command's parameters are its options.
        if count > 12 and not name.startswith("cli."):
            long.add(name)
    assert not long


ASSERTING = {"raises", "warns", "fail", "skip", "importorskip", "assert_allclose", "assert_array_equal"}


def called(node: ast.expr | None) -> str:
    return ast.unparse(node.func).split(".")[-1] if isinstance(node, ast.Call) else ""


def silent(body: list[ast.stmt], asserting: set[str]) -> set[str]:
    """How statements can end with nothing asserted: they fall through, leave the function, or jump in a loop."""
    ways = {"fall"}
    for statement in body:
        if "fall" in ways:
            ways = ways - {"fall"} | silently(statement, asserting)
    return ways


def silently(statement: ast.stmt, asserting: set[str]) -> set[str]:
    match statement:
        case ast.Assert() | ast.Raise():
            return set()
        case ast.Expr(value=value) if called(value) in asserting:
            return set()
        case ast.Return(value=value):
            return set() if called(value) in asserting else {"leave"}
        case ast.Continue() | ast.Break():
            return {"jump"}
        case ast.If():
            return silent(statement.body, asserting) | silent(statement.orelse, asserting)
        case ast.For(iter=over):
            inside = silent(statement.body, asserting)
            may_be_empty = any(part.ifs for part in getattr(over, "generators", []))
            return inside & {"leave"} | ({"fall"} if may_be_empty or inside - {"leave"} else set())
        case ast.While():
            return silent(statement.body, asserting) & {"leave"} | {"fall"}
        case ast.With(items=items):
            checks = any(called(item.context_expr) in asserting for item in items)
            return set() if checks else silent(statement.body, asserting)
        case ast.Try():
            last = silent(statement.finalbody, asserting)
            return last and silent(statement.body, asserting)
    return {"fall"}


def always_asserting(text: str, known: set[str]) -> set[str]:
    """Names of the functions of a file on each of whose paths something is asserted, and those that are known."""
    found = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    asserting, more = set(known), {""}
    while more:
        more = {node.name for node in found if not silent(node.body, asserting)} - asserting
        asserting |= more
    return asserting


def silent_tests(text: str, known: set[str] = ASSERTING) -> list[str]:
    """Names of the tests in a file that can pass with nothing asserted."""
    loud = always_asserting(text, known)
    return [name for name in re.findall(r"^def (test_\w+)\(", text, re.M) if name not in loud]


def test_no_test_passes_with_nothing_asserted():
    loud = "def test_a(x):\n    {}\n"
    assert not silent_tests(loud.format("assert x"))
    for quiet in ("if x: assert x", "for y in x:\n        if y: continue\n        assert y", "return", "x()"):
        assert silent_tests(loud.format(quiet)) == ["test_a"]
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    known = set(ASSERTING)
    for path in sorted((ROOT / "tests").glob("*.py")):  # what several files of tests use
        known = always_asserting(path.read_text(encoding="utf-8"), known)
    assert not {
        (path.name, name) for path in files for name in silent_tests(path.read_text(encoding="utf-8"), known)
    }


WAITING = {"wait", "join", "recv", "result", "acquire"}  # for ever, unless told how long
STARTING = {"subprocess.run", "subprocess.Popen", "subprocess.check_output"}


def endless(text: str) -> list[str]:
    """What in a file of tests may wait for ever: for another process or thread, or in a loop that pauses."""
    found = []
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Call(args=[], keywords=[]) if called(node) in WAITING:
                found.append(ast.unparse(node))
            case ast.Call(keywords=named) if ast.unparse(node.func) in STARTING:
                found += [] if "timeout" in {word.arg for word in named} else [ast.unparse(node)]
            case ast.While() if "sleep" in {called(part) for part in ast.walk(node)}:
                found.append(ast.unparse(node.test))
    return found


def test_no_test_waits_for_ever():
    """tests/waiting.py starts processes and waits for them, and all of its waits end."""
    for text in ("a.wait()", "subprocess.run([])", "while a:\n    time.sleep(1)"):
        assert endless(text)
    files = set((ROOT / "tests").rglob("*.py")) - {ROOT / "tests" / "waiting.py"}
    assert not {(path.name, what) for path in files for what in endless(path.read_text(encoding="utf-8"))}


SAYS = re.compile(
    r"\[[^\]]*\b(m|s|rad|deg|N|Hz|px)(?![a-z])[^\]]*\]|shape \(|\((n|m|k|\.\.\.|\d)[^)]*, ?[^)]*\)|X_[A-Z]{2}|0 to 1"
    r"|[Hh]ow many|\b(shares?|bytes|fraction|ratio|factor|coefficients?|number|degrees of freedom|relative|weights?)\b"
    r"|\bunit (normal|vector|direction|twist|wrench)|radians|in the unit of|without unit|in \[0, 1|\+1|within \(1 ±"
    r"|: (see|as in) "
)
NUMERIC = re.compile(r"\b(float|int|Array|ArrayLike|NDArray|ndarray)\b")


def entry(doc: str, name: str) -> str:
    """What a docstring says of an attribute: its entry, or else the sentences that name it."""
    found = re.search(
        rf"(?:^|[.;] )\s*(?:\w+, )*{name}(?:, \w+)*: .*?(?=\n\s*(?:\w+, )*\w+: |\n\s*\n|\Z)", doc, re.S | re.M
    )
    return found[0] if found else " ".join(re.findall(rf"[^.]*\b{name}\b[^.]*", doc))


def unsaid(module_name: str) -> Iterator[str]:
    """Numbers in the public names of a module of which no docstring says shape, unit or meaning."""
    module = importlib.import_module(module_name)
    for name in module.__all__:
        thing = getattr(module, name)
        inherited = thing.__mro__[1:] if inspect.isclass(thing) else ()
        members = {name: thing} if inspect.isfunction(thing) else {}
        if inspect.isclass(thing):
            members = {f"{name}.{k}": v for k, v in vars(thing).items() if not k.startswith("_")}
            for field in dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ():
                public = NUMERIC.search(str(field.type)) and not field.name.startswith("_")
                if public and field.name in vars(thing).get("__annotations__", {}):
                    docs = [inspect.getdoc(c) or "" for c in (thing, *inherited)]
                    if not any(SAYS.search(entry(doc, field.name)) for doc in docs):
                        yield f"{name}.{field.name}"
        for full, member in members.items():
            of = getattr(member, "__func__", None) or getattr(member, "fget", None) or member
            if inspect.isfunction(of):
                kin = [vars(c)[of.__name__] for c in inherited if of.__name__ in vars(c)]
                doc = "\n".join(inspect.getdoc(one) or "" for one in (of, *kin))
                hints = {k: str(v) for k, v in of.__annotations__.items() if NUMERIC.search(str(v))}
                missing = [k for k in hints if k != "return" and not SAYS.search(entry(doc, k))]
                if missing or (hints and not SAYS.search(doc)):
                    yield f"{full}({', '.join(missing)})"


ROOMS = (
    *("geometry", "geometry.collision", "friction", "contact", "steering", "problem", "documents"),
    *("simulation", "simulation.plant", "planning", "planning.bound", "planning.sliding", "identification"),
    *("control", "execution", "vision", "view", "gym"),
)


@pytest.mark.parametrize("module", ["flatpush", *(f"flatpush.{room}" for room in ROOMS)])
def test_public_names_say_shape_unit_or_meaning_of_their_numbers(module):
    assert list(unsaid(module)) == []


def raises(thing: FunctionType) -> bool:
    """Whether a function refuses something by itself; what a dataclass makes has no source."""
    if thing.__code__.co_filename == "<string>":
        return False
    tree = ast.parse(textwrap.dedent(inspect.getsource(thing)))
    return any(
        isinstance(part, ast.Raise) and called(part.exc).endswith(("Error", "Reduction", "Extra"))
        for part in ast.walk(tree)
    )


def unexplained(module_name: str) -> Iterator[str]:
    """Public names of a module without a docstring, or that refuse something and do not say so."""
    module = importlib.import_module(module_name)
    for name in module.__all__:
        thing = getattr(module, name)
        if not inspect.isclass(thing) and not inspect.isfunction(thing):
            continue
        members = vars(thing) if inspect.isclass(thing) else {name: thing}
        kinds = thing.__mro__ if inspect.isclass(thing) else ()
        for key, member in members.items():
            of = getattr(member, "__func__", None) or getattr(member, "fget", None) or member
            making = key in ("__init__", "__post_init__")
            if (
                not inspect.isfunction(of)
                or "flatpush" not in of.__module__
                or (key[0] == "_" and not making)
            ):
                continue
            told = thing if making else of
            docs = [
                inspect.getdoc(told),
                *(inspect.getdoc(vars(kind).get(key)) for kind in kinds if not making),
            ]
            doc = "\n".join(one for one in docs if one)
            if not doc or (raises(of) and not re.search(r"Error|refuse|Refuse|NoDubins|Extra", doc)):
                yield f"{name}.{key}" if kinds else name


@pytest.mark.parametrize("module", ["flatpush", *(f"flatpush.{room}" for room in ROOMS)])
def test_public_names_say_what_they_are_and_what_they_refuse(module):
    assert list(unexplained(module)) == []


def test_any_does_not_spread():
    """Public signatures without Any; what is left is at the edges of libraries without types. The number only falls."""
    count = 0
    for name, node in functions():
        if not node.name.startswith("_") and not name.startswith(("compiled.", "kernel_pipeline.")):
            hints = [a.annotation for a in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]]
            text = " ".join(ast.unparse(hint) for hint in [*hints, node.returns] if hint is not None)
            count += len(re.findall(r"\bAny\b", text))
    assert count <= MOST_ANY
