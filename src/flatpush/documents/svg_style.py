"""The style of elements of an SVG drawing: attributes, style sheets and what is inherited."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

INHERITED = (
    "visibility", "color", "fill", "stroke", "fill-opacity", "stroke-opacity", "stroke-width", "stroke-dasharray",
    "marker-start", "marker-mid", "marker-end",
)  # fmt: skip
# Properties that tell what is seen, and where. A rule of a style sheet that touches none of these is not read.
GEOMETRY = ("x", "y", "width", "height", "rx", "ry", "cx", "cy", "r", "d")
MASKS = ("mask", "mask-image", "-webkit-mask", "-webkit-mask-image")
USED = (
    *INHERITED, *GEOMETRY, *MASKS, "display", "opacity", "clip-path", "filter", "marker", "overflow", "stop-opacity",
    "stop-color",
    "transform", "transform-origin", "transform-box", "translate", "rotate", "scale", "offset-path",
)  # fmt: skip
# Those that an attribute of the same name does not set, as it means another thing or nothing.
_ONLY_STYLE = ("translate", "rotate", "scale", "offset-path", "marker")


@dataclass(eq=False)
class Element:
    """An element of a drawing: its tag without namespace, attributes (those of other namespaces as prefix:name)
    and the line it begins in."""

    tag: str
    attributes: dict[str, str]
    line: int
    parent: "Element | None" = None
    children: list["Element"] = field(default_factory=list)
    text: str = ""
    order: int = 0  # among its siblings

    @property
    def place(self) -> str:
        name = self.attributes.get("id") or self.attributes.get("inkscape:label") or ""
        return f"<{self.tag}{f' {name!r}' if name else ''}> in line {self.line}"


class Unsupported(Exception):
    """Something in a style sheet that is not understood and may decide what is seen."""


@dataclass(frozen=True)
class Rule:
    """Declarations for elements that a selector picks: compound selectors from the element upwards, each with how it
    is joined to the next ("" or ">"), and the specificity."""

    selector: tuple[tuple[tuple[str, ...], str], ...]
    rank: tuple[int, int, int, int]
    declarations: Mapping[str, tuple[str, bool]]


def style_of(element: Element, rules: list[Rule], parent: Mapping[str, str]) -> dict[str, str]:
    """The values of the properties that are set on an element or inherited from its parent's."""
    ranked: dict[str, tuple[tuple[int, ...], str]] = {}

    def put(name: str, value: str, rank: tuple[int, ...]) -> None:
        if name not in ranked or rank >= ranked[name][0]:
            ranked[name] = (rank, value)

    for name in USED:
        if name in element.attributes and name not in _ONLY_STYLE:
            put(name, element.attributes[name].strip(), (0, 0))
    for rule in rules:
        if _matches(element, rule.selector):
            for name, (value, important) in rule.declarations.items():
                put(name, value, (2 if important else 1, 0, *rule.rank))
    for name, (value, important) in declarations(element.attributes.get("style", "")).items():
        put(name, value, (2 if important else 1, 1))
    if "marker" in ranked:
        rank, value = ranked.pop("marker")
        for name in ("marker-start", "marker-mid", "marker-end"):
            put(name, value, rank)
    style = {name: parent[name] for name in INHERITED if name in parent}
    for name, (_, value) in ranked.items():
        word = value.lower()
        if word == "inherit" or (word == "unset" and name in INHERITED):
            value = parent.get(name, "")
        elif word in ("initial", "unset", "revert"):
            value = ""
        elif "var(" in word:
            raise Unsupported(f"its {name} is {value!r}")
        style[name] = value
    return style


def declarations(text: str) -> dict[str, tuple[str, bool]]:
    """The declarations that tell what is seen, each a value and whether it is important."""
    found: dict[str, tuple[str, bool]] = {}
    for part in _veiled(text).split(";"):
        name, colon, value = part.partition(":")
        name, value = name.strip().lower(), value.translate(_UNVEIL)
        if not colon or name not in USED:
            if name == "all":
                raise Unsupported(f"its style has all: {value.strip()}")
            continue
        value, mark, word = value.partition("!")
        important = bool(mark) and word.strip().lower() == "important"
        if name in found and found[name][1] and not important:
            continue
        found[name] = (value.strip(), important)
    return found


