"""Errors carried past typer, which would turn some of them into an exit status of its own."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec

P = ParamSpec("P")


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
            return command(*args, **kwargs)
        except BaseException as error:
            raise CarriedError(error) from error

    return run
