"""The values on which the light depends, as a mapping for worker processes and cache keys."""

from __future__ import annotations

from typing import Any

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name

NAMES: tuple[Name, ...] = (
    "camera.f_number",
    "camera.frame_rate_hz",
    "camera.full_well_e_um2",
    "camera.lens_transmission",
    "camera.quantum_efficiency",
    "design.gel.corner_radius_mm",
    "design.gel.crown_height_mm",
    "design.gel.length_mm",
    "design.gel.thickness_mm",
    "design.gel.width_mm",
    "design.housing.fit_clearance_mm",
    "design.leds.dome_half_angle_deg",
    "design.leds.emission",
    "design.leds.emission_angle_deg",
    "design.leds.emission_intensity",
    "design.leds.green_wavelength_nm",
    "design.leds.height_mm",
    "design.leds.package_mm",
    "design.leds.radiant_flux_mw",
    "design.leds.red_wavelength_nm",
    "design.light_guide.leg_length_mm",
    "design.light_guide.thickness_mm",
    "guide.bend_ratio",
    "guide.distal_end_x_mm",
    "guide.flat_width_mm",
    "guide.inner_radius_mm",
    "guide.proximal_end_x_mm",
    "led.count",
    "led.pitch_mm",
    "led.top_z_mm",
    "led.y_mm",
    "material.acrylic.absorption_per_m",
    "material.acrylic.refractive_index",
    "material.gel.coat_reflectance",
    "material.gel.refractive_index",
    "stack.gel_bottom_z_mm",
)
"""Names that scene, study, exposure and pictures use."""


def light_inputs(d: Lookup) -> dict[str, Any]:
    """Values of NAMES."""
    return {name: d[name] for name in NAMES}
