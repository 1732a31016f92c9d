"""Found by the programs under test as they start: tells when they reach their first line.

With FIRST_LINE, a file of that name is made at the first import of `gelslim.__main__`, which lies
within its guard; a signal before that would meet the interpreter alone. With SIGNAL_AT, such as
`change:7:2`, signal 2 is sent to the whole group at the seventh call after it that opens a file
for writing, makes, moves or removes one, caches of compiled code apart; `import:7:2` at the seventh
import.
"""

from __future__ import annotations

import contextlib
import os
import sys

MARK = os.environ.get("FIRST_LINE", "")
ENTRY = os.path.join("gelslim", "__main__.py")
KIND, _, WHEN = os.environ.get("SIGNAL_AT", "").partition(":")
CHANGES = ("os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link")
CACHED = ("__pycache__", ".nbi", ".nbc", MARK)
seen = {"first line": 0, "marked": 0, "calls": 0}


def _first_line(event, args):  # type: ignore[no-untyped-def]
    if event == "exec" and str(getattr(args[0], "co_filename", "")).endswith(ENTRY):
        seen["first line"] = 1
    elif event == "import" and seen["first line"] and not seen["marked"]:
        seen["marked"] = 1
        with contextlib.suppress(OSError):
            os.close(os.open(MARK, os.O_CREAT | os.O_WRONLY, 0o600))


def _counts(event, args):  # type: ignore[no-untyped-def]
    if KIND == "import":
        return event == "import"
    writes = event == "open" and isinstance(args[2], int) and args[2] & (os.O_WRONLY | os.O_RDWR)
    return (writes or event in CHANGES) and not any(word in str(args[0]) for word in CACHED)


def _signal(event, args):  # type: ignore[no-untyped-def]
    if seen["first line"] and _counts(event, args):
        seen["calls"] += 1
        at, _, number = WHEN.partition(":")
        if seen["calls"] == int(at):
            os.killpg(0, int(number))


if MARK:
    sys.addaudithook(_first_line)
if MARK and KIND:
    sys.addaudithook(_signal)
