"""How one built sensor looks, as its pictures show it. Stored as JSON, format `gelslim-look/1`.

Light is counted in linear grey values: 255 (grey / 255)^gamma, which is proportional to the light.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_core.files.json_record import RecordFile
from gelslim_core.files.replaced_file import json_bytes
from gelslim_force.calibration.stored_picture import picture_of, picture_record

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
FORMAT = "gelslim-look/1"
LIGHT_TERMS, GAIN_TERMS = 10, 6
"""Terms of the polynomials of the light (third degree) and of the shading's gain (second)."""
_MAKE = "make it with `gelslim calibrate-look BUNDLE REST -o FILE`"
_NUMBERS = ("gamma", "level_dn", "blur_px", "read_dn", "electrons_per_dn", "grain_px")
_ARRAYS = ("light_terms", "shading_gain", "contrast", "dots_mm", "turn_rad", "opacity")


class LookError(GelslimError, ValueError):
    """A look that cannot be fitted, read or used."""


@dataclass(frozen=True, eq=False)
class BuiltLook:
    """The look of one built sensor.

    Attributes:
        geometry_hash: Of the bundle that the look belongs to.
        camera: Record of the camera as built, with aperture and focus.
        gamma: Inverse of the exponent of the camera's response, which is assumed and not fitted.
        level_dn: Mean light of the bare gel over the pad and the channels, in linear grey values.
        light_terms: (c, 10) logarithm of the light of each channel over that of the design, a
            polynomial of third degree over the gel.
        shading_gain: (c, 6) factor on the change of light with the slope, a polynomial of second
            degree over the gel as in a calibration of the light; 1 for the traced light.
        contrast: (c,) share of the light that the ink of the darkest dots absorbs.
        blur_px: Standard deviation of the point spread in focus.
        read_dn: Standard deviation of the noise without light, in linear grey values.
        electrons_per_dn: Electrons for a linear grey value, which give the shot noise.
        grain_px: Standard deviation of the Gaussian filter with the noise's correlation; 0 where
            the noise of neighbouring pixels is independent.
        bare: (h, w) or (h, w, 3) uint8 picture at rest with the dots and the noise removed.
        markers: (m,) ids of the dots that were found.
        dots_mm: (m, 4) centre x, y and semi-axes of each dot on the gel at rest.
        turn_rad: (m,) angle of the first semi-axis from x to y.
        opacity: (m,) ink of each dot over that of the darkest.
        missing: (n,) ids of the dots in the picture that were not found; they are not drawn.
        judged: What the drawn picture has in common with the real one, as plain data.
        diagnosis: What was found, in sentences.
        warnings: What should be looked at before the look is trusted.

    Raises:
        ValueError: Arrays contradict one another, or a value is impossible.
    """

    geometry_hash: str
    camera: Mapping[str, Any]
    gamma: float
    level_dn: float
    light_terms: Array
    shading_gain: Array
    contrast: Array
    blur_px: float
    read_dn: float
    electrons_per_dn: float
    grain_px: float
    bare: NDArray[np.uint8]
    markers: NDArray[np.int64]
    dots_mm: Array
    turn_rad: Array
    opacity: Array
    missing: NDArray[np.int64]
    judged: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    diagnosis: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        channels, count = (3 if self.bare.ndim == 3 else 1), len(self.markers)
        shapes = {
            "light_terms": (channels, LIGHT_TERMS),
            "shading_gain": (channels, GAIN_TERMS),
            "contrast": (channels,),
            "dots_mm": (count, 4),
            "turn_rad": (count,),
            "opacity": (count,),
        }
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{name} {array.shape} must be {shape} and finite")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        for name in _NUMBERS:
            value = float(getattr(self, name))
            least = 0.0 if name in ("blur_px", "read_dn", "grain_px") else np.nextafter(0, 1)
            if not (np.isfinite(value) and value >= least):
                raise ValueError(f"{name} = {value!r}: must be finite and not negative")
        if count and (self.contrast.min() < 0 or self.contrast.max() > 1):
            raise ValueError("contrast must be 0 ... 1")
        if count and (self.dots_mm[:, 2:].min() <= 0 or self.opacity.min() < 0):
            raise ValueError("semi-axes of dots must be above 0, and their opacity not below")

    @cached_property
    def digest(self) -> str:
        """Hash of all that changes a drawn picture."""
        return hashlib.sha256(json_bytes(look_record(self))).hexdigest()

    def effect_values(self) -> dict[str, dict[str, float]]:
        """Parameters of the scene's effects that this look knows, by effect and name."""
        per_white = 255 * self.electrons_per_dn
        return {
            "drawing": {
                "level_dn": self.level_dn,
                "contrast": max(float(self.contrast.max()), 1e-3),
            },
            "defocus": {"still_px": self.blur_px},
            "exposure": {"gamma": self.gamma},
            "sensor_noise": {
                "full_well_electrons": per_white,
                "read_noise_electrons": self.read_dn * self.electrons_per_dn,
                "grain_px": self.grain_px,
            },
        }

    def require_bundle(self, bundle: Bundle) -> None:
        """Raise LookError for another sensor."""
        if bundle.geometry_hash != self.geometry_hash:
            raise LookError(
                f"the look belongs to a sensor of geometry {self.geometry_hash[:12]}, the bundle "
                f"to {bundle.geometry_hash[:12]}: {_MAKE}"
            )


def look_record(look: BuiltLook) -> dict[str, Any]:
    """The look as numbers, strings, lists and dicts."""
    return {
        "format": FORMAT,
        "geometry_hash": look.geometry_hash,
        "camera": dict(look.camera),
        **{name: float(getattr(look, name)) for name in _NUMBERS},
        **{name: getattr(look, name).tolist() for name in _ARRAYS},
        "markers": look.markers.tolist(),
        "missing": look.missing.tolist(),
        "bare": picture_record(look.bare),
        "judged": dict(look.judged),
        "diagnosis": list(look.diagnosis),
        "warnings": list(look.warnings),
    }


def write_look(look: BuiltLook, path: str | os.PathLike[str]) -> None:
    """Write a look; an earlier file is kept if writing fails.

    Args:
        look: What to write.
        path: File to write; its folder must exist.

    Raises:
        OSError: The file cannot be written.
    """
    _FILE.write(look, path)


def read_look(path: str | os.PathLike[str]) -> BuiltLook:
    """Read a look.

    Args:
        path: File of `gelslim calibrate-look`, or of `write_look`.

    Returns:
        The look.

    Raises:
        LookError: There is no such file, or it is damaged or of another kind.
    """
    return _FILE.read(path)


def _look_of(record: Mapping[str, Any]) -> BuiltLook:
    count = len(record["markers"])
    values: dict[str, Any] = {name: float(record[name]) for name in _NUMBERS}
    values |= {name: np.array(record[name], dtype=float) for name in _ARRAYS}
    if count == 0:
        values["dots_mm"] = np.zeros((0, 4))
    return BuiltLook(
        geometry_hash=str(record["geometry_hash"]),
        camera=dict(record["camera"]),
        bare=picture_of(record["bare"]),
        markers=np.array(record["markers"], dtype=np.int64),
        missing=np.array(record["missing"], dtype=np.int64),
        judged=dict(record["judged"]),
        diagnosis=tuple(str(line) for line in record["diagnosis"]),
        warnings=tuple(str(line) for line in record["warnings"]),
        **values,
    )


_FILE = RecordFile(FORMAT, "look of a sensor", _MAKE, look_record, _look_of, LookError)
