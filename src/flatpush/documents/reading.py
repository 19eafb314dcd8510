"""Reads a YAML or JSON file into plain values, refusing what would be read otherwise than it was meant."""

import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import InputError
from .number_lists import number_lists

MOST_BYTES = 10_000_000
# Of a scene: 100,000 corners of ten bytes a number, or 50,000 at full precision; drawings are files of their own. As
# YAML it is read within a second and a half; 10 MB took twelve.
MOST_BYTES_OF_SCENE = 2_000_000
MOST_LEVELS = 60
MOST_ENTRIES = 100_000  # of one list; samples of a plan may be more
# What most of the entries of long lists are: nothing in them is looked for.
_PLAIN = frozenset((float, int, bool, str, type(None)))

# The plain scalars of YAML 1.2: unlike in YAML 1.1, 1e-3 is a number, on and off are words and 010 is ten.
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"([-+]?)\.(inf|Inf|INF)")
_WORDS: dict[str, Any] = {
    "true": True,
    "True": True,
    "TRUE": True,
    "false": False,
    "False": False,
    "FALSE": False,
}
_WORDS |= dict.fromkeys(("", "~", "null", "Null", "NULL"))
_WORDS |= dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan"))


def read_mapping(
    path: str | os.PathLike[str], most: int = MOST_BYTES, longest: int = MOST_ENTRIES
) -> dict[str, object]:
    """The document in a YAML or JSON file, as plain values in the file's own units, not checked further.

    A file named .json is read as JSON, one named .yaml or .yml as YAML; of others, one that begins with a
    brace is JSON. Numbers and words are those of YAML 1.2. A file has at most `most` bytes,
    and a list in it at most `longest` entries (a number).

    Raises:
        InputError: if the file cannot be read, is empty, binary, cut off or of more than so many bytes, holds a list
            of more than so many entries or a key twice, or uses YAML's aliases or tags.
    """
    return mapping_of(read_text(path, most), os.fspath(path), longest)


def mapping_of(text: str, source: str = "", longest: int = MOST_ENTRIES) -> dict[str, object]:
    """The document in a text, as read_mapping reads it from a file of the name `source`; a list in it has at most
    `longest` entries (a number).

    Raises:
        InputError: for a text that is empty, cut off or no document of keys and values.
    """
    kind = Path(source).suffix.lower()
    is_json = kind == ".json" or (kind not in (".yaml", ".yml") and text.lstrip().startswith("{"))
    value = None
    if text.strip():
        value = _read_json(text, source, longest) if is_json else _read_yaml(text, source, longest)
    if value is None:
        hint = '"flatpush init" writes a scene to start from.'
        raise InputError("the file is empty", source=source, hint=hint)
    if not isinstance(value, dict):
        rule = "a document is a mapping of keys to values"
        raise InputError(rule, source=source, value=value, hint=_CUT_OFF)
    return value


def read_text(path: str | os.PathLike[str], most: int = MOST_BYTES) -> str:
    """The text (UTF-8) of a file of at most so many bytes."""
    content = read_bytes(path, most)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise InputError(
            "the file is not text in UTF-8",
            source=os.fspath(path),
            hint="It looks binary: is it the right file?",
        )
    return text


def read_bytes(path: str | os.PathLike[str], most: int = MOST_BYTES) -> bytes:
    """The content of a file of at most so many bytes."""
    content = _begin(path, most + 1)
    if len(content) > most:
        raise InputError(
            f"this kind of document has at most {most // 1_000_000} MB",
            source=os.fspath(path),
            hint="Is it the right file?",
        )
    return content


def check_readable(path: str | os.PathLike[str]) -> None:
    """Refuses a file that cannot be read (InputError), before what works with it is imported."""
    _begin(path, 1)


def _begin(path: str | os.PathLike[str], count: int) -> bytes:
    """The first bytes of a file."""
    source = os.fspath(path)
    try:
        with open(path, "rb") as file:
            return file.read(count)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        folder = Path(source).parent
        hint = (
            "Check its name and your rights." if folder.is_dir() else f"There is no folder {str(folder)!r}."
        )
        if isinstance(error, IsADirectoryError):
            hint = "Name a file inside it."
        raise InputError(f"the file cannot be read ({reason})", source=source, hint=hint) from error


