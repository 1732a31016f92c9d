"""The normal motion that an indenter source gives for a patch, on cells that are not square."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_samples import node_forces_n

from gelslim_force.contact.indenter import Sphere
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.shading_change import ShadingChange
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.surface_operator import surface_operator

BALL = Sphere(10.0)
CENTRE_MM = np.array([1.1, -0.7])
LATERAL_MM = np.array([0.4, -0.25])
PATCH = ContactPatch("disc", CENTRE_MM, 1.6, covariance=np.diag([1e-4, 1e-4, 4e-4, 0.0]))
MESH = PadMesh.from_occupancy(
    np.ones((22, 16, 3), dtype=bool), (0.45, 0.6, 0.6), (-4.95, -4.8, -1.8)
)
OPERATOR = surface_operator(MESH, Material(0.147, 0.45, 1000.0), "bbar", "factor")


class Finder:
    """Finds always the same patch, in light with errors that bins share."""

    def __init__(self, noise: float = 0.01) -> None:
        self.noise = noise

    def change(self, image, markers_px=None):
        noise = np.full((2, *image.shape[:2]), self.noise)
        return ShadingChange(0 * noise, noise[0] > 0, noise, grain=np.full(2, 4.0))

    def patch_in(self, light):
        return PATCH


@pytest.fixture(scope="module")
def source() -> IndenterSource:
    return IndenterSource(Finder(), NormalModel(OPERATOR, MESH.surface_mm), BALL)


def test_the_gel_is_pressed_in_under_the_ball(source) -> None:
    seen = source.look(np.zeros((4, 4), np.uint8), np.zeros((0, 2)))
    found = source.motion(seen)
    away = np.hypot(*(source.model.points_mm - CENTRE_MM).T)
    deepest = np.argmin(found.w_mm)
    assert away[deepest] < 0.45
    assert found.w_mm[deepest] == pytest.approx(-found.depth_mm, rel=0.05)
    inside = away < 1.3
    exact = BALL.profile(away[inside], 0 * away[inside]) - found.depth_mm
    assert found.w_mm[inside] == pytest.approx(exact, abs=1e-9)
    assert found.w_mm[inside].max() < 0
    assert found.touched[inside].all()
    assert not found.touched[away > 2.3].any()
    assert found.patch is PATCH
    assert 0 < found.sigma_mm[deepest] < 0.2 * found.depth_mm


def test_the_free_surface_moves_as_the_contact_forces_move_it(source) -> None:
    found = source.model.motion(PATCH, BALL)
    force = np.zeros((len(found.w_mm), 3))
    force[:, 2] = -node_forces_n(source.model, found)
    exact = OPERATOR.displacement(force)[:, 2]
    np.testing.assert_allclose(found.w_mm, exact, atol=1e-5 * found.depth_mm)
    assert np.abs(exact[~found.touched]).max() > 0.02 * found.depth_mm


def test_the_patch_is_moved_back_by_the_lateral_motion(source) -> None:
    """The nodes that touch now were elsewhere at rest, by the motion of the gel."""
    found = source.motion(PATCH, LATERAL_MM)
    at_rest = source.motion(replace(PATCH, centre_mm=CENTRE_MM - LATERAL_MM))
    np.testing.assert_array_equal(found.w_mm, at_rest.w_mm)
    np.testing.assert_array_equal(found.touched, at_rest.touched)
    assert found.patch is PATCH
    centre = found.w_mm @ source.model.points_mm / found.w_mm.sum()
    still = source.motion(PATCH)
    before = still.w_mm @ source.model.points_mm / still.w_mm.sum()
    assert centre - before == pytest.approx(-LATERAL_MM, abs=0.1)


def test_light_that_may_hide_a_contact_shows_no_patch(source) -> None:
    """In a picture compressed beyond use a ball with 0.48 N read as 0.04 ± 0.009 N."""
    picture, markers = np.zeros((8, 8), np.uint8), np.zeros((0, 2))
    assert source.look(picture, markers) is PATCH
    found = source.motion(replace(source, finder=Finder(0.041)).look(picture, markers))
    assert not found.known
    assert "compressed" in found.problem


def test_without_a_patch_nothing_moves(source) -> None:
    found = source.motion(None)
    assert found.known
    assert not found.w_mm.any()
    assert not found.touched.any()
    assert found.summary() == {"touched": False}


def test_the_papers_model_moves_nothing_outside_the_cap(source) -> None:
    found = replace(source, cap_only=True).motion(PATCH)
    away = np.hypot(*(source.model.points_mm - CENTRE_MM).T)
    assert found.depth_mm == pytest.approx(float(BALL.profile(1.6, 0.0)))
    assert not found.w_mm[away > 1.6].any()
    assert (found.w_mm[away < 1.4] < 0).all()
