"""Entry point: runs a command and turns whatever goes wrong into a message and an exit status."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Sequence
from io import TextIOWrapper


def main(argv: Sequence[str] | None = None, begun: Callable[[], None] = lambda: None) -> int:
    """Run `gelslim` with `argv` (default: the process's) and return its exit status.

    0: done. 1: a design rule fails. 2: bad input. 3: a fault of gelslim itself. As shells have it,
    130 after an interrupt, 141 when the reader of a pipe has gone and 143 after SIGTERM.
    `begun` is called as a command begins; until then there is nothing to clear away.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        return _run(arguments, begun)
    except SystemExit as ended:
        # Only shell completion ends this way: it has printed its answer.
        return ended.code if isinstance(ended.code, int) else 0
    except BaseException as raised:
        return _failed(raised, as_json="--json" in arguments)


def _run(arguments: list[str], begun: Callable[[], None]) -> int:
    _open_streams()
    # Loaded here, so that an interrupt meanwhile is caught too.
    from gelslim.cli.app import app
    from gelslim.cli.carry import beginning
    from gelslim.cli.status import INTERRUPTED

    beginning.set(begun)
    status = app(args=arguments, prog_name="gelslim", standalone_mode=False)
    if status == INTERRUPTED:
        # It fell into typer, which turns it into a status.
        raise KeyboardInterrupt
    sys.stdout.flush()
    return int(status or 0)


def _open_streams() -> None:
    from gelslim.cli.spelling import SPELLED

    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            # Closed by the caller, as with `>&-`: what is said goes nowhere.
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=SPELLED)


def _failed(raised: BaseException, as_json: bool) -> int:
    from gelslim.cli.carry import CarriedError
    from gelslim.cli.failure import explain_failure
    from gelslim.cli.status import CLOSED_PIPE

    error = raised.cause if isinstance(raised, CarriedError) else raised
    if isinstance(error, BrokenPipeError):
        _silence()
        return CLOSED_PIPE
    try:
        status = explain_failure(error, as_json=as_json)
        sys.stdout.flush()
    except OSError:
        # Standard output takes nothing, be it a full disk or a pipe without a reader.
        _silence()
        status = explain_failure(error, as_json=False)
    return status


def _silence() -> None:
    """Nobody is left to say anything to; the interpreter must not try at its exit either."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
