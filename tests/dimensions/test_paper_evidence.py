"""The figures with which docs/physics.md corrects the paper, computed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fold_samples import shipped
from numpy.typing import NDArray

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.camera.projection_error import ErrorModel, error_map
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.surface_operator import Rung, surface_operator

ROOT = Path(__file__).parents[2]
GEL = Material(0.147, 0.3223, 1020.0)
THICKNESS_MM = 2.0


def bumped_pad(layers: int) -> tuple[PadMesh, NDArray[np.float64], float]:
    """A pad, a push with shear in its middle (mm), and a node's share of the surface (mm²)."""
    outline = RoundedRectangle(20.0, 20.0, 0.0)
    mesh = build_pad_mesh(outline, THICKNESS_MM, pitch_mm=0.5, layers=layers)[0]
    x, y = np.asarray(mesh.nodes_mm)[np.asarray(mesh.surface), :2].T
    bump = np.exp(-(x**2 + y**2) / (2 * 1.5**2))
    return mesh, np.column_stack([0.1 * bump, 0 * bump, -0.2 * bump]), 0.25


@pytest.fixture(scope="module")
def forces() -> dict[int, NDArray[np.float64]]:
    """Nodal forces (s, 3) in N of the same motion, on one, two and four layers."""
    found = {}
    for layers in (1, 2, 4):
        mesh, motion, _ = bumped_pad(layers)
        rung: Rung = "paper" if layers == 1 else "factor"
        found[layers] = surface_operator(mesh, GEL, "bbar", rung).force(motion)
    return found


def test_the_resultant_is_an_average_of_the_motion(forces: dict[int, NDArray[np.float64]]) -> None:
    """Betti: F_x = (G/h) ∫ u_x dA and F_z = (M/h) ∫ u_z dA, whatever the layers."""
    e, nu = GEL.youngs_modulus_mpa, GEL.poissons_ratio
    shear = e / (2 * (1 + nu))
    press = e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    _, motion, area = bumped_pad(1)
    volume = motion.sum(axis=0) * area
    for layers, force in forces.items():
        total = force.sum(axis=0)
        assert total[0] == pytest.approx(shear / THICKNESS_MM * volume[0], rel=5e-3), layers
        assert total[2] == pytest.approx(press / THICKNESS_MM * volume[2], rel=5e-3), layers


def test_the_field_shows_an_error_that_the_resultant_hides(
    forces: dict[int, NDArray[np.float64]],
) -> None:
    four = forces[4]
    total = four.sum(axis=0)

    def off(force: NDArray[np.float64]) -> tuple[float, float]:
        field = np.linalg.norm(force - four) / np.linalg.norm(four)
        return float(field), float(np.linalg.norm(force.sum(axis=0) - total)) / float(
            np.linalg.norm(total)
        )

    one, two = off(forces[1]), off(forces[2])
    assert one[1] < 5e-3
    assert two[1] < 5e-3
    assert one[0] > 0.25
    assert one[0] > 50 * one[1]
    assert two[0] < 0.3 * one[0]


def test_errors_of_the_projection_formulas() -> None:
    """The table's figures, for a press of 0.5 mm anywhere on the gel of gelslim2."""
    camera = virtual_camera(derive(shipped("gelslim2")))
    height, foot = -camera.position_mm[2], camera.position_mm[0]
    seen = error_map(camera, np.linspace(-14, 14, 57), np.linspace(-14, 14, 57), -0.5)

    def between(model: ErrorModel) -> tuple[float, float]:
        off = 100 * seen.relative(model)
        return float(np.nanmin(off)), float(np.nanmax(off))

    assert between("arctan") == pytest.approx((-4.6, -4.24), abs=0.06)
    assert between("effective_height") == pytest.approx((-1.56, -0.96), abs=0.05)
    assert between("printed") == pytest.approx((-4.6, 15.9), abs=0.3)
    reach = np.linspace(0.05, 2.0, 200)
    along = error_map(camera, foot + reach * height, [0.0], -0.5).relative("printed")[0]
    assert height == pytest.approx(38.20, abs=0.05)
    assert reach[np.argmax(along > 0)] == pytest.approx(0.4, abs=0.02)
    assert (reach[np.argmax(along)], along.max()) == pytest.approx((1.4, 0.33), abs=0.01)


def test_best_focus_evens_the_blur_of_the_picture_not_of_the_gel() -> None:
    d = derive(read_spec(ROOT / "designs" / "mini20.yaml").spec)
    near, far = float(d["view.near_tangential_mm"]), float(d["view.far_sagittal_mm"])
    focus, aperture = float(d["view.focus_mm"]), float(d["view.aperture_mm"])
    assert focus == pytest.approx(2 * near * far / (near + far))
    # In the picture, c = A f |Z - s| / (Z (s - f)), the same for both images.
    assert (far - focus) / far == pytest.approx((focus - near) / near)
    on_gel = [aperture * abs(z - focus) / focus for z in (near, far)]
    assert on_gel == pytest.approx([d["view.near_blur_mm"], d["view.far_blur_mm"]])
    assert on_gel[1] / on_gel[0] == pytest.approx(far / near)
