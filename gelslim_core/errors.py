"""The base class of all errors that the program reports to its user."""

from __future__ import annotations

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
        """The error for programs.

        Returns:
            `error`, the kind, and what describes the failure: here the `message`.
        """
        return {"error": self.kind, "message": str(self)}