def plain(value: object, source: str = "", key: str = "", level: int = 0) -> object:
    """The value with tuples and NumPy arrays as lists, NumPy scalars as numbers, mappings as dicts."""
    if level > MOST_LEVELS:
        raise InputError(f"a document has at most {MOST_LEVELS} levels", source=source, key=key)
    if isinstance(value, Mapping):
        return {str(k): plain(v, source, join(key, str(k)), level + 1) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [
            v if type(v) in _PLAIN else plain(v, source, join(key, i), level + 1) for i, v in enumerate(value)
        ]
    if type(value) in _PLAIN:
        return value
    import numpy as np  # not for a file that is refused before

    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def join(path: str, step: str | int) -> str:
    """The path of a key inside a path, as in pushes[1].edge."""
    if isinstance(step, int):
        return f"{path}[{step}]"
    return f"{path}.{step}" if path else step


_MARK = "\ue000"  # of nobody's alphabet
_CUT_OFF = "Is it the right file, and is it complete?"
_TWICE = "Keep one of the two."


class _Pairs(list[tuple[str, Any]]):
    """The pairs of a JSON object, before keys that stand twice are looked for."""


def _read_json(text: str, source: str, longest: int) -> Any:
    try:
        value = json.loads(text, object_pairs_hook=_Pairs, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise InputError(
            f"this is not JSON: line {error.lineno}, column {error.colno}: {error.msg.lower()}",
            source=source,
            hint=_CUT_OFF,
        ) from None
    except RecursionError:
        raise InputError(f"a document has at most {MOST_LEVELS} levels", source=source) from None
    return _unpaired(value, source, "", 0, longest)


def _unpaired(value: Any, source: str, path: str, level: int, longest: int) -> Any:
    if level > MOST_LEVELS:
        raise InputError(f"a document has at most {MOST_LEVELS} levels", source=source, key=path)
    if isinstance(value, _Pairs):
        result: dict[str, Any] = {}
        for key, item in value:
            _refuse_twice(key, result, source, path)
            result[key] = _unpaired(item, source, join(path, key), level + 1, longest)
        return result
    if isinstance(value, list):
        _refuse_long(len(value), longest, source, path)
        return [
            v if type(v) in _PLAIN else _unpaired(v, source, join(path, i), level + 1, longest)
            for i, v in enumerate(value)
        ]
    return value


def _read_yaml(text: str, source: str, longest: int) -> Any:
    """With its long lists of numbers read as JSON, a tenth of the time; where something else comes of that, without."""
    import yaml

    # A list of as many points as it may hold, and the rest: short numbers make many in few bytes.
    in_all = 3 * longest + 20_000
    short, lists, entries = _with_marks(text, source, in_all)
    if lists:
        with suppress(yaml.YAMLError):
            value = _from_events(short, source, longest, in_all - entries, lists)
            if not lists:
                return value
    return _from_events(text, source, longest, in_all, {})


def _with_marks(text: str, source: str, in_all: int) -> tuple[str, dict[str, object], int]:
    """The text with a word for each of its long lists of numbers, the lists, and how many entries they have."""
    parts: list[str] = []
    lists: dict[str, object] = {}
    done = entries = 0
    if _MARK not in text:
        for found in number_lists(text):
            entries += found.entries
            if entries > in_all:
                _refuse_many(source, in_all)
            values = found.values(_whole)
            if values is not None:
                mark = f"{_MARK}{len(lists)}"
                lists[mark] = values
                # Deeper than where a list of lines begins, as what is a value has to be.
                parts += [text[done : found.begin], "  ", mark]
                done = found.end
    return "".join([*parts, text[done:]]), lists, entries


def _refuse_many(source: str, in_all: int) -> None:
    rule = f"a document has at most {in_all} keys, values and lists"
    raise InputError(rule, source=source, hint="Is it the right file?")


def _from_events(text: str, source: str, longest: int, in_all: int, lists: dict[str, object]) -> Any:
    """Builds the values from the parser's events, so that nothing in the file can construct anything else.

    What stands for a list of `lists` is that list, which is taken from it. It raises yaml.YAMLError if there are any.
    """
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    root: list[Any] = []
    holders: list[Any] = [root]  # the open lists and mappings, outermost first
    steps: list[Any] = [None]  # the pending key of each open mapping; None where a key comes next
    documents = 0
    count, marked = 0, bool(lists)
    node: Any = yaml.NodeEvent
    scalar, start_of_list, alias = yaml.ScalarEvent, yaml.SequenceStartEvent, yaml.AliasEvent
    try:
        for event in yaml.parse(text, Loader=loader):
            # Places are only made into words for a refusal: a large file has hundreds of thousands of entries.
            if isinstance(event, node):
                count += 1
                if count > in_all:
                    _refuse_many(source, 3 * longest + 20_000)
                if type(event) is alias or event.tag is not None or len(holders) > MOST_LEVELS:
                    _refuse_tricks(event, source, holders, steps)
                holder = holders[-1]
                is_scalar, is_mapping = type(event) is scalar, type(holder) is dict
                if is_mapping and steps[-1] is None:
                    if not is_scalar:
                        raise InputError(
                            "a key is a word",
                            source=source,
                            key=_path(holders, steps),
                            hint="Quote braces in text.",
                        )
                    if event.value in holder:
                        _refuse_twice(event.value, holder, source, _path(holders, steps))
                    steps[-1] = event.value
                    continue
                value: Any = [] if type(event) is start_of_list else {}
                if is_scalar:
                    value = _scalar(event.value) if event.implicit[0] else event.value
                    if lists and event.implicit[0] and event.value in lists:
                        path = _path(holders, steps)
                        value = _unpaired(lists.pop(event.value), source, path, len(holders), longest)
                if is_mapping:
                    holder[steps[-1]] = value
                    steps[-1] = None
                else:
                    if len(holder) == longest:
                        _refuse_long(longest + 1, longest, source, _path(holders, steps))
                    holder.append(value)
                if not is_scalar:
                    holders.append(value)
                    steps.append(None)
            elif isinstance(event, yaml.SequenceEndEvent | yaml.MappingEndEvent):
                holders.pop()
                steps.pop()
            elif isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise InputError(
                        "a file holds one document", source=source, hint="Remove the second ---."
                    )
    except yaml.YAMLError as error:
        if marked:
            raise
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable characters"
        if (
            "nesting depth" in problem
        ):  # newer parsers look so far ahead that they stop before the level is counted
            raise InputError(f"a document has at most {MOST_LEVELS} levels", source=source) from None
        raise InputError(f"this is not YAML: {place}{problem}", source=source, hint=_CUT_OFF) from None
    return root[0] if root else None


def _path(holders: list[Any], steps: list[Any]) -> str:
    """Where the next value goes; for a key, the path of its mapping."""
    path = ""
    for holder, step in zip(holders[1:], steps[1:], strict=True):
        if isinstance(holder, list):
            # An outer list already holds the value that is open in it.
            path = join(path, len(holder) - (holder is not holders[-1]))
        elif step is not None:
            path = join(path, step)
        elif holder is not holders[-1]:
            path = join(path, next(reversed(holder)))
    return path


def _refuse_tricks(event: Any, source: str, holders: list[Any], steps: list[Any]) -> None:
    import yaml

    if isinstance(event, yaml.AliasEvent):
        raise InputError(
            "aliases (*name) are not read",
            source=source,
            key=_path(holders, steps),
            value=f"*{event.anchor}",
            hint="Write it out.",
        )
    if event.tag not in (None, "!"):
        raise InputError(
            "tags (!name) are not read",
            source=source,
            key=_path(holders, steps),
            value=event.tag,
            hint="Leave it out.",
        )
    if len(holders) > MOST_LEVELS:
        rule = f"a document has at most {MOST_LEVELS} levels"
        raise InputError(rule, source=source, key=_path(holders, steps)[:80])


def _refuse_long(count: int, longest: int, source: str, path: str) -> None:
    if count > longest:
        place = re.sub(r"\[\d+\]$", "", path) if path.endswith(f"[{count - 1}]") else path
        raise InputError(f"a list has at most {longest} entries", source=source, key=place)


def _refuse_twice(key: str, mapping: Mapping[str, Any], source: str, path: str) -> None:
    if key in mapping:
        raise InputError("this key stands twice", source=source, key=join(path, key), value=key, hint=_TWICE)


def _scalar(text: str) -> Any:
    """What a word without quotes means."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return _whole(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if infinite := _INFINITE.fullmatch(text):
        return float(f"{infinite[1]}inf")
    return text


def _whole(text: str) -> int | float:
    """A whole number; one of absurd length as the nearest float."""
    return int(text) if len(text) < 40 else float(text)
