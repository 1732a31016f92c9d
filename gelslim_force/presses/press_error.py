"""The error of presses that cannot calibrate a sensor."""

from __future__ import annotations

from typing import Literal

from gelslim_core.errors import GelslimError

Reason = Literal["table", "picture", "contact", "ball", "count", "sensor", "file"]
"""What is wrong: the table of loads, a picture that cannot be read, a press without a usable
contact, a ball of another size, too few presses, a sensor without what is needed, a file of results
that cannot be used."""


class PressError(GelslimError, ValueError):
    """Presses, or a file made from them, that cannot be used.

    Attributes:
        reason: What is wrong, in one word.
    """

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason = reason

    def __reduce__(self) -> tuple[type[PressError], tuple[object, ...]]:
        """Pickle with all attributes, so that the error crosses process boundaries."""
        return (type(self), (self.reason, str(self)))
