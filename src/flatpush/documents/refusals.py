"""Turns what a model finds wrong with a document into one InputError in the terms of the document."""

import re
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from ..errors import InputError
from .reading import join

Model = TypeVar("Model", bound=BaseModel)


def checked(model: type[Model], document: object, source: str = "", prefix: str = "") -> Model:
    """The document as a model.

    Raises:
        InputError: for the first thing that is wrong; it tells how many more there are. In one mapping an
            unknown key comes first, because a misspelt key is also a missing one, and before all a document of
            another kind.
    """
    kind = model.model_fields.get("flatpush")
    if kind is not None and isinstance(document, dict) and "flatpush" in document:
        read, found = get_args(kind.annotation), document["flatpush"]
        if read and found not in read:
            hint = "Is it the right file?"
            raise InputError(
                f"this flatpush reads {read[0]} here",
                source=source,
                key=join(prefix, "flatpush"),
                value=found,
                hint=hint,
            )
    try:
        return model.model_validate(document)
    except ValidationError as failure:
        errors = failure.errors(include_url=False)
    raise refusal(model, errors, document, source, prefix)


def refusal(
    model: type[BaseModel], errors: Sequence[ErrorDetails], document: object, source: str, prefix: str
) -> InputError:
    error = errors[0]
    steps = _steps(error["loc"])
    rule, hint = _rule(error)
    if error["type"] == "unknown_key":
        steps = (*steps, error["ctx"]["key"])
    value = value_at(document, steps)
    if not hint:
        hint = description(model, _path(steps, ""))
    if error["type"] == "missing":
        value = None
    elif value is None:
        rule += ", nothing is given"
    if len(errors) > 1:
        hint = f"{hint} ({len(errors) - 1} more to correct after this one.)".strip()
    return InputError(rule, source=source, key=_path(steps, prefix), value=value, hint=hint)


def value_at(document: object, steps: Sequence[str | int]) -> object:
    """What stands at a path of a document; None if nothing does."""
    for step in steps:
        try:
            document = document[step]  # type: ignore[index]
        except (KeyError, IndexError, TypeError):
            return None
    return document


def description(model: type[BaseModel], key: str) -> str:
    """What the model says of a key, such as pushes[1].edge; empty if nothing."""
    return descriptions(model.model_json_schema()).get(re.sub(r"\[\d+\]", "", key), "")


def descriptions(schema: dict[str, Any]) -> dict[str, str]:
    """The description of every key of a JSON Schema, by its path without the places in lists."""
    found: dict[str, str] = {}

    def visit(node: dict[str, Any], path: str) -> None:
        if "$ref" in node:
            visit(schema["$defs"][node["$ref"].rsplit("/", 1)[1]], path)
        for key, child in node.get("properties", {}).items():
            found.setdefault(join(path, key), child.get("description", ""))
            visit(child, join(path, key))
        for child in (*node.get("anyOf", ()), *node.get("oneOf", ()), *node.get("allOf", ())):
            visit(child, path)
        if isinstance(node.get("items"), dict):
            visit(node["items"], path)

    visit(schema, "")
    return found


def nearest(word: object, known: Sequence[str]) -> str:
    """A hint that names the nearest of the known words, or all of them."""
    close = get_close_matches(str(word), known, 1, 0.6)
    return f"Did you mean {close[0]!r}?" if close else f"Known keys: {', '.join(known)}."


def _rule(error: ErrorDetails) -> tuple[str, str]:
    """The rule that is broken, and a hint that goes beyond the description of the key."""
    kind, ctx, value = error["type"], error.get("ctx", {}), error.get("input")
    if kind == "unknown_key":
        return "unknown key", nearest(ctx["key"], ctx["known"])
    if kind == "form":
        return ctx["rule"], ""
    if kind == "missing":
        return "this key is missing", ""
    if kind in ("float_type", "int_type", "int_from_float"):
        what = "a number is needed" if kind == "float_type" else "a whole number is needed"
        return what, "Write it without quotes and without a unit." if isinstance(value, str) else ""
    if kind == "finite_number":
        return "a finite number is needed", ""
    if kind in _BOUNDS:
        return f"a number {_BOUNDS[kind]} {next(iter(ctx.values())):g} is needed", ""
    if kind == "string_too_short":
        return "an empty text is not enough", ""
    if kind in ("too_short", "too_long"):
        most, least, count = ctx.get("max_length"), ctx.get("min_length"), ctx["actual_length"]
        return f"at {'most' if most else 'least'} {most or least} entries are needed, not {count}", ""
    if kind == "literal_error":
        words = [word.strip("'") for word in ctx["expected"].replace(" or ", ", ").split(", ")]
        close = nearest(value, words) if isinstance(value, str) else ""
        return f"{ctx['expected']} is needed", close if close.startswith("Did") else ""
    return _TYPES.get(kind, str(error["msg"]).lower()), ""


_BOUNDS = {
    "greater_than": "greater than",
    "greater_than_equal": "of at least",
    "less_than": "less than",
    "less_than_equal": "of at most",
}
_TYPES = {
    "bool_type": "true or false is needed",
    "string_type": "a text is needed",
    "list_type": "a list is needed",
    "model_type": "a mapping of keys to values is needed",
    "dict_type": "a mapping of keys to values is needed",
}


def _steps(loc: Sequence[str | int]) -> tuple[str | int, ...]:
    return tuple(step for step in loc if not (isinstance(step, str) and step.startswith("<")))


def _path(steps: Sequence[str | int], prefix: str) -> str:
    for step in steps:
        prefix = join(prefix, step)
    return prefix
