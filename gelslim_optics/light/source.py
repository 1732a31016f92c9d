"""Light sources with their emission laws.

Rows of LEDs under a foot or before an end face, and launches from an edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TABLE_STEPS = 8192


@dataclass(frozen=True)
class Lambertian:
    """Intensity ∝ cos θ: a bare LED behind a flat window."""

    def cosine(self, u: Array) -> Array:
        """cos θ of the cone about the axis that contains the share u of the flux."""
        return np.sqrt(1 - u)


@dataclass(frozen=True)
class Dome:
    """Intensity ∝ cosᵐ θ within `half_angle_deg` and none outside: an LED with a lens."""

    half_angle_deg: float = 60.0
    exponent: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < self.half_angle_deg <= 90:
            raise ValueError(f"half_angle_deg = {self.half_angle_deg!r}: must be in (0, 90]")
        if not (math.isfinite(self.exponent) and self.exponent >= 0):
            raise ValueError(f"exponent = {self.exponent!r}: must be >= 0")

    def cosine(self, u: Array) -> Array:
        """cos θ of the cone about the axis that contains the share u of the flux."""
        power = self.exponent + 1
        last = math.cos(math.radians(self.half_angle_deg)) ** power
        return (1 - u * (1 - last)) ** (1 / power)


@dataclass(frozen=True)
class MeasuredLaw:
    """Relative intensity per solid angle at increasing angles, linear between them."""

    angle_deg: tuple[float, ...]
    intensity: tuple[float, ...]

    def __post_init__(self) -> None:
        angles, values = np.asarray(self.angle_deg), np.asarray(self.intensity)
        if angles.size < 2 or angles.size != values.size:
            raise ValueError("a measured law needs two or more angles and as many intensities")
        if not (angles[0] == 0 and angles[-1] <= 90 and np.all(np.diff(angles) > 0)):
            raise ValueError("angle_deg must start at 0, rise, and end at 90 or below")
        if not (np.all(np.isfinite(values)) and np.all(values >= 0) and np.any(values > 0)):
            raise ValueError("intensity must be finite, >= 0 and not all zero")

    def cosine(self, u: Array) -> Array:
        """cos θ of the cone about the axis that contains the share u of the flux."""
        cosines, shares = _cumulative(self)
        return np.interp(u, shares, cosines)


@lru_cache(maxsize=32)
def _cumulative(law: MeasuredLaw) -> tuple[Array, Array]:
    """cos θ on a fine grid from the axis outwards, and the share of flux within each cone."""
    theta = np.linspace(0.0, math.radians(law.angle_deg[-1]), TABLE_STEPS)
    density = np.interp(theta, np.radians(law.angle_deg), law.intensity)
    cosines = np.cos(theta)
    steps = (density[1:] + density[:-1]) / 2 * -np.diff(cosines)
    shares = np.concatenate(([0.0], np.cumsum(steps)))
    return cosines, shares / shares[-1]


End = Literal["first", "last"]
AngularLaw = Lambertian | Dome | MeasuredLaw


@dataclass(frozen=True)
class LedRow:
    """A row of square LEDs that face a foot from outside, parallel to it.

    Light crosses the air to the foot and is refracted into it; light beside the foot is counted as
    missed.

    Attributes:
        edge: Name of the edge of the foot.
        x_mm: Centres of the LEDs along x.
        size_mm: Side of an LED.
        gap_mm: Air between LED and foot.
        law: Emission law.
        colour: Name of the colour.
        wavelength_um: Wavelength; None uses the index of the colour.
        power: Flux relative to the other sources.
        offset_mm: Shift along the foot, from its start to its end.

    Raises:
        ValueError: There is no LED, or a value is out of range.
    """

    edge: str
    x_mm: tuple[float, ...]
    size_mm: float = 2.0
    gap_mm: float = 0.1
    law: AngularLaw = field(default_factory=Lambertian)
    colour: str = "white"
    wavelength_um: float | None = None
    power: float = 1.0
    offset_mm: float = 0.0

    def __post_init__(self) -> None:
        _check_row(self.edge, self.x_mm, self.size_mm, self.gap_mm)
        _check_source(self.power, self.wavelength_um)


@dataclass(frozen=True)
class EndRow:
    """A row of square LEDs that face an end of the extruded guide from outside, parallel to it.

    Light crosses the air to the plane of the end face and is refracted into the guide; light
    beside the cross-section of `into`, or onto the end of another medium, is counted as missed.

    Attributes:
        end: Whether the LEDs face the first or the last x of the guide.
        y_mm: Centres of the LEDs across the finger.
        z_mm: Height of the centres.
        into: The medium that the light enters.
        size_mm: Side of an LED.
        gap_mm: Air between LED and end face.
        law: Emission law.
        colour: Name of the colour.
        wavelength_um: Wavelength; None uses the index of the colour.
        power: Flux relative to the other sources.

    Raises:
        ValueError: There is no LED, or a value is out of range.
    """

    end: End
    y_mm: tuple[float, ...]
    z_mm: float
    into: str = "acrylic"
    size_mm: float = 2.0
    gap_mm: float = 0.1
    law: AngularLaw = field(default_factory=Lambertian)
    colour: str = "white"
    wavelength_um: float | None = None
    power: float = 1.0

    def __post_init__(self) -> None:
        if self.end not in get_args(End):
            raise ValueError(f"end = {self.end!r}: must be one of {', '.join(get_args(End))}")
        _check_row(f"the {self.end} end", self.y_mm, self.size_mm, self.gap_mm)
        if not all(math.isfinite(value) for value in (*self.y_mm, self.z_mm)):
            raise ValueError("y_mm and z_mm of an end row must be finite")
        _check_source(self.power, self.wavelength_um)


@dataclass(frozen=True)
class EdgeLaunch:
    """Light that starts on a whole edge inside the medium `into`, for comparison with theory.

    `na` is the numerical aperture n sin θ of the cone about the normal of the edge, filled
    uniformly in projected solid angle; None fills the half space (Lambertian), 0 is collimated.
    `planar` keeps the rays in the plane of the profile, uniform in n sin θ.
    """

    edge: str
    into: str = "acrylic"
    na: float | None = None
    planar: bool = False
    colour: str = "white"
    wavelength_um: float | None = None
    power: float = 1.0

    def __post_init__(self) -> None:
        if self.na is not None and not (math.isfinite(self.na) and self.na >= 0):
            raise ValueError(f"na = {self.na!r}: must be >= 0")
        _check_source(self.power, self.wavelength_um)


Source = LedRow | EndRow | EdgeLaunch


def _check_row(where: str, centres: tuple[float, ...], size_mm: float, gap_mm: float) -> None:
    if not centres:
        raise ValueError(f"the LED row at {where} has no LED")
    if not (math.isfinite(size_mm) and size_mm > 0):
        raise ValueError(f"LED size_mm = {size_mm!r}: must be > 0")
    if not (math.isfinite(gap_mm) and gap_mm >= 0):
        raise ValueError(f"LED gap_mm = {gap_mm!r}: must be >= 0")


def _check_source(power: float, wavelength_um: float | None) -> None:
    if not (math.isfinite(power) and power > 0):
        raise ValueError(f"source power = {power!r}: must be > 0")
    if wavelength_um is not None and not 0.3 <= wavelength_um <= 2:
        raise ValueError(f"wavelength_um = {wavelength_um!r}: must be between 0.3 and 2")
