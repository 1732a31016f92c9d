"""The error of a sensor that cannot be imported."""

from __future__ import annotations

from typing import Any

from gelslim_core.errors import GelslimError


class ImportSensorError(GelslimError, ValueError):
    """The picture does not fit the description of the sensor.

    Attributes:
        field: Part of the description that does not fit, such as `markers.pitch_mm`.
    """

    kind = "sensor that does not fit its picture"

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field

    def to_dict(self) -> dict[str, Any]:
        """Return the error as data: kind, message and field."""
        return {**super().to_dict(), "field": self.field}
