"""Figures that follow from sensor and contact: refraction, blur, forces, scales."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from effect_samples import FIGURES, circumstances

from gelslim_twin.effects.circumstances import EffectParameters
from gelslim_twin.effects.grey_values import CompressionParameters


@pytest.mark.parametrize("angle_deg", [1e-4, 12.0, 43.0])
def test_the_lift_is_that_of_snells_law(angle_deg: float) -> None:
    """A ray is traced through the layers; straight on, it would have come from a nearer plane."""
    angle = math.radians(angle_deg)
    sideways = sum(h * math.tan(math.asin(math.sin(angle) / n)) for h, n in FIGURES.layers_mm)
    whole = sum(h for h, _ in FIGURES.layers_mm)
    expected_mm = whole - sideways / math.tan(angle)
    assert FIGURES.lift_mm(angle_deg) == pytest.approx(expected_mm, rel=1e-9)


def test_a_lift_is_seen_by_the_cameras_tilt_and_the_rays_slope() -> None:
    """The scale is that of the nearest apparent point of oblique rays."""
    slope, tilt = 364.0 / 634.9, math.radians(17.7)
    apparent_mm = sum(h * (1 - 1 / n) for h, n in FIGURES.layers_mm)
    nearest_mm = 32.0 - (FIGURES.lift_mm(43.0) - apparent_mm)
    assert FIGURES.lifted_px(0.3) == pytest.approx(
        634.9 / nearest_mm * 0.3 * (math.sin(tilt) + slope)
    )


def test_scales_of_picture_and_mesh() -> None:
    assert FIGURES.px_per_mm == pytest.approx(634.9 / 32.0)
    assert FIGURES.frame_px == 480_000
    assert FIGURES.node_pitch_mm**2 * 1300 == pytest.approx(27.0 * 19.0)
    c = circumstances()
    assert c.contact_nodes == pytest.approx(c.contact.area_mm2 * 1300 / (27.0 * 19.0))


@pytest.mark.parametrize("focus_mm", [20.0, 34.0, 39.5, 60.0])
def test_blur_is_the_cone_of_the_aperture_in_the_plane_of_focus(focus_mm: float) -> None:
    """From a point at Z the pupil A is seen in the plane of focus s as wide as A |Z - s| / Z."""
    c = circumstances(sensor=replace(FIGURES, focus_mm=focus_mm))
    discs_mm = [1.24 * abs(focus_mm - z) / z for z in (32.0, 40.5)]
    assert c.blur_px == pytest.approx(max(discs_mm) * 634.9 / focus_mm)


def test_a_pinhole_does_not_blur() -> None:
    for change in ({"aperture_mm": 0.0}, {"focus_mm": 0.0}, {"aperture_mm": 0.0, "focus_mm": 0.0}):
        assert circumstances(sensor=replace(FIGURES, **change)).blur_px == 0


@pytest.mark.parametrize("friction", [0.0, 0.4, 1.0, 2.5])
def test_force_grows_with_friction_to_that_of_full_stick(friction: float) -> None:
    c = circumstances(friction)
    slips, sticks = c.contact.normal_n, c.contact.stick_n
    assert sticks > 1.01 * slips
    normal = 1.25 * (slips + min(friction, 1.0) * (sticks - slips))
    assert c.force_n == pytest.approx(math.sqrt(normal**2 + (friction * normal) ** 2))


def test_parameters_are_those_of_the_effect() -> None:
    given = CompressionParameters(quality=40)
    c = circumstances(compression=given)
    assert c.given("compression", CompressionParameters) is given
    assert c.given("compression", EffectParameters) is given
    with pytest.raises(TypeError, match="DirtParameters"):
        c.given("dirt", CompressionParameters)
