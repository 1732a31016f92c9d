"""The light of one built sensor: its gain over the traced light, for each colour and place.

The logarithm of the light that a tilted surface sends changes by the gain times what the traced law
says. The gain of a channel is a polynomial of second degree over the gel. Stored as JSON, format
`gelslim-light-calibration/2`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.json_record import RecordFile
from gelslim_force.calibration.error import CalibrationError

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
FORMAT = "gelslim-light-calibration/2"
TERMS = 6
"""Of the polynomial: 1, x, y, x² - 1/3, x y, y² - 1/3, with x and y from -1 to 1 over the gel."""
GAINS = 0.2, 5.0
"""Range within which a gain stays, also far from all presses."""
_MAKE = "make it with `gelslim calibrate-light BUNDLE REFERENCE PRESSES --ball-mm D -o FILE`"


@dataclass(frozen=True, eq=False)
class LightCalibration:
    """Gains of the light as built.

    Attributes:
        geometry_hash: Of the bundle as designed.
        channels: (c,) channels of the camera, as `source_channels` gives them.
        middle_mm: (2,) middle of the gel.
        half_mm: (2,) half its length and width.
        gain: (c, 6) terms of each channel's gain, see `TERMS`.
        covariance: (c, 6, 6) of these.
        gamma: Exponent of the camera's response that the gains belong to.
        gain_sigma: Relative standard deviation of the gain at a place that was not pressed.
        light_error: Standard deviation of the mean change of light over 1 mm² that the gains do
            not explain.
        ball_mm: Diameter of the ball that was pressed.
        presses: What was found of each press, as plain data.
        diagnosis: What was found, in sentences.
        warnings: What should be looked at before the calibration is trusted.
        gel: Law of the gel that the slopes under the ball are of, as `GelLaw.record_of` gives it.

    Raises:
        ValueError: Arrays contradict one another, or a value is impossible.
    """

    geometry_hash: str
    channels: tuple[int, ...]
    middle_mm: Array
    half_mm: Array
    gain: Array
    covariance: Array
    gamma: float
    gain_sigma: float
    light_error: float
    ball_mm: float
    presses: tuple[Mapping[str, Any], ...] = ()
    diagnosis: tuple[str, ...] = field(default=())
    warnings: tuple[str, ...] = field(default=())
    gel: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.channels)
        shapes = {"middle_mm": (2,), "half_mm": (2,), "gain": (count, TERMS),
                  "covariance": (count, TERMS, TERMS)}  # fmt: skip
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{name} {array.shape} must be {shape} and finite")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if count == 0:
            raise ValueError("there is no channel")
        if not (self.half_mm > 0).all():
            raise ValueError("half_mm must be above 0")
        for name in ("gamma", "gain_sigma", "light_error", "ball_mm"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be above 0")

    def terms(self, places_mm: Array) -> Array:
        """Terms (n, 6) of the polynomial at places (n, 2); outside the gel those of its edge."""
        return place_terms((places_mm - self.middle_mm) / self.half_mm)

    def gain_at(self, places_mm: Array) -> Array:
        """Gain (c, n) at places (n, 2)."""
        return np.clip(self.gain @ self.terms(places_mm).T, *GAINS)

    def require_bundle(self, bundle: Bundle) -> None:
        """Raise CalibrationError for another sensor."""
        if bundle.geometry_hash != self.geometry_hash:
            raise CalibrationError(
                "bundle",
                f"the light calibration belongs to a sensor of geometry {self.geometry_hash[:12]}, "
                f"the bundle to {bundle.geometry_hash[:12]}: {_MAKE}",
            )


def place_terms(place: Array) -> Array:
    """Terms (n, 6) at places (n, 2) from -1 to 1 over the gel."""
    x, y = np.clip(place, -1, 1).T
    return np.column_stack([np.ones_like(x), x, y, x * x - 1 / 3, x * y, y * y - 1 / 3])


def light_calibration_record(found: LightCalibration) -> dict[str, Any]:
    """Return the calibration as numbers, strings, lists and dicts."""
    return {
        "format": FORMAT,
        "geometry_hash": found.geometry_hash,
        "channels": list(found.channels),
        "middle_mm": found.middle_mm.tolist(),
        "half_mm": found.half_mm.tolist(),
        "gain": found.gain.tolist(),
        "covariance": found.covariance.tolist(),
        "gamma": found.gamma,
        "gain_sigma": found.gain_sigma,
        "light_error": found.light_error,
        "ball_mm": found.ball_mm,
        "gel": dict(found.gel),
        "presses": [dict(press) for press in found.presses],
        "diagnosis": list(found.diagnosis),
        "warnings": list(found.warnings),
    }


def write_light_calibration(found: LightCalibration, path: str | os.PathLike[str]) -> None:
    """Write a light calibration; an earlier file is kept if writing fails.

    Args:
        found: What to write.
        path: File to write; its folder must exist.

    Raises:
        OSError: The file cannot be written.
    """
    _FILE.write(found, path)


def read_light_calibration(path: str | os.PathLike[str]) -> LightCalibration:
    """Read a light calibration.

    Args:
        path: File of `gelslim calibrate-light`, or of `write_light_calibration`.

    Returns:
        The calibration.

    Raises:
        CalibrationError: There is no such file, or it is damaged or of another kind.
    """
    return _FILE.read(path)


def _calibration_of(record: Mapping[str, Any]) -> LightCalibration:
    return LightCalibration(
        str(record["geometry_hash"]),
        tuple(int(channel) for channel in record["channels"]),
        np.array(record["middle_mm"], dtype=float),
        np.array(record["half_mm"], dtype=float),
        np.array(record["gain"], dtype=float),
        np.array(record["covariance"], dtype=float),
        float(record["gamma"]),
        float(record["gain_sigma"]),
        float(record["light_error"]),
        float(record["ball_mm"]),
        tuple(dict(press) for press in record["presses"]),
        tuple(str(line) for line in record["diagnosis"]),
        tuple(str(line) for line in record["warnings"]),
        dict(record.get("gel", {})),
    )  # fmt: skip


_FILE = RecordFile(
    FORMAT,
    "light calibration",
    _MAKE,
    light_calibration_record,
    _calibration_of,
    partial(CalibrationError, "file"),
)
