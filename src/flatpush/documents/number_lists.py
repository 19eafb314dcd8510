"""Long lists of numbers in a YAML text, which are read as JSON in a tenth of the time."""

import json
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

# Shorter ones are left to the parser of YAML: so many characters.
_LONG = 1000
_NUMBER = "[-+0-9.eE]+"
# In brackets; and lines of pairs, as "- [1, 2]" or as "- - 1" above "- 2".
_FORMS = (
    re.compile(r"\[[-+0-9.eE, \[\]]*(?:\n(?! *- )[-+0-9.eE, \[\]]*)*"),
    re.compile(r"(?:^ *- \[[-+0-9.eE, ]*\]\n)+", re.MULTILINE),
    re.compile(rf"(?:^ *- - {_NUMBER}\n *- {_NUMBER}\n)+", re.MULTILINE),
)


class NumberList(NamedTuple):
    """Where it stands in a text, and the same in JSON."""

    begin: int
    end: int
    text: str

    @property
    def entries(self) -> int:
        """About as many numbers and lists as it holds."""
        return self.text.count(",") + self.text.count("[") + 1

    def values(self, whole: Callable[[str], int | float]) -> object:
        """As lists and numbers, whole ones read by a function; None where YAML may mean something else."""
        try:
            return json.loads(self.text, parse_int=whole)
        except (ValueError, RecursionError):
            return None


def number_lists(text: str) -> list[NumberList]:
    """The long ones, first to last, that do not overlap."""
    found: list[NumberList] = []
    for one in sorted(_candidates(text)):
        if not found or one.begin >= found[-1].end:
            found.append(one)
    return found


def _candidates(text: str) -> Iterator[NumberList]:
    brackets, rows, columns = _FORMS
    for match in brackets.finditer(text):
        end = match[0].rfind("]") + 1
        if end > _LONG:
            yield NumberList(match.start(), match.start() + end, match[0][:end])
    for form, item in ((rows, "- "), (columns, "- - ")):
        for match in form.finditer(text):
            lines = match[0]
            if len(lines) > _LONG:
                indent = " " * (len(lines) - len(lines.lstrip(" ")))
                flat = f"\n{lines[:-1]}".replace(f"\n{indent}{item}", "],[" if form is columns else ",")
                if form is columns:
                    flat = flat.replace(f"\n{indent}  - ", ",")[1:] + "]"
                whole = text[max(0, match.start() - 2) : match.start()] == ":\n"
                whole = whole and not text.startswith(f"{indent}-", match.end())
                if whole and "\n" not in flat:  # all of a key's value, and all lines are indented alike
                    yield NumberList(match.start() + len(indent), match.end() - 1, f"[{flat[1:]}]")
