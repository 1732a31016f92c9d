"""Bending of slender beams and plates against beam theory: where B-bar and full cells lock."""

import numpy as np
import pytest
from ifem_layer import solve_held

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import FORMULATIONS, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh

E_MPA = 0.147


def beam(cells, dimensions_mm, nu, formulation):
    size = tuple(d / n for d, n in zip(dimensions_mm, cells, strict=True))
    origin = (0.0, -dimensions_mm[1] / 2.0, -dimensions_mm[2] / 2.0)
    mesh = PadMesh.from_occupancy(np.ones(cells, dtype=bool), size, origin)
    Ke = hex8_stiffness(mesh.cell_size_mm, Material(E_MPA, nu, 1.0), formulation)
    return mesh, assemble_csr(mesh.occupancy, Ke)


def pure_bending_curvature(nu, formulation, cells, dimensions_mm):
    """End moments by linear tractions on a beam held statically determinate; over M/(E I)."""
    length, width, height = dimensions_mm
    mesh, K = beam(cells, dimensions_mm, nu, formulation)
    x = mesh.nodes_mm
    moment, inertia = 1e-4, width * height**3 / 12.0
    load = np.zeros_like(x)
    signs = {0.0: -1.0, length: 1.0}
    hy, hz = width / cells[1], height / cells[2]
    faces = np.array([[0, 3, 7, 4], [1, 2, 6, 5]])
    for end, sign in signs.items():
        for corners in mesh.hexes:
            at = corners[faces[int(sign > 0)]]
            if not np.isclose(x[at, 0], end).all():
                continue
            low, high = x[at, 2].min(), x[at, 2].max()
            middle, rise = (low + high) / 2.0, (high - low) / 6.0
            share = np.where(x[at, 2] > middle, middle + rise, middle - rise)
            load[at, 0] += sign * moment / inertia * share * hy * hz / 4.0
    held = np.zeros(x.shape, dtype=bool)
    foot = np.flatnonzero(np.isclose(x[:, 0], 0.0))
    a = foot[np.argmin(x[foot, 1] + x[foot, 2])]
    b = foot[np.argmin(-x[foot, 1] + x[foot, 2])]
    c = foot[np.argmin(x[foot, 1] - x[foot, 2])]
    held[a] = True
    held[b, [0, 2]] = True
    held[c, 0] = True
    u = solve_held(K, held, np.zeros_like(x), load)
    tip = np.isclose(x[:, 0], length)
    slopes = [np.polyfit(x[at, 2], u[at, 0], 1)[0] for at in (tip, foot)]
    return (slopes[0] - slopes[1]) / length / (moment / (E_MPA * inertia))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49, 0.4999])
@pytest.mark.parametrize("cells", [(1, 1, 1), (4, 1, 1), (5, 2, 2)])
def test_pure_bending_is_exact_with_incompatible_modes(nu, cells):
    """St Venant bending is quadratic and lies in the enriched space, Poisson's saddle as well."""
    curvature = pure_bending_curvature(nu, "incompatible", cells, (10.0, 1.5, 1.0))
    assert curvature == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_the_others_lock_in_pure_bending(nu):
    """Parasitic shear: a lone long cell is stiffer by more than the square of its aspect."""
    for formulation in ("full", "bbar"):
        curvature = pure_bending_curvature(nu, formulation, (1, 1, 1), (10.0, 1.5, 1.0))
        assert curvature < 0.05


@pytest.mark.parametrize(("nu", "limit"), [(0.0, 0.01), (0.3, 0.02), (0.49, 0.04)])
def test_cantilever_against_timoshenko(nu, limit):
    """Tip force on a slender beam: P L³/(3 E I) + P L/(k G A), k = 10(1+ν)/(12+11ν)."""
    dimensions = (12.0, 0.3, 0.6)
    length, width, height = dimensions
    inertia, area = width * height**3 / 12.0, width * height
    shear = E_MPA / (2.0 * (1.0 + nu))
    factor = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
    expected = length**3 / (3.0 * E_MPA * inertia) + length / (factor * shear * area)
    error = {}
    for formulation in FORMULATIONS:
        mesh, K = beam((12, 1, 1), dimensions, nu, formulation)
        x = mesh.nodes_mm
        tip, foot = np.isclose(x[:, 0], length), np.isclose(x[:, 0], 0.0)
        load = np.zeros_like(x)
        load[tip, 2] = 1e-5 / tip.sum()
        # The root may contract sideways, as beam theory has it.
        held = np.zeros(x.shape, dtype=bool)
        held[foot, 0] = True
        low = np.flatnonzero(foot & (x[:, 2] < 0.0))
        held[low, 2] = True
        held[low[0], 1] = True
        u = solve_held(K, held, np.zeros_like(x), load)
        error[formulation] = u[tip, 2].mean() / 1e-5 / expected - 1.0
    assert abs(error["incompatible"]) < limit
    assert abs(error["bbar"]) > 5.0 * limit
    assert abs(error["full"]) > 10.0 * limit
    assert abs(error["incompatible"]) < 0.2 * min(abs(error["bbar"]), abs(error["full"]))
