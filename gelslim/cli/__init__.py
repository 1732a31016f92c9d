"""The command line `gelslim`: one module per command. Heavy libraries load when they are used."""

from gelslim.cli.main import main

__all__ = ["main"]
