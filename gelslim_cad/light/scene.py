"""This finger's guide, LEDs, gel and coat as a scene for the tracer."""

from __future__ import annotations

import math
from typing import Any

from gelslim_cad.geometry.led_strips import has_tip_light, strip_sides, strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name
from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.light.scene import PMMA_SELLMEIER, LightScene, Medium, Surface
from gelslim_optics.light.source import AngularLaw, Dome, EndRow, Lambertian, LedRow, MeasuredLaw

MIRROR_REFLECTANCE = 0.9
"""Reflectance of unprotected aluminium on acrylic; silver reaches 0.95."""
PMMA_REFERENCE_UM = 0.590
OPEN_FACES = ("leg_top", "window_end")
"""Faces of the air-gap guide whose light goes on to its mirror."""
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
    "design.leds.blue_wavelength_nm",
    "design.leds.dome_half_angle_deg",
    "design.leds.emission",
    "design.leds.emission_angle_deg",
    "design.leds.emission_intensity",
    "design.leds.green_wavelength_nm",
    "design.leds.height_mm",
    "design.leds.light",
    "design.leds.tip",
    "design.leds.one_wavelength_nm",
    "design.leds.package_mm",
    "design.leds.radiant_flux_mw",
    "design.leds.red_wavelength_nm",
    "design.leds.white_wavelength_nm",
    "design.light_guide.leg_length_mm",
    "design.light_guide.thickness_mm",
    "guide.bend_ratio",
    "guide.distal_end_x_mm",
    "guide.flat_width_mm",
    "guide.inner_radius_mm",
    "guide.proximal_end_x_mm",
    "led.count",
    "led.pitch_mm",
    "led.tip_count",
    "led.tip_face_x_mm",
    "led.tip_pitch_mm",
    "led.tip_z_mm",
    "led.top_z_mm",
    "led.y_mm",
    "material.acrylic.absorption_per_m",
    "material.acrylic.refractive_index",
    "material.gel.coat_reflectance",
    "material.gel.refractive_index",
    "stack.gel_bottom_z_mm",
)
"""Names that scene, study, exposure and pictures use."""


def light_scene(d: Lookup, profile: GuideProfile, *, sides_only: bool = False) -> LightScene:
    """The profile extruded over the guide's length, with the finger's own LEDs and materials.

    Body, baffles and bezel are black: light that leaves the acrylic or the gel is gone, except
    between leg and window of a guide with an air-gap mirror.

    Args:
        d: Spec fields and dimensions.
        profile: The cross-section of the guide.
        sides_only: Leave out the strip at the tip, whose light takes no bend.

    Returns:
        The scene; its sources are the strips at -y, at +y and, where there is one, at the tip.
    """
    tip = () if sides_only or not has_tip_light(d) else (tip_row(d),)
    half = d["design.gel.length_mm"] / 2
    return LightScene(
        profile,
        (d["guide.proximal_end_x_mm"], d["guide.distal_end_x_mm"]),
        (-half, half),
        (*led_rows(d), *tip),
        media(d),
        {
            "paint": Surface(d["material.gel.coat_reflectance"], diffuse=True),
            "mirror": Surface(MIRROR_REFLECTANCE),
        },
        feet=dark_faces(profile),
    )


def led_rows(d: Lookup) -> tuple[LedRow, LedRow]:
    """LEDs of one colour under the left leg, of another or the same under the right one."""
    count, pitch = round(d["led.count"]), d["led.pitch_mm"]
    places = tuple((i + 0.5 - count / 2) * pitch for i in range(count))
    size, gap, law = (
        d["design.leds.package_mm"],
        d["design.housing.fit_clearance_mm"],
        angular_law(d),
    )
    left, right, *_ = strip_wavelengths_nm(d)
    return (
        LedRow("foot_left", places, size, gap, law, left),
        LedRow("foot_right", places, size, gap, law, right),
    )


def tip_row(d: Lookup) -> EndRow:
    """LEDs before the end face of the window at the tip; only for a finger with that strip."""
    count, pitch = round(d["led.tip_count"]), d["led.tip_pitch_mm"]
    return EndRow(
        "last",
        tuple((i + 0.5 - count / 2) * pitch for i in range(count)),
        d["led.tip_z_mm"],
        size_mm=d["design.leds.package_mm"],
        gap_mm=d["led.tip_face_x_mm"] - d["guide.distal_end_x_mm"],
        law=angular_law(d),
        colour=list(strip_wavelengths_nm(d))[-1],
        power=count / d["led.count"],
    )


def strip_leds(d: Lookup) -> dict[str, float]:
    """Number of LEDs of each strip, by the name of its light."""
    at_side, at_tip = d["led.count"], d["led.tip_count"]
    names = zip(strip_wavelengths_nm(d), strip_sides(d), strict=True)
    return {name: at_tip if side == "tip" else at_side for name, side in names}


def angular_law(d: Lookup) -> AngularLaw:
    """How an LED's light spreads."""
    emission = d["design.leds.emission"]
    if emission == "table":
        angles, values = d["design.leds.emission_angle_deg"], d["design.leds.emission_intensity"]
        return MeasuredLaw(tuple(angles), tuple(values))
    return Lambertian() if emission == "lambertian" else Dome(d["design.leds.dome_half_angle_deg"])


def launched_na(d: Lookup) -> float:
    """Numerical aperture of the LEDs' light: 1 for a bare die, the sine of the widest angle."""
    law = angular_law(d)
    if isinstance(law, Dome):
        return math.sin(math.radians(law.half_angle_deg))
    if isinstance(law, MeasuredLaw):
        lit = [v > 0 for v in law.intensity]
        spans = zip(law.angle_deg[1:], lit, lit[1:], strict=False)
        return math.sin(math.radians(max(a for a, here, ahead in spans if here or ahead)))
    return 1.0


def media(d: Lookup) -> dict[str, Medium]:
    """Air, acrylic (window and legs) and gel; acrylic with the dispersion of PMMA."""
    n, gel = d["material.acrylic.refractive_index"], d["material.gel.refractive_index"]
    indices = {
        name: max(n + _pmma(wavelength_nm / 1000) - _pmma(PMMA_REFERENCE_UM), 1)
        for name, wavelength_nm in strip_wavelengths_nm(d).items()
    }
    acrylic = Medium(
        indices.get("left", n),
        d["material.acrylic.absorption_per_m"] / 1000,
        indices.get("red"),
        indices.get("green"),
        indices.get("blue"),
    )
    return {"air": Medium(1.0), "acrylic": acrylic, "leg": acrylic, "gel": Medium(gel)}


def dark_faces(profile: GuideProfile) -> tuple[str, ...]:
    """Faces towards the black inside of the finger, where light that leaves ends."""
    return tuple(
        edge.name
        for edge in profile.edges
        if "air" in (edge.left, edge.right)
        and "mirror" not in (edge.left, edge.right)
        and not edge.name.startswith(OPEN_FACES)
    )


def _pmma(wavelength_um: float) -> float:
    b, c = PMMA_SELLMEIER
    return math.sqrt(1 + b * wavelength_um**2 / (wavelength_um**2 - c))


def light_inputs(d: Lookup) -> dict[str, Any]:
    """Values of NAMES."""
    return {name: d[name] for name in NAMES}
