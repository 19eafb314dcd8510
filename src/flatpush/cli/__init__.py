"""The command line: one file per command, nothing but arguments and printing."""

from .app import main

__all__ = ["main"]
