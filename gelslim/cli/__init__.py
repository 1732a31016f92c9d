"""The command line `gelslim`: one module per command, everything heavy imported when used."""

from gelslim.cli.main import main

__all__ = ["main"]
