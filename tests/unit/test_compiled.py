"""Compiled kernels: what they are recognised by, how they are kept, and the clock that does not count compiling."""

import gc
import io
import os
import subprocess
import sys
import time
import warnings
from unittest.mock import Mock

import numpy as np
import pytest
from tests.waiting import python, started, until

from flatpush import compiled, compiling, kernel_store
from flatpush.cli.common import CompilingNotice
from flatpush.compiled import inner, kernel


@pytest.fixture
def own_store(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(kernel_store, "_told", False)
    return tmp_path / "flatpush-kernels"


DAMAGES = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "noise": lambda content: np.random.default_rng(1).bytes(len(content)),
    "a flipped bit": lambda content: content[:200] + bytes([content[200] ^ 1]) + content[201:],
    "too short for a digest": lambda content: content[:5],
    "longer": lambda content: content + b"x",
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_file_is_thrown_away(own_store, damage):
    kernel_store.save("name", bytes(range(256)) * 4)
    assert kernel_store.load("name") == bytes(range(256)) * 4
    file = own_store / "name"
    file.write_bytes(damage(file.read_bytes()))
    assert kernel_store.load("name") is None
    assert not file.exists()


@pytest.mark.parametrize("damage", ["unpicklable", "of another version"])
def test_what_cannot_be_used_is_compiled_again(own_store, damage):
    """A file that is whole but that this version of numba cannot read."""
    data = {"unpicklable": b"no pickle", "of another version": b"\x80\x04K\x01."}[
        damage
    ]  # the second is a pickled 1
    function = variant()
    assert function(2.0) == 5.0
    (name,) = os.listdir(own_store)
    kernel_store.save(name, data)
    again = variant()
    assert again(2.0) == 5.0
    assert not again.stats.cache_hits
    assert kernel_store.load(name) not in (None, data)


def test_a_folder_that_cannot_be_written_costs_one_line(own_store):
    own_store.write_text("a file where the folder should be")
    with pytest.warns(RuntimeWarning, match="set NUMBA_CACHE_DIR"):
        kernel_store.save("name", b"data")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kernel_store.save("name", b"data")
    assert kernel_store.load("name") is None


def test_who_has_no_home_is_told_so(monkeypatch):
    for variable in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(kernel_store.Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    monkeypatch.setattr(kernel_store, "_told", False)
    with pytest.warns(RuntimeWarning, match="there is no home folder"):
        kernel_store.save("name", b"data")
    assert kernel_store.load("name") is None


def test_what_nobody_used_for_long_goes(own_store):
    kernel_store.save("old", b"old")
    long_ago = time.time() - 2 * kernel_store.KEPT
    os.utime(own_store / "old", (long_ago, long_ago))
    kernel_store.save("new", b"new")
    assert sorted(path.name for path in own_store.iterdir()) == ["new"]


def test_what_one_process_compiles_another_waits_for_and_reads(own_store):
    """Two at once: one compiles, the other finds it ready."""
    (own_store.parent / "sixfold.py").write_text(
        "import sys\nfrom flatpush.compiled import kernel\n\n@kernel()\ndef made(x):\n    return 6.0 * x\n\n"
        "sys.stdin.readline()\n"
        "print(made(2.0), sum(made.stats.cache_hits.values()), sum(made.stats.cache_misses.values()))\n"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "cwd": own_store.parent}
    one, other = ([sys.executable, "-c", "import sixfold"] for _ in range(2))
    with started(one, **pipes) as first, started(other, **pipes) as second:
        for process in (first, second):
            process.stdin.write("\n")
            process.stdin.flush()
        told = sorted(process.stdout.read().split() for process in (first, second))
    assert told == [["12.0", "0", "1"], ["12.0", "1", "0"]]
    assert [name for name in os.listdir(own_store) if name.endswith(".lock")] == []


def test_a_claim_is_had_by_one_process_and_ends_with_it(own_store):
    code = "import sys, flatpush.kernel_store as k; print(k.claim('name'), flush=True); sys.stdin.read()"
    with started([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == "True\n"
        assert not kernel_store.claim("name", 0.1)
    assert kernel_store.claim("name", 60.0)
    assert kernel_store.claim("name")  # its own
    kernel_store.release("name")
    kernel_store.release("name")
    assert os.listdir(own_store) == []


CALLEE = "def helper(x):\n    return x * FACTOR\n"
CALLER = "def outer(x):\n    return helper(x) + 1.0\n"


def variant(callee=CALLEE, caller=CALLER, factor=2.0, helper_options=inner, extra=""):
    """A kernel in a module of its own that calls a function of another module."""
    there = {"FACTOR": factor, "__name__": "there"}
    exec(extra + callee, there)
    here = {"helper": helper_options(there["helper"]), "__name__": "here"}
    exec(extra + caller, here)
    return kernel()(here["outer"])


def test_a_kernel_is_known_by_what_it_computes():
    same = compiled._meaning(variant())
    assert compiled._meaning(variant()) == same
    assert compiled._meaning(variant(extra="# a comment\n\nUNUSED = 3\n")) == same
    others = [
        variant(callee="def helper(x):\n    return FACTOR * x + x\n"),
        variant(factor=3.0),
        variant(factor=np.array([2.0, 1.0])),
        variant(caller="def outer(x):\n    return helper(x) + 2.0\n"),
        variant(helper_options=compiled.block),
        kernel(fused=True)(variant().py_func),
    ]
    meanings = [compiled._meaning(other) for other in others]
    assert len({same, *meanings}) == 1 + len(others)


def test_a_changed_callee_in_another_file_is_noticed(own_store):
    """numba's own cache returned the old result here, without a word."""
    assert variant()(2.0) == 5.0
    assert variant(factor=10.0)(2.0) == 21.0
    assert len(os.listdir(own_store)) == 2
    again = variant()
    assert again(2.0) == 5.0
    assert again.stats.cache_hits
    assert not again.stats.cache_misses


def test_a_shared_function_is_compiled_once_and_called_by_its_address(own_store):
    there = {"FACTOR": 2.0, "__name__": "there"}
    exec(CALLEE, there)
    helper = compiled.shared(1.0, 1.0)(there["helper"])
    callers = []
    for number in ("1.0", "7.0"):
        here = {"helper": helper, "__name__": "here"}
        exec(CALLER.replace("1.0", number), here)
        callers.append(kernel()(here["outer"]))
    assert [caller(2.0) for caller in callers] == [5.0, 11.0]
    assert callers[0](2) == 5.0  # an integer becomes what the shared function takes
    assert sum(name.startswith("helper") for name in os.listdir(own_store)) == 1
    again = kernel()(callers[0].py_func)
    assert again(2.0) == 5.0
    assert again.stats.cache_hits
    compiled.shared(1.0, 1.0)(there["helper"])  # known by what it computes: no second file
    assert sum(name.startswith("helper") for name in os.listdir(own_store)) == 1


def test_fields_of_named_tuples_are_part_of_a_signature():
    """Two orders of the same fields have the same text in numba, and different code."""
    from collections import namedtuple

    import numba

    one, other = namedtuple("Pair", "a b"), namedtuple("Pair", "b a")
    texts = {compiled._spelled(numba.typeof((kind(1.0, 2.0), 3))) for kind in (one, other)}
    assert len(texts) == 2


def test_the_clock_stands_still_between_begin_and_end(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(compiling.time, "perf_counter", lambda: now[0])
    before = compiling.clock()
    compiling.begin("outer", 2)
    now[0] += 3
    compiling.begin("helper", 0)
    now[0] += 4
    assert compiling.clock() == before
    compiling.end()
    now[0] += 5
    compiling.end()
    assert compiling.clock() == before
    now[0] += 1
    assert compiling.clock() == before + 1


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_not_collected_between_begin_and_end_and_then_as_before(collects):
    was = gc.isenabled()
    try:
        (gc.enable if collects else gc.disable)()
        compiling.begin("a kernel", 2)
        compiling.begin("a function in it", 0)
        assert not gc.isenabled()
        compiling.end()
        assert not gc.isenabled()
        compiling.end()
        assert gc.isenabled() == collects
    finally:
        (gc.enable if was else gc.disable)()


def test_who_listens_hears_what_is_compiled_and_nothing_when_nothing_is(own_store):
    heard = []
    compiling.listen(heard.append)
    try:
        assert variant(factor=4.0)(2.0) == 9.0
        assert [(work.kernel, work.done, work.of, work.over) for work in heard] == [
            ("here.outer", 0, 2, False),
            ("here.outer", 1, 2, False),
            ("here.outer", 2, 2, True),
        ]
        heard.clear()
        assert variant(factor=4.0)(2.0) == 9.0
        assert heard == []
    finally:
        compiling._listeners.remove(heard.append)


def test_a_kernel_that_does_not_compile_leaves_the_clock_running(own_store):
    with pytest.raises(Exception, match="no_such"):
        variant(callee="def helper(x):\n    return x.no_such + FACTOR\n")(2.0)
    assert not compiling.busy()


def test_an_interrupt_that_the_compiler_dropped_is_raised_after_it(own_store, monkeypatch):
    """Ctrl-C in LLVM's callback left no object code, and a traceback of numba's with status 1."""
    monkeypatch.setattr(kernel_store, "save", lambda *_: pytest.fail("half a kernel is kept"))
    nothing = Mock(side_effect=RuntimeError("no compiled object yet"))
    monkeypatch.setattr("numba.core.codegen.CodeLibrary._get_compiled_object", nothing)
    with pytest.raises(KeyboardInterrupt):
        variant()(2.0)
    assert not compiling.busy()
    code = (
        "import sys; from flatpush.cli.app import _show_unraisable; sys.unraisablehook = _show_unraisable\n"
    )
    code += "class Dropped:\n    def __del__(self):\n        raise self.error\n"
    code += (
        "for kind in (KeyboardInterrupt, ValueError):\n    one = Dropped(); one.error = kind('x'); del one"
    )
    told = python("-c", code).stderr
    assert "ValueError: x" in told
    assert "KeyboardInterrupt" not in told


def test_neither_the_clock_nor_the_controllers_import_numba():
    code = "import sys, flatpush.control, flatpush.compiling; sys.exit('numba' in sys.modules)"
    assert python("-c", code).returncode == 0


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_elsewhere_than_on_a_terminal_one_line_tells_of_compiling():
    stream = io.StringIO()
    notice = CompilingNotice(stream)
    for kernel_name in ("simulation.roll", "planning.descend"):
        notice(compiling.Work(kernel_name, 0, 2))
        notice(compiling.Work(kernel_name, 2, 2, over=True))
    (line,) = stream.getvalue().splitlines()
    assert line.startswith("compiling simulation.roll")


def test_a_terminal_shows_how_far_compiling_is_and_is_left_clean():
    stream = Terminal()
    notice = CompilingNotice(stream, period=0.005)
    notice(compiling.Work("simulation.roll", 5, 20))
    assert until(lambda: "simulation.roll █████··············· 5 of 20, 0 s" in stream.getvalue())
    notice(compiling.Work("simulation.roll", 20, 20, over=True))
    assert until(lambda: stream.getvalue().endswith("\r\033[K"))
