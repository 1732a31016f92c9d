"""CalculiX judges the pad: forces of elements, condensed stiffness, the gel at large strain.

Forces are compared with those of the bundle's own operators on the same motion. CalculiX prints
seven digits.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from deck import ABSENT, CALCULIX, Array, motion, run

sys.path.insert(0, str(Path(__file__).parents[1] / "twin"))

from contact_pads import small_pad

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.exports.solid_mesh import ElementType, solid_mesh
from ifem_export.exports.solver_files import Law, export_mesh
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
from ifem_export.mesh.crop import Weighting
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CALCULIX is None, reason=ABSENT)]
YOUNGS_MPA = 0.147


def pad_of(poisson: float, formulation: Formulation, weighting: str = "cell_centre") -> Bundle:
    outline = RoundedRectangle(8.0, 6.0, 1.0)
    mesh, _ = build_pad_mesh(
        outline,
        2.0,
        pitch_mm=(0.8, 0.9),
        layers=3,
        weighting=weighting,  # type: ignore[arg-type]
    )
    return build_bundle(mesh, Material(YOUNGS_MPA, poisson, 1000.0), formulation, spec_hash="5pec")


def forces(
    folder: Path,
    bundle: Bundle,
    nodes: Array,
    moved_mm: Array,
    element: ElementType | None = None,
    law: Law = "linear",
) -> Array:
    """Forces (n, 3) of all nodes after CalculiX has moved some of them."""
    export_mesh(bundle, folder / "pad.inp", element, law)
    step = "*STEP, NLGEOM" if law == "neo_hookean" else "*STEP"
    lines = ["*INCLUDE, INPUT=pad.inp", step, "*STATIC", *motion(nodes, moved_mm)]
    lines += ["*NODE PRINT, NSET=ALL, FREQUENCY=100", "RF", "*END STEP"]
    rows = run(folder, lines)[-1]["forces"]
    found = np.zeros((int(rows[:, 0].max()), 3))
    found[rows[:, 0].astype(int) - 1] = rows[:, 1:]
    return found


@pytest.mark.parametrize(
    ("poisson", "weighting"), [(0.3223, "cell_centre"), (0.49, "volume_fraction")]
)
def test_full_elements_answer_any_motion_alike(
    poisson: float, weighting: Weighting, tmp_path: Path
) -> None:
    bundle = pad_of(poisson, "full", weighting)
    expected = np.asarray(bundle.self_test.force_n)
    free = np.asarray(bundle.mesh.free)
    found = forces(tmp_path, bundle, free, np.asarray(bundle.self_test.displacement_mm)[free])
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("poisson", [0.3223, 0.49])
def test_incompatible_elements_differ_in_one_kind_of_motion(poisson: float, tmp_path: Path) -> None:
    """A C3D8I of CalculiX has nine modes, ours has three dilatations besides.

    Those soften only the motions in which neighbouring corners move opposite ways; without them
    a cell has the same forces.
    """
    mesh = PadMesh.from_occupancy(np.ones((1, 1, 1), bool), (0.8, 0.9, 0.7), (0, 0, -0.7))
    bundle = build_bundle(
        mesh, Material(YOUNGS_MPA, poisson, 1000.0), "incompatible", spec_hash="5pec"
    )
    top = np.asarray(mesh.free)
    opposite = np.where(np.isin(top, mesh.hexes[0, [4, 6]]), 1.0, -1.0)
    moved = np.random.default_rng(3).normal(scale=1e-3, size=(4, 3))
    moved -= np.outer(opposite, opposite @ moved) / 4
    found = forces(tmp_path, bundle, top, moved)
    whole = np.zeros((8, 3))
    whole[top] = moved
    expected = (bundle.stiffness_matrix @ whole.ravel()).reshape(-1, 3)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("formulation", "poisson", "share"),
    [("full", 0.3223, 1e-6), ("incompatible", 0.3223, 1e-3), ("incompatible", 0.49, 1e-2)],
)
def test_the_condensed_surface_is_that_of_calculix(
    formulation: Formulation, poisson: float, share: float, tmp_path: Path
) -> None:
    """Only the surface is moved, by a dent with shear; CalculiX finds the inner nodes itself."""
    bundle = pad_of(poisson, formulation)
    surface = np.asarray(bundle.mesh.surface)
    u = dent_mm(np.asarray(bundle.mesh.nodes_mm)[surface], 0.05)
    expected = bundle.surface_operator("factor").force(u)
    found = forces(tmp_path, bundle, surface, u)[surface]
    assert np.linalg.norm(found - expected) < share * np.linalg.norm(expected)


@pytest.mark.parametrize("poisson", [0.3223, 0.45])
def test_a_strained_gel_has_the_energy_of_calculix(poisson: float, tmp_path: Path) -> None:
    """A motion of every node without change of volume ratio inside a cell, where all elements
    agree: pressed by 20 % and sheared by 30 %, cell by cell alike."""
    bundle = small_pad(poisson, 3, 2, 3.0)
    mesh = bundle.mesh
    places = np.asarray(mesh.nodes_mm)
    height = places[:, 2] - places[:, 2].min()
    gradient = np.array([[1.1, 0.0, 0.3], [0.0, 0.95, 0.0], [0.0, 0.05, 0.8]]) - np.eye(3)
    moved = np.column_stack([places[:, :2], height]) @ gradient.T
    bonded = np.asarray(mesh.bonded)
    free = np.setdiff1d(np.arange(mesh.n_nodes), bonded)
    every = forces(tmp_path, bundle, free, moved[free], "C3D8", "neo_hookean")
    only_free = moved.copy()
    only_free[bonded] = 0.0
    expected = NeoHookeanPad(mesh, bundle.material).force(only_free)
    above = mesh.nodes_mm[:, 2] > places[:, 2].min() + 1.1 * mesh.cell_size_mm[2]
    np.testing.assert_allclose(every[above], expected[above], atol=2e-6 * np.abs(expected).max())


def dent_mm(points_mm: Array, depth_mm: float, wide_mm: float = 2.5) -> Array:
    """A smooth dent that is also dragged sideways."""
    x, y = points_mm[:, 0] - 0.7, points_mm[:, 1] + 0.4
    bump = depth_mm * np.exp(-(x**2 + y**2) / wide_mm**2)
    return np.stack([0.4 * bump, -0.2 * bump, -bump], axis=1)


def test_sets_and_faces_are_complete(tmp_path: Path) -> None:
    """A unit pressure on OUTER_FACES adds up to the pad's area."""
    bundle = pad_of(0.3223, "full")
    export_mesh(bundle, tmp_path / "pad.inp")
    mesh = solid_mesh(bundle.mesh)
    lines = ["*INCLUDE, INPUT=pad.inp", "*STEP", "*STATIC", "*DLOAD"]
    lines += [f"{cell + 1}, P2, 1e-3" for cell in mesh.top_cells]
    lines += ["*NODE PRINT, NSET=BONDED", "RF", "*END STEP"]
    total = run(tmp_path, lines)[-1]["forces"][:, 1:].sum(axis=0)
    hx, hy, _ = bundle.mesh.cell_size_mm
    np.testing.assert_allclose(total, [0, 0, 1e-3 * hx * hy * len(mesh.top_cells)], atol=1e-8)
