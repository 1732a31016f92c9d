"""The error of a calibration that cannot be made or read."""

from __future__ import annotations

from typing import Literal

from ifem_export.errors import IfemError

Reason = Literal[
    "size", "dots", "lattice", "orientation", "print", "anchors", "fit", "camera", "contact",
    "bundle", "file",
]  # fmt: skip
"""What is wrong: the picture's size, too few dots, no lattice, a turned or mirrored picture,
another print, other anchors, no camera that explains the dots, a camera far out of tolerance,
something that touches the gel, a calibration of another bundle, a file that cannot be read."""


class CalibrationError(IfemError):
    """The reference picture does not show this sensor at rest.

    It is also raised for calibration files that cannot be read or belong to another sensor. The
    message says what is wrong and what to do.

    Attributes:
        reason: What is wrong, in one word.
        position_mm: Where something touches the gel, for the reason `contact`; else None.
    """

    def __init__(
        self, reason: Reason, message: str, position_mm: tuple[float, float] | None = None
    ) -> None:
        super().__init__(message)
        self.reason = reason
        self.position_mm = position_mm

    def __reduce__(self) -> tuple[type[CalibrationError], tuple[object, ...]]:
        """Pickle with all attributes, so that the error crosses process boundaries."""
        return (type(self), (self.reason, str(self), self.position_mm))
