"""Entry point: runs a command and turns whatever goes wrong into a message and an exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from gelslim_cad.cli.app import app
from gelslim_cad.cli.failure import explain_failure


def main(argv: Sequence[str] | None = None) -> int:
    """Run `gelslim` with `argv` (default: the process's) and return its exit status.

    0: done. 1: a design rule fails. 2: bad input. 3: a fault of gelslim itself.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        status = app(args=arguments, prog_name="gelslim", standalone_mode=False)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of a pipe has gone: nothing is left to say, and nobody to say it to.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 141
    except BaseException as error:
        if isinstance(error, SystemExit):
            raise
        return explain_failure(error, as_json="--json" in arguments)
    return int(status or 0)