def sheet_rules(text: str, before: int) -> list[Rule]:
    """The rules of a style sheet; before: number of rules in the sheets before it.

    Raises:
        Unsupported: where it cannot be told what a rule that matters applies to.
    """
    rules: list[Rule] = []
    text = _veiled(text).replace("<!--", "").replace("-->", "")
    for prelude, body in _blocks(text):
        if prelude.startswith("@"):
            word = prelude.split()[0].split("(")[0]
            if word in ("@import",) or any(declarations(part) for _, part in _blocks(body)):
                raise Unsupported(f"the style sheet has {word}")
            continue
        if "{" in body:
            raise Unsupported("the style sheet has rules in rules")
        wanted = declarations(body)
        if not wanted:
            continue
        for selector in prelude.split(","):
            if _NEVER.search(selector) and not set("()") & set(selector):
                continue
            steps = _selector(selector)
            names = [simple for compound, _ in steps for simple in compound]
            rank = (
                sum(name[0] == "#" for name in names),
                sum(name[0] == "." for name in names),
                sum(name[0] not in "#.*" for name in names),
                before + len(rules),
            )
            rules.append(Rule(steps, rank, wanted))
    return rules


# Comments, and what may hold letters that mean something elsewhere: texts in quotes and addresses.
_WHOLE = re.compile(r"""/\*.*?\*/|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|url\([^)'"]*\)""", re.S)
_VEIL = {ord(letter): 0xE000 + ord(letter) for letter in ";{}"}
_UNVEIL = {veil: letter for letter, veil in _VEIL.items()}
# A state that nothing in a drawing on paper has.
_NEVER = re.compile(r":(hover|active|focus|focus-within|focus-visible|visited|target)(?![\w-])", re.I)
_SIMPLE = re.compile(r"[#.]?[\w-]+|\*")


def _veiled(text: str) -> str:
    """A style without comments, in which ; { } within quotes and addresses are other letters, until _UNVEIL."""
    return _WHOLE.sub(lambda found: "" if found[0][0] == "/" else found[0].translate(_VEIL), text)


def _blocks(text: str) -> Iterator[tuple[str, str]]:
    """What stands before braces, and in them; statements without braces have an empty body."""
    start, place = 0, 0
    while place < len(text):
        if text[place] == ";":
            yield text[start:place].strip(), ""
            start = place + 1
        elif text[place] == "{":
            level, end = 1, place + 1
            while end < len(text) and level:
                level += {"{": 1, "}": -1}.get(text[end], 0)
                end += 1
            yield text[start:place].strip(), text[place + 1 : end - 1]
            start, place = end, end - 1
        place += 1


def _selector(text: str) -> tuple[tuple[tuple[str, ...], str], ...]:
    steps: list[tuple[tuple[str, ...], str]] = []
    joint = ""
    for word in text.replace(">", " > ").split():
        if word == ">":
            joint = ">"
            continue
        simple = _SIMPLE.findall(word)
        if "".join(simple) != word:
            raise Unsupported(f"the style sheet has the selector {text.strip()!r}")
        steps.append((tuple(simple), joint))
        joint = ""
    # From the element upwards, each with how it is joined to the one above it.
    return tuple(reversed(steps))


def _matches(element: Element, selector: tuple[tuple[tuple[str, ...], str], ...]) -> bool:
    if not selector:
        return False
    (compound, joint), rest = selector[0], selector[1:]
    classes = element.attributes.get("class", "").split()
    for simple in compound:
        if simple == "*":
            continue
        if simple[0] == "#":
            good = element.attributes.get("id") == simple[1:]
        elif simple[0] == ".":
            good = simple[1:] in classes
        else:
            good = element.tag == simple
        if not good:
            return False
    if not rest:
        return True
    above = element.parent
    while above is not None:
        if _matches(above, rest):
            return True
        if joint == ">":
            return False
        above = above.parent
    return False
