"""The program `flatpush`, called in this process: the same from its arguments on, without a start of its own."""

import contextlib
import io
import subprocess
import sys
import warnings
from pathlib import Path
from unittest import mock

from flatpush.cli import main


def flatpush(*arguments: object, folder: Path | str = ".") -> subprocess.CompletedProcess[str]:
    """How a command ends in a folder: status, and what it wrote to standard output and standard error."""
    words = ["flatpush", *map(str, arguments)]
    out, err, status = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.object(sys, "argv", words),
        mock.patch.object(warnings, "showwarning"),  # which main() sets
    ):
        try:
            main()
        except SystemExit as ended:
            status = int(ended.code or 0)
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())
