"""A reference frame from which no calibration follows."""

from __future__ import annotations

from ifem_export.errors import IfemError


class CalibrationError(IfemError):
    """The frame does not show this sensor at rest; the message says what is wrong and what to do.

    Also raised for calibration files that cannot be read or belong to another sensor.
    """
