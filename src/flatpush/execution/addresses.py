"""Robots by their addresses: `sim`, `egm://192.168.125.1:6510`, `mujoco://irb120?seed=3`, or one of your own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.metadata import entry_points
from math import inf, isfinite, radians
from urllib.parse import parse_qsl, urlsplit

from ..errors import InputError
from ..problem import Plan
from .arms import arm_named
from .robot import Limits, Robot

GROUP = "flatpush.robots"
# No patience is shorter [s].
SOON = 0.001
# Name → function that makes one from an address and a plan; those of others come by the entry points of GROUP.
BUILT_IN = {
    "sim": "flatpush.execution.simulated:sim",
    "dry-run": "flatpush.execution.simulated:dry_run",
    "egm": "flatpush.execution.egm:egm",
    "ur": "flatpush.execution.ur:ur",
    "franka": "flatpush.execution.franka:franka",
    "mujoco": "flatpush.execution.cell.robot:mujoco",
}


@dataclass
class Address:
    """NAME, or NAME://HOST:PORT, and ?KEY=VALUE&…; lengths in mm and angles in degrees.

    Attributes:
        text: the whole. name, host: its parts, "" where there is none. port: the number of one, or None.
        base: pose of the table in the robot's base frame (x, y, z, yaw) [m, rad].
        options: what follows the question mark.
    """

    text: str
    name: str
    host: str = ""
    port: int | None = None
    base: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    options: dict[str, str] = field(default_factory=dict)
    _used: set[str] = field(default_factory=set)

    @classmethod
    def parse(cls, text: str, base: Sequence[float] | None = None) -> "Address":
        """Reads an address; base: pose of the table in the robot's base frame (x, y, z, yaw) [m, rad].

        Raises:
            InputError: for what is none.
        """
        parts = urlsplit(
            text if "://" in text else text.replace("?", "://?", 1) if "?" in text else f"{text}://"
        )
        try:
            port = parts.port
            options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query), keep_blank_values=True))
        except ValueError as error:
            raise InputError(f"this is no address of a robot ({error})", value=text) from None
        if not parts.scheme:
            raise InputError(
                "this is no address of a robot", value=text, hint="Such as sim or egm://HOST:PORT."
            )
        where = (0.0, 0.0, 0.0, 0.0) if base is None else tuple(float(v) for v in base)
        return cls(text, parts.scheme, parts.hostname or "", port, where, options)  # type: ignore[arg-type]

    def numbers(self, key: str, count: int, default: Sequence[float], least: float = -inf) -> list[float]:
        """The numbers of an option, shape (count,), none below the least, all in the unit of the option; the default
        where it is not given.

        Raises:
            InputError: for other than so many finite numbers, or one that is below the least.
        """
        self._used.add(key)
        if key not in self.options:
            return list(default)
        try:
            values = [float(part) for part in self.options[key].split(",")]
        except ValueError:
            values = []
        if len(values) != count or not all(isfinite(value) and value >= least for value in values):
            what = "a number" if count == 1 else f"{count} numbers separated by commas"
            what += f" of at least {least:g}" if isfinite(least) else ""
            raise InputError(f"{key} takes {what}", source=self.text, value=self.options[key])
        return values

    def limits(self, given: Limits) -> Limits:
        """Those of a robot, tightened by the options workspace, heights, speed, acceleration and turn."""
        self._used |= {"workspace", "heights", "speed", "acceleration", "turn"}
        found = given
        if "workspace" in self.options:
            a, b, c, d = (v / 1000 for v in self.numbers("workspace", 4, ()))
            found = found.tightened(workspace=(a, b, c, d))
        if "heights" in self.options:
            low, high = (v / 1000 for v in self.numbers("heights", 2, ()))
            found = found.tightened(heights=(low, high))
        if "speed" in self.options:
            found = found.tightened(speed=self.numbers("speed", 1, ())[0] / 1000)
        if "acceleration" in self.options:
            found = found.tightened(acceleration=self.numbers("acceleration", 1, ())[0] / 1000)
        if "turn" in self.options:
            found = found.tightened(turn_rate=radians(self.numbers("turn", 1, ())[0]))
        return found

    def with_arm(self, given: Limits) -> Limits:
        """Limits, and those of the joints of the arm that the option arm names, `tool=MM` from flange to fingertips.

        Raises:
            InputError: for an arm that is not known, or a tool that is shorter than nothing.
        """
        self._used |= {"arm", "tool"}
        if "arm" not in self.options:
            return given
        arm = arm_named(self.options["arm"])
        (tool,) = self.numbers("tool", 1, (1000 * arm.tool,), least=0)
        return replace(given, arm=replace(arm.placed(self.base), tool=tool / 1000))

    def patience(self, connect: float, silence: float) -> tuple[float, float]:
        """The options connect and silence [s], or these."""
        (first,), (then,) = (
            self.numbers(key, 1, (usual,), least=SOON)
            for key, usual in (("connect", connect), ("silence", silence))
        )
        return first, then

    def check_used(self, port: bool = True) -> None:
        """Refuses options that this robot does not have.

        Args:
            port: whether it has one.

        Raises:
            InputError: for the first of them.
        """
        if self.port is not None and not port:
            raise InputError(f"a port cannot be chosen for {self.name}", source=self.text, value=self.port)
        for key in self.options:
            if key not in self._used:
                raise InputError(
                    f"{self.name} has no option {key!r}",
                    source=self.text,
                    hint=f"It has {', '.join(sorted(self._used))}.",
                )


def open_robot(address: str, plan: Plan, base: Sequence[float] | None = None) -> Robot:
    """The robot at an address, not yet connected: `with` connects it.

    Args:
        plan: that it shall run; a simulated robot has its object.
        base: pose of the table frame in the robot's base (x, y, z, yaw) [m, rad].

    Raises:
        InputError: for an address that makes no sense. MissingExtra: for a robot whose library is not installed.
    """
    parsed = Address.parse(address, base)
    if plan.status != "solved" or not plan.on_table:
        raise InputError(
            "there is no push to run in this plan", hint=plan.reason or "Start and goal are one."
        )
    if parsed.name in BUILT_IN:
        module, name = BUILT_IN[parsed.name].split(":")
        make: Callable[[Address, Plan], Robot] = getattr(import_module(module), name)
        return make(parsed, plan)
    others = {point.name: point for point in entry_points(group=GROUP)}
    if parsed.name not in others:
        known = ", ".join(sorted({*BUILT_IN, *others}))
        raise InputError("there is no such robot", value=address, hint=f"There are: {known}.")
    found: Robot = others[parsed.name].load()(parsed, plan)
    return found
