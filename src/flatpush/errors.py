"""The errors that flatpush raises; all derive from FlatpushError and carry the values they speak of."""


class FlatpushError(Exception):
    """Anything that flatpush refuses, in the caller's terms."""


class InputError(FlatpushError, ValueError):
    """A document or an argument that breaks a rule.

    The message names, as far as they are known, the file, the path of the key, the value, the rule and a hint;
    the same five are kept as attributes.
    """

    def __init__(
        self, rule: str, *, source: str = "", key: str = "", value: object = None, hint: str = ""
    ) -> None:
        self.rule, self.source, self.key, self.value, self.hint = rule, source, key, value, hint
        where = ": ".join(part for part in (source, key) if part)
        got = "" if value is None else f", got {_short(value)}"
        text = f"{where}: {rule}{got}" if where else f"{rule}{got}"
        super().__init__(f"{text}. {hint}" if hint else text)


class NoDubinsReduction(FlatpushError, ValueError):
    """A push that cannot turn both ways, so that no car stands for it ([Zhou2017] Sec. 3.2.2; docs/errata.md row 9).

    Attributes:
        degrees: the angle by which the straight force misses the inside of the friction cone [deg]; 0 where the
            refusal has another reason.
    """

    def __init__(self, message: str, degrees: float = 0.0) -> None:
        self.degrees = degrees
        super().__init__(message)


class MissingExtra(FlatpushError, ImportError):
    """A feature whose optional dependency is not installed; the message is the line that installs it."""


def _short(value: object, most: int = 80) -> str:
    # Arrays and numpy's numbers are shown as plain lists and numbers.
    plain = getattr(value, "tolist", None)
    found = value if plain is None else plain()
    if isinstance(found, list | tuple | str):
        found = found[:most]  # every entry takes a place at least, and the rest would not be shown
    text = repr(found)
    return text if len(text) <= most else text[: most - 1] + "…"
