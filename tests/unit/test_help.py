"""The help of every command is read as sentences, and says in words what to put in."""

import pytest
from typer.main import get_command

from flatpush.cli.app import app

TOP = get_command(app).commands
# A command that has commands is told by these.
COMMANDS = {name: one for name, one in TOP.items() if not hasattr(one, "commands")}
COMMANDS |= {
    f"{name} {inner}": one
    for name, group in TOP.items()
    if hasattr(group, "commands")
    for inner, one in group.commands.items()
}


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_argument_and_option_is_told(name):
    told_of = [parameter for parameter in COMMANDS[name].params if parameter.name != "help"]
    assert told_of
    for parameter in told_of:
        told = parameter.help or ""
        assert told.endswith("."), f"{name} {parameter.name}: {told!r}"
        assert not told.startswith(("Of ", "In ")), f"{name} {parameter.name}: {told!r}"
        if not getattr(parameter, "is_flag", False):
            assert parameter.metavar, f"{name} {parameter.name} takes something that is not named"
