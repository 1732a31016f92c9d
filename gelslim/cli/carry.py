"""Errors carried past typer, which would turn some of them into an exit status of its own."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextvars import ContextVar
from typing import ParamSpec

P = ParamSpec("P")
beginning: ContextVar[Callable[[], None]] = ContextVar("beginning")
"""Called as a command begins: typer, which has read the words by then, ends without a word at
Ctrl-C."""


class CarriedError(Exception):
    """Holds what a command raised: an interrupt and a closed pipe as well as errors."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__(str(cause))
        self.cause = cause


def carried(command: Callable[P, int]) -> Callable[P, int]:
    """The command, raising nothing but CarriedError; its signature stays."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> int:
        try:
            beginning.get(_nothing)()
            return command(*args, **kwargs)
        except BaseException as error:
            raise CarriedError(error) from error

    return run


def _nothing() -> None:
    """Nobody asked."""
