"""Exposure that the traced light allows, and whether light or readout sets the frame rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from gelslim_cad.geometry.led_strips import strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.light.scene import strip_leds
from gelslim_optics.light.result import LightResult

PLANCK_J_S = 6.62607015e-34
LIGHT_M_S = 2.99792458e8
WELL_SHARE = 0.5
"""Part of the full well that the mean of the image fills, so that bright spots do not saturate."""


@dataclass(frozen=True)
class Exposure:
    """Exposure of one colour with a guide, and the frame rate it allows."""

    colour: str
    irradiance_uw_mm2: float
    exposure_ms: float
    frame_rate_hz: float
    limit: Literal["readout", "exposure"]

    def sentence(self) -> str:
        """One sentence for people."""
        what = "the camera's readout" if self.limit == "readout" else "the light"
        return (
            f"{self.colour.capitalize()}: an exposure of {self.exposure_ms:.2f} ms fills half of a "
            f"pixel's well; {what} limits the rate to {self.frame_rate_hz:.0f} frames per second"
        )


def exposure(d: Lookup, light: LightResult, colour: str) -> Exposure:
    """Exposure that fills half of the sensor's full well at the mean irradiance of the coat.

    The coat scatters the part ρ evenly; its radiance falls by n_gel² on the way into air and by
    two reflections at the window: L = T ρ E / (π n²). The lens puts π τ L / (4 N²) on the sensor
    (distant object; no vignetting). Light of other colours than the sensor's filter is not
    counted.
    """
    return exposure_at(d, float(light.irradiance(colour).mean()), colour)


def exposure_at(d: Lookup, irradiance_per_w: float, colour: str) -> Exposure:
    """As `exposure`, for a mean irradiance of the coat in W/mm² per W of the colour's LEDs."""
    watts = d["design.leds.radiant_flux_mw"] / 1000 * strip_leds(d)[colour]
    arriving = watts * irradiance_per_w
    radiance = _to_air(d) * d["material.gel.coat_reflectance"] * arriving / math.pi
    on_sensor = math.pi * d["camera.lens_transmission"] * radiance / (4 * d["camera.f_number"] ** 2)
    photon_j = PLANCK_J_S * LIGHT_M_S / (strip_wavelengths_nm(d)[colour] * 1e-9)
    electrons = on_sensor * 1e-6 / photon_j * d["camera.quantum_efficiency"]
    needed = WELL_SHARE * d["camera.full_well_e_um2"]
    seconds = needed / electrons if electrons > 0 else math.inf
    readout = d["camera.frame_rate_hz"]
    rate = min(readout, 1 / seconds)
    return Exposure(
        colour,
        arriving * 1e6,
        seconds * 1000,
        rate,
        "readout" if seconds <= 1 / readout else "exposure",
    )


def _to_air(d: Lookup) -> float:
    """Share of the coat's radiance that leaves into air near the normal: transmission over n²."""
    gel, acrylic = d["material.gel.refractive_index"], d["material.acrylic.refractive_index"]
    first = 1 - ((gel - acrylic) / (gel + acrylic)) ** 2
    second = 1 - ((acrylic - 1) / (acrylic + 1)) ** 2
    return float(first * second / gel**2)
