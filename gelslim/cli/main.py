"""Entry point: runs a command and turns every error into a message and an exit status."""

from __future__ import annotations

import codecs
import contextlib
import functools
import os
import sys
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from io import TextIOWrapper
from typing import ParamSpec

P = ParamSpec("P")

SPELLED = "gelslim-spelled"
"""Name of the error handler that spells characters in ASCII if a terminal cannot show them."""
_SPELLING = {
    "≥": ">=", "≤": "<=", "°": " deg", "²": "^2", "³": "^3", "·": "*", "×": "x", "π": "pi",
    "α": "alpha", "γ": "gamma", "θ": "theta", "ψ": "psi", "Φ": "Phi", "Δ": "delta ",
    "⌈": "ceil(", "⌉": ")", "⌊": "floor(", "⌋": ")",
}  # fmt: skip

command_starts: ContextVar[Callable[[], None]] = ContextVar("command_starts")
"""Function to call when typer has parsed the arguments and the command itself starts."""


class CarriedError(Exception):
    """Carries an error of a command past typer, which would turn some errors into a status."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__(str(cause))
        self.cause = cause


def carried(command: Callable[P, int]) -> Callable[P, int]:
    """Return the command, with the same signature, so that it raises only CarriedError."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> int:
        try:
            command_starts.get(_nothing)()
            return command(*args, **kwargs)
        except BaseException as error:
            raise CarriedError(error) from error

    return run


def main(argv: Sequence[str] | None = None, begun: Callable[[], None] = lambda: None) -> int:
    """Run the command line.

    Args:
        argv: Arguments; those of the process by default.
        begun: Called when the command itself starts. Until then there is nothing to clean up.

    Returns:
        The exit status: 0 after success, 1 if a design rule fails, 2 after bad input, 3 after a
        fault of the program itself. As in shells it is 130 after an interrupt, 141 if the reader of
        a pipe has closed it, and 143 after SIGTERM.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        return _run(arguments, begun)
    except SystemExit as ended:
        # Only shell completion ends like this, after it has printed its answer.
        return ended.code if isinstance(ended.code, int) else 0
    except BaseException as raised:
        return _failed(raised, as_json="--json" in arguments)


def _run(arguments: list[str], begun: Callable[[], None]) -> int:
    _open_streams()
    # Imported here, so that an interrupt during the import is caught too.
    from gelslim.cli.answer import INTERRUPTED
    from gelslim.cli.app import app

    command_starts.set(begun)
    status = app(args=arguments, prog_name="gelslim", standalone_mode=False)
    if status == INTERRUPTED:
        # typer caught the interrupt itself and turned it into a status.
        raise KeyboardInterrupt
    sys.stdout.flush()
    return int(status or 0)


def _open_streams() -> None:
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            # The caller closed it, as with `>&-`. Output is dropped.
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=SPELLED)


def _failed(raised: BaseException, as_json: bool) -> int:
    from gelslim.cli.answer import CLOSED_PIPE
    from gelslim.cli.failure import explain_failure

    error = raised.cause if isinstance(raised, CarriedError) else raised
    if isinstance(error, BrokenPipeError):
        _drop_output()
        return CLOSED_PIPE
    try:
        status = explain_failure(error, as_json=as_json)
        sys.stdout.flush()
    except OSError:
        # Standard output cannot be written: a full disk, or a pipe without a reader.
        _drop_output()
        status = explain_failure(error, as_json=False)
    return status


def _drop_output() -> None:
    """Discard the rest of standard output, so that the exit of the interpreter does not fail."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _nothing() -> None:
    """Do nothing; the default if no caller wants to know that the command starts."""


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    return "".join(_SPELLING.get(sign, "?") for sign in missing), error.end


codecs.register_error(SPELLED, _spell)
