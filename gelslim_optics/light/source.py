"""Emitters: rows of LEDs under a foot, and launches from an edge straight into a medium."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from gelslim_optics.light.law import AngularLaw, Lambertian


@dataclass(frozen=True)
class LedRow:
    """Square LEDs facing a foot from outside, their faces parallel to it at `gap_mm`.

    `x_mm` are the LEDs' centres; `offset_mm` shifts them along the foot's start-to-end direction
    (placement). Light crosses the air to the foot and refracts in; what passes the foot is
    booked as missed. `power` is the row's share of the flux relative to other sources.
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
        if not self.x_mm:
            raise ValueError(f"the LED row at {self.edge} has no LED")
        if not (math.isfinite(self.size_mm) and self.size_mm > 0):
            raise ValueError(f"LED size_mm = {self.size_mm!r}: must be > 0")
        if not (math.isfinite(self.gap_mm) and self.gap_mm >= 0):
            raise ValueError(f"LED gap_mm = {self.gap_mm!r}: must be >= 0")
        _check_source(self.power, self.wavelength_um)


@dataclass(frozen=True)
class EdgeLaunch:
    """Light that starts on a whole edge, inside the medium `into`, for checks.

    `na`: numerical aperture n sin θ of the cone about the edge's normal, filled evenly in
    projected solid angle; None fills the half space (Lambertian), 0 is collimated. `planar`
    keeps the rays in the profile's plane, evenly in n sin θ.
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


Source = LedRow | EdgeLaunch


def _check_source(power: float, wavelength_um: float | None) -> None:
    if not (math.isfinite(power) and power > 0):
        raise ValueError(f"source power = {power!r}: must be > 0")
    if wavelength_um is not None and not 0.3 <= wavelength_um <= 2:
        raise ValueError(f"wavelength_um = {wavelength_um!r}: must be between 0.3 and 2")
