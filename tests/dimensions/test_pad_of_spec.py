"""The pad that a spec asks for: crown and cut cells reach the mesh."""

from pathlib import Path

import numpy as np
import pytest

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.sensor import marker_grid, pad_mesh, reference_mesh
from gelslim_cad.spec.reader import read_spec

NO_COUNTS = {"cells_along": None, "cells_across": None}
DESIGN = Path(__file__).parents[2] / "designs" / "gelslim2.yaml"


def finger(crown_mm=0.0, **mesh):
    base = read_spec(DESIGN).spec
    gel = base.design.gel.model_copy(update={"crown_height_mm": crown_mm})
    design = base.design.model_copy(update={"gel": gel})
    made = base.mesh.model_copy(update=mesh)
    return derive(base.model_copy(update={"design": design, "mesh": made}))


def meshed(d):
    return pad_mesh(d, marker_grid(d))[0]


def test_a_flat_gel_of_whole_cells_is_the_default():
    mesh = meshed(finger())
    assert mesh.fill is None
    assert mesh.surface_shift is None
    assert reference_mesh(finger(), mesh) is None


@pytest.mark.parametrize("by_counts", [False, True])
@pytest.mark.parametrize("crown_mm", [0.0, 0.5])
def test_volume_fractions_keep_the_volume_of_the_cad(crown_mm, by_counts):
    counts = {"cells_along": 40, "cells_across": 37} if by_counts else NO_COUNTS
    d = finger(crown_mm, weighting="volume_fraction", **counts)
    mesh = meshed(d)
    volume = mesh.fill.sum() * np.prod(mesh.cell_size_mm)
    assert volume == pytest.approx(GelShape.of(d).volume_mm3, rel=1e-3)


@pytest.mark.parametrize("weighting", ["cell_centre", "volume_fraction"])
def test_a_crowned_gel_has_the_surface_of_the_cad(weighting):
    d = finger(0.5, weighting=weighting)
    mesh, shape = meshed(d), GelShape.of(d)
    assert mesh.nodes_mm[:, 2].min() == pytest.approx(-shape.thickness_mm)
    points = mesh.surface_mm
    inside = np.abs(points[:, :2]).max(axis=1) < 0.4 * min(shape.length_mm, shape.width_mm)
    gap = points[inside, 2] - shape.surface_z_mm(points[inside, 0], points[inside, 1])
    most = 1e-9 if weighting == "volume_fraction" else mesh.cell_size_mm[2]
    assert np.abs(gap).max() <= most
    assert np.ptp(points[:, 2]) > 0.1


def test_the_reference_of_a_crowned_pad_has_its_nodes():
    d = finger(0.5)
    mesh = meshed(d)
    fine = reference_mesh(d, mesh)
    assert fine.layers == 8
    assert fine.fill is not None
    steps = (np.array(mesh.origin_mm) - fine.origin_mm)[:2] / fine.cell_size_mm[:2]
    assert steps == pytest.approx(np.rint(steps), abs=1e-6)
