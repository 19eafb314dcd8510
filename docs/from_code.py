"""Directives that write pages from the code: `commands` (help of every command) and `public-names` (the API)."""

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.application import Sphinx


def help_texts() -> dict[str, str]:
    """What `flatpush COMMAND --help` prints, by command."""
    import os

    os.environ["COLUMNS"] = os.environ["TERMINAL_WIDTH"] = "76"
    import click
    from typer.main import get_command

    from flatpush.cli.app import app

    program = get_command(app)
    context = click.Context(program, info_name="flatpush", terminal_width=76, max_content_width=76)
    found = {}
    for name, command in program.commands.items():
        inside = click.Context(
            command, info_name=name, parent=context, terminal_width=76, max_content_width=76
        )
        found[name] = command.get_help(inside)
    return found


class Commands(Directive):
    """A section for each command."""

    def run(self) -> list[nodes.Node]:
        sections = []
        for name, text in help_texts().items():
            section = nodes.section(ids=[f"flatpush-{name}"])
            section += nodes.title(text=f"flatpush {name}")
            section += nodes.literal_block(text, text, language="text")
            sections.append(section)
        return sections


class PublicNames(Directive):
    """autodoc of every name of flatpush, grouped by the folder it comes from."""

    def run(self) -> list[nodes.Node]:
        import flatpush

        lines = []
        for name in flatpush.__all__:
            if name.startswith("_") or name == "dubins":
                continue
            value = getattr(flatpush, name)
            kind = "autoclass" if isinstance(value, type) else "autofunction"
            lines += [f".. {kind}:: flatpush.{name}", ""]
        lines += [".. automodule:: flatpush.dubins", "   :members:", ""]
        node = nodes.section()
        node.document = self.state.document
        self.state.nested_parse(StringList(lines, source="public-names"), 0, node)
        return node.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("commands", Commands)
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True}
