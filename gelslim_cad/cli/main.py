"""Entry point: runs a command and turns whatever goes wrong into a message and an exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper

from gelslim_cad.cli.app import app
from gelslim_cad.cli.carry import CarriedError
from gelslim_cad.cli.failure import explain_failure
from gelslim_cad.cli.spelling import SPELLED
from gelslim_cad.cli.status import CLOSED_PIPE


def main(argv: Sequence[str] | None = None) -> int:
    """Run `gelslim` with `argv` (default: the process's) and return its exit status.

    0: done. 1: a design rule fails. 2: bad input. 3: a fault of gelslim itself. As shells have it,
    130 after an interrupt and 141 when the reader of a pipe has gone.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=SPELLED)
    try:
        status = app(args=arguments, prog_name="gelslim", standalone_mode=False)
        sys.stdout.flush()
    except SystemExit as ended:
        # Only shell completion ends this way: it has printed its answer.
        return ended.code if isinstance(ended.code, int) else 0
    except BaseException as raised:
        error = raised.cause if isinstance(raised, CarriedError) else raised
        if isinstance(error, BrokenPipeError):
            # Nobody is left to say anything to; the interpreter must not try at its exit either.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return CLOSED_PIPE
        return explain_failure(error, as_json="--json" in arguments)
    return int(status or 0)
