"""What is assumed of deep contacts, and the shadows in their light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from guided_light import guided_bundle, irradiance
from pressed_samples import light_map
from sensor_samples import sensor_bundle

from gelslim_force.forces.finite_strain import law_of
from gelslim_force.joint.deepness import (
    FULLY,
    deepness,
    least_pressure_at,
    light_share_at,
    traction_sigma,
)
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.node_relief import NodeRelief
from gelslim_force.joint.settings import USUAL_CELL, JointSettings
from gelslim_optics.light.light_law import SCATTERED, LightLaw
from gelslim_optics.light.light_map import LightMap, light_arrays


def test_deepness_grows_from_the_depth_on() -> None:
    motion = np.zeros((3, 3))
    for depth, expected in ((0.0, 0.0), (0.2, 0.0), (0.24, 0.5), (0.2 * FULLY, 1.0), (0.9, 1.0)):
        motion[1, 2] = -depth
        assert deepness(motion[:, 2], 0.2) == pytest.approx(expected)


def test_settings_of_shallow_contacts_are_those_given() -> None:
    chosen = JointSettings()
    assert light_share_at(chosen, 0.0) == chosen.light_share
    assert least_pressure_at(chosen, 0.0) == chosen.least_pressure
    mean = (chosen.light_share + chosen.deep_light_share) / 2
    assert light_share_at(chosen, 0.5) == pytest.approx(mean)
    assert least_pressure_at(chosen, 1.0) == pytest.approx(chosen.deep_least_pressure)
    traction = np.array([[0.0, 0.0, -0.3], [0.0, 0.0, -0.1], [0.0, 0.0, 0.2]])
    usual = traction_sigma(chosen, 0.0, 0.1, traction)
    assert usual.rough_mpa == pytest.approx(0.1 * chosen.roughness)
    assert usual.tangential_mpa == pytest.approx(0.1 * chosen.tangential_stress)
    assert usual.ratio == chosen.shear_ratio
    mean = (0.3**2 + 0.1**2) / 0.4
    deep = traction_sigma(chosen, 1.0, 0.1, traction)
    assert deep.rough_mpa == pytest.approx(chosen.deep_roughness * mean)
    assert deep.ratio == 0
    traction[:, :2] = [[0.12, 0.0], [0.0, 0.16], [0.0, 0.0]]
    for deepness_of, share in ((0.0, chosen.shear_share), (1.0, chosen.deep_shear_share)):
        sheared = traction_sigma(chosen, deepness_of, 0.1, traction)
        assert sheared.tangential_mpa == pytest.approx(share * mean * 0.2 / 0.4)


def test_limits_and_reaches_are_those_of_an_area_and_of_lengths() -> None:
    """Twice as fine: a quarter of the area for each node, and twice as many steps."""
    usual = JointSettings()
    assert usual.on_mesh(USUAL_CELL) == usual
    finer = usual.on_mesh(USUAL_CELL / 2)
    for name in ("normal_stress", "tangential_stress", "shear_share", "deep_shear_share"):
        assert getattr(finer, name) == pytest.approx(2 * getattr(usual, name))
    assert (finer.light_reach, finer.marker_reach) == (4, 12)
    assert finer.roughness == usual.roughness


def test_light_with_relief_is_the_derivative_of_its_value() -> None:
    law, share, level = LightLaw(np.array([[0.0, 2.0]])), np.ones((1, 1, 1)), np.ones((1, 1))
    slope, relief = np.array([[0.1, 0.2]]), np.array([[0.4]])

    def change(at: np.ndarray) -> float:
        return float(law.change(at, share, level, 1.0, relief)[0].item())

    _, by_slope, _ = law.change(slope, share, level, 1.0, relief)
    for axis, step in enumerate(1e-6 * np.eye(2)):
        difference = (change(slope + step) - change(slope - step)) / 2e-6
        assert by_slope[0, 0, axis] == pytest.approx(difference, rel=1e-6)
    dark = law.change(slope, share, level, law.gamma, np.zeros((1, 1)))[0]
    assert np.exp(dark.item()) == pytest.approx(SCATTERED)


def test_a_dent_casts_the_shadow_that_the_pictures_have() -> None:
    """A long dent across the light: what it takes, against the march along each direction."""
    bundle = guided_bundle(0.45)
    points = np.asarray(bundle.mesh.surface_mm)
    lattice = NodeLattice.of(points, np.asarray(bundle.mesh.cell_size_mm[:2]))
    light = LightMap.from_arrays(bundle.light)
    relief = NodeRelief.of(light, lattice)
    assert relief is not None
    y = points[:, 1]
    height = -0.5 * np.exp(-((y / 1.2) ** 2))
    assert relief.at_nodes(0.0 * height) is None
    found = relief.at_nodes(height)
    assert found is not None
    cell, axis = 0.1, np.arange(-10, 10.05, 0.1)
    fine = np.tile(-0.5 * np.exp(-((axis / 1.2) ** 2)), (3, 1))
    level = (np.zeros_like(fine), np.zeros_like(fine))
    drawn = np.interp(y, axis, irradiance(fine, level, cell)[1, :, 0])
    whole = SCATTERED + (1 - SCATTERED) * found[:, 0]
    beside = (np.abs(points[:, 0]) < 6) & (np.abs(y) > 2.2) & (np.abs(y) < 6)
    shaded = beside & (drawn < 0.9)
    assert shaded.sum() > 15
    assert np.abs(whole[shaded] - drawn[shaded]).max() < 0.15
    assert np.abs((whole - drawn)[shaded].mean()) < 0.05


def test_a_light_of_one_direction_has_no_relief() -> None:
    bundle = sensor_bundle()
    lattice = NodeLattice.of(np.asarray(bundle.mesh.surface_mm), bundle.mesh.cell_size_mm[:2])
    assert NodeRelief.of(light_map(), lattice) is None


def test_a_bundle_keeps_the_directions_of_its_light() -> None:
    fans = np.zeros((2, 1, 1, 2, 3))
    fans[..., 0] = 0.5
    again = LightMap.from_arrays(light_arrays(replace(light_map(), fans=fans)))
    assert again.fans is not None
    np.testing.assert_array_equal(again.fans, fans)
    assert LightMap.from_arrays(light_arrays(light_map())).fans is None


def test_auto_is_linear_where_there_is_no_neo_hookean_law() -> None:
    bundle = sensor_bundle()
    shift = np.zeros(len(bundle.mesh.surface))
    crowned = replace(bundle, mesh=replace(bundle.mesh, surface_shift=shift))
    assert [law_of(bundle, gel) for gel in ("auto", "linear")] == ["auto", "linear"]
    assert [law_of(crowned, gel) for gel in ("auto", "neo_hookean")] == ["linear", "neo_hookean"]
