"""CalculiX judges contact at large strain: a ball in a nearly incompressible neo-Hookean pad.

CalculiX has quadratic elements of reduced integration on a part of the pad up to planes of
symmetry, a tessellated rigid ball and a contact pressure of 200 MPa per mm of penetration; the
twin has F-bar elements of eight nodes and exact contact of nodes, on two meshes from which the
force is extrapolated with the square of the pitch.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from deck import ABSENT, CALCULIX, Array, Cap, contact, motion, run
from scipy.interpolate import RectBivariateSpline

sys.path.insert(0, str(Path(__file__).parents[1] / "twin"))

from contact_pads import YOUNGS_MPA, small_pad

from gelslim_twin.contact.gel_body import GelBody
from gelslim_twin.contact.newton_contact import NewtonContact, SolidState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.exports.solid_mesh import SolidMesh, solid_mesh
from ifem_export.exports.solver_files import export_mesh
from ifem_export.mesh.pad_mesh import PadMesh

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CALCULIX is None, reason=ABSENT)]
POISSON, RADIUS_MM, HALF_MM, THICK_MM = 0.49, 5.0, 4.0, 2.0
PENALTY_MPA_MM = 200.0
CELLS = 16, 24
Goals = tuple[tuple[float, float], ...]


@cache
def walked(cells: int, friction: float, path: Goals) -> SolidState:
    """The twin's ball at the end of a path of depth and motion along x, four poses each."""
    pad = small_pad(POISSON, cells, cells // 4, 2 * HALF_MM, THICK_MM)
    ball = Tool.of([Sphere(shape="sphere", radius_mm=RADIUS_MM)], Path())
    solver = ContactSolver(SurfaceCompliance(pad), ball, ContactSettings(1e-3, friction))
    one = NewtonContact(solver, GelBody(pad), 1e-4)
    state, before, last = one.released(), Pose(), np.zeros(2)
    for goal in path:
        for share in (0.25, 0.5, 0.75, 1.0):
            depth, across = last + share * (np.array(goal) - last)
            pose = Pose(time_s=before.time_s + 1, x_mm=across, depth_mm=depth)
            state, before = one.step(state, before, pose), pose
        last = np.array(goal)
    return state


def extrapolated_n(friction: float, path: Goals) -> Array:
    coarse, fine = (np.asarray(walked(n, friction, path).force_n).sum(axis=0) for n in CELLS)
    return np.asarray(fine + (fine - coarse) / ((CELLS[1] / CELLS[0]) ** 2 - 1))


def symmetry(mesh: SolidMesh, planes: tuple[int, ...]) -> Iterator[str]:
    for axis in planes:
        yield "*BOUNDARY"
        for node in np.flatnonzero(np.abs(mesh.nodes_mm[:, axis]) < 1e-9):
            yield f"{node + 1}, {axis + 1}, {axis + 1}, 0"


def calculix(
    folder: Path, cells: tuple[int, int, int], planes: tuple[int, ...], friction: float, path: Goals
) -> tuple[Array, Array, Array]:
    """Force of the whole ball on the pad; places and displacements of surface nodes."""
    low = np.array([0.0 if axis in planes else -HALF_MM for axis in (0, 1)])
    pitch = (*((HALF_MM - low) / cells[:2]), THICK_MM / cells[2])
    mesh = PadMesh.from_occupancy(np.ones(cells, dtype=bool), pitch, (*low, -THICK_MM))
    pad = build_bundle(mesh, Material(YOUNGS_MPA, POISSON, 1000.0), "full", spec_hash="5pec")
    export_mesh(pad, folder / "pad.inp", "C3D20R", "neo_hookean")
    solid = solid_mesh(mesh, "C3D20R")
    cap = Cap(RADIUS_MM, 2.6, 40, 1_000_001)
    lines = ["*INCLUDE, INPUT=pad.inp", *symmetry(solid, planes), *cap.lines()]
    lines += contact(PENALTY_MPA_MM, friction)
    for depth, across in path:
        lines += ["*STEP, NLGEOM, INC=100", "*STATIC", "0.25, 1., 1e-4, 0.5"]
        lines += motion(cap.nodes, np.tile([across, 0.0, -depth], (len(cap.nodes), 1)))
        lines += ["*NODE PRINT, NSET=BALL, FREQUENCY=100", "RF"]
        lines += ["*NODE PRINT, NSET=SURFACE, FREQUENCY=100", "U", "*END STEP"]
    last = run(folder, lines)[-1]
    force = 2 ** len(planes) * last["forces"][:, 1:].sum(axis=0)
    force[list(planes)] = 0.0
    moved = last["displacements"]
    return force, solid.nodes_mm[moved[:, 0].astype(int) - 1], moved[:, 1:]


def test_a_ball_of_a_fifth_of_the_thickness(tmp_path: Path) -> None:
    path = ((0.4, 0.0),)
    force, places, moved = calculix(tmp_path, (8, 8, 4), (0, 1), 0.0, path)
    assert extrapolated_n(0.0, path)[2] == pytest.approx(force[2], rel=0.02)
    off = spline(walked(CELLS[1], 0.0, path), places) - moved
    assert np.sqrt((off**2).mean(axis=0)).max() < 3e-3


def test_a_ball_that_is_sheared_with_friction(tmp_path: Path) -> None:
    path = ((0.3, 0.0), (0.3, 0.2))
    force, _, _ = calculix(tmp_path, (12, 6, 3), (1,), 0.5, path)
    expected = extrapolated_n(0.5, path)
    assert np.linalg.norm(expected - force) < 0.03 * np.linalg.norm(force)


def spline(state: SolidState, places_mm: Array) -> Array:
    """The twin's motion at other places of the surface."""
    pad = small_pad(POISSON, CELLS[1], CELLS[1] // 4, 2 * HALF_MM, THICK_MM).mesh
    nodes = np.asarray(pad.nodes_mm)[np.asarray(pad.surface)]
    x, y = np.unique(nodes[:, 0]), np.unique(nodes[:, 1])
    order = np.lexsort((nodes[:, 1], nodes[:, 0]))
    fields = np.asarray(state.displacement_mm)[order].reshape(len(x), len(y), 3)
    columns = [RectBivariateSpline(x, y, fields[:, :, axis]) for axis in range(3)]
    return np.stack([f(places_mm[:, 0], places_mm[:, 1], grid=False) for f in columns], axis=1)
