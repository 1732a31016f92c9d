"""The errors that the program reports to its user: their base class, and those of outputs."""

from __future__ import annotations

import errno
import os
from typing import Any


class GelslimError(Exception):
    """An error whose message says what is wrong, why, and what to do.

    Any other exception is a fault of the program itself.

    Attributes:
        exit_status: Exit status of the command line: 1 for a design rule that fails, 2 for
            input that cannot be used.
        kind: What kind of failure this is, as answers in JSON call it.
    """

    exit_status: int = 2
    kind: str = "bad input"

    def to_dict(self) -> dict[str, Any]:
        """Return the error as data for other programs.

        Returns:
            `error`, the kind, and what describes the failure: here the `message`.
        """
        return {"error": self.kind, "message": str(self)}


class OutputError(GelslimError, ValueError):
    """An output that cannot be written, or a recording that cannot be read."""


_REMEDY = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.EFBIG: "raise the limit of the file size or choose another disk",
    errno.EACCES: "check the permissions or choose another folder",
    errno.EPERM: "check the permissions or choose another folder",
    errno.EROFS: "the disk is read-only; choose another folder",
    errno.ENOTDIR: "part of the path is a file; choose another folder",
    errno.EEXIST: "a file of that name is in the way; choose another name",
    errno.ENOENT: "the folder is gone; was it moved or deleted?",
    errno.EMFILE: "too many open files; close some",
}


def disk_error(path: str | os.PathLike[str], doing: str, error: OSError) -> OutputError:
    """Return the error to raise when the disk refuses; `doing` such as "writing frame 7"."""
    reason = error.strerror or str(error)
    remedy = _REMEDY.get(error.errno or 0, "check the disk")
    return OutputError(f"{os.fspath(path)}: {reason} while {doing}; {remedy}")
