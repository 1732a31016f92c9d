"""The patch's errors against the bundle's own ladder and against scaling."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from explore_samples import mini20

from gelslim_cad.dimensions import derive
from gelslim_cad.explore.force_error import Patch, PatchError, patch_error
from gelslim_cad.explore.space import changed
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.ladder import reference_forces
from ifem_export.operators.surface_operator import surface_operator

COARSE = Patch(2.0, 1.2, 1.2, 4, "bbar", 0.3223, 1.2)


@pytest.mark.slow
def test_smaller_cells_err_less_and_wider_markers_pass_less_noise_on() -> None:
    coarse = patch_error(COARSE)
    fine = patch_error(dataclasses.replace(COARSE, cell_x_mm=0.6, cell_y_mm=0.6))
    sparse = patch_error(dataclasses.replace(COARSE, pitch_mm=2.4))
    assert 0 < fine.mesh < coarse.mesh < 0.2
    assert sparse.mesh == coarse.mesh
    assert 0 < sparse.noise_gain < coarse.noise_gain


def test_the_mesh_error_is_that_of_a_pad_of_any_modulus() -> None:
    """Shear and press of a larger pad at E = 0.147 MPa, by exact condensation."""
    n, h, width = 16, 1.2, 2.0
    mesh = PadMesh.from_occupancy(
        np.ones((n, n, 4), bool), (h, h, 0.5), (-n * h / 2, -n * h / 2, -2.0)
    )
    gel = Material(0.147, 0.3223, 1000.0)
    errors = []
    for way in ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)):

        def bump(p: np.ndarray, way: tuple[float, float, float] = way) -> np.ndarray:
            squares = (np.asarray(p)[:, :2] ** 2).sum(axis=1)
            return 0.1 * np.exp(-squares / (2 * width**2))[:, None] * np.array(way)

        (truth,) = reference_forces(mesh, gel, [bump])
        operator = surface_operator(mesh, gel, "bbar", "factor")
        found = operator.force(bump(np.asarray(mesh.nodes_mm)[mesh.surface]))
        errors.append(np.linalg.norm(found - truth) / np.linalg.norm(truth))
    assert patch_error(COARSE).mesh == pytest.approx(max(errors), rel=0.02)


def test_designs_that_differ_elsewhere_share_a_patch() -> None:
    d = derive(mini20())
    longer = derive(changed(mini20(), {"design.gel.length_mm": 18.0, "camera.f_number": 4.0}))
    stiffer = derive(changed(mini20(), {"material.gel.youngs_modulus_mpa": 0.4}))
    thinner = derive(changed(mini20(), {"design.gel.thickness_mm": 1.7}))
    assert Patch.of(d) == Patch.of(longer) == Patch.of(stiffer) != Patch.of(thinner)


def test_noise_falls_with_the_pixels_per_marker() -> None:
    error = PatchError(0.01, 7.0, 30.0)
    near = {"view.marker_along_px": 10.0, "view.marker_across_px": 12.0}
    far = {"view.marker_along_px": 5.0, "view.marker_across_px": 12.0}
    dot = {"design.markers.diameter_mm": 0.5}
    # 0.05 px of a 0.5 mm marker seen over 10 px is 2.5 µm; the bump is 100 µm deep.
    assert error.noise({**near, **dot}, 0.05) == pytest.approx(7.0 * 0.0025 / 0.1)
    assert error.noise({**far, **dot}, 0.05) == pytest.approx(7.0 * 0.005 / 0.1)
