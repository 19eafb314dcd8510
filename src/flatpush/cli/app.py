"""The program `flatpush`: its commands, and how errors end it.

Exit status: 0 done · 2 bad input or usage · 3 no plan · 4 a plan that fails verification · 130 interrupted.
"""

import sys
import warnings

import typer

from .. import compiling
from ..errors import FlatpushError
from . import (
    calibrate,
    camera,
    demonstrate,
    describe,
    experiment,
    export,
    identify,
    init,
    plan,
    replay,
    run,
    simulate,
    track,
    verify,
    view,
)
from .common import CompilingNotice

app = typer.Typer(
    name="flatpush",
    help="Plan, check and simulate planar pushing.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("plan")(plan.command)
app.command("verify")(verify.command)
app.command("simulate")(simulate.command)
app.command("describe")(describe.command)
app.command("export")(export.command)
app.command("track")(track.command)
app.command("run")(run.command)
app.command("identify")(identify.command)
app.command("calibrate")(calibrate.command)
app.command("replay")(replay.command)
app.add_typer(camera.app)
app.command("init")(init.command)
app.command("view")(view.command)
app.command("demonstrate")(demonstrate.command)
app.command("experiment")(experiment.command)


def _version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        typer.echo(f"flatpush {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Plan, check and simulate planar pushing: an object pushed by fingers that stick to it steers like a car."""


def main() -> None:
    """Runs a command; an error is one message on standard error, without a traceback."""
    warnings.showwarning = _show_warning
    sys.unraisablehook = _show_unraisable
    silence = compiling.listen(CompilingNotice(sys.stderr))
    try:
        status = app(standalone_mode=False)
    except typer.Abort:
        sys.exit(130)
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        sys.exit(130)
    except FlatpushError as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(2)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        typer.echo(f"error: {where}{error.strerror or error}", err=True)
        sys.exit(2)
    except Exception as error:
        if hasattr(error, "show") and hasattr(error, "exit_code"):  # a usage error of the argument parser
            error.show()
            sys.exit(2)
        raise
    finally:
        silence()
    sys.exit(status if isinstance(status, int) else 0)


def _show_unraisable(told: "sys.UnraisableHookArgs") -> None:
    """Ctrl-C in a callback of the compiler is raised again after it (see flatpush.compiled)."""
    if told.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(told)


def _show_warning(message, category, filename, lineno, file=None, line=None) -> None:  # type: ignore[no-untyped-def]
    typer.echo(f"warning: {message}", err=True)
