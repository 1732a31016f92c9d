"""All elements over the whole range of cell shapes and Poisson's ratios."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from ifem_layer import solve_held
from ifem_oracle import elasticity_matrix, random_occupancy, rigid_modes
from scipy.linalg import cholesky

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import FORMULATIONS, hex8_stiffness, mode_strains
from ifem_export.elements.kinematics import (
    GAUSS,
    TRACE,
    deviatoric_matrix,
    shape_gradients,
    strain_displacement,
)
from ifem_export.elements.material import Material
from ifem_export.mesh.lattice import VTK_CORNERS
from ifem_export.mesh.pad_mesh import PadMesh

NUS = (0.0, 0.3223, 0.49, 0.4999)
MONOMIALS = list(product((0, 1), repeat=3))
SHEARS = ((1, 2), (0, 2), (0, 1))


def random_size(seed):
    """Thickness 0.05 to 20 mm, aspects hx/hz and hy/hz 0.02 to 50, all different."""
    rng = np.random.default_rng(seed)
    hz = 0.05 * 400.0 ** rng.random()
    hx, hy = hz * 0.02 * 2500.0 ** rng.random(2)
    return (hx, hy, hz)


EXTREMES = [
    (1.0, 1.0, 0.02),
    (0.02, 0.02, 1.0),
    (0.02, 1.0, 1.0),
    (50.0, 0.02, 1.0),
    (1000.0, 900.0, 20.0),
    (0.001, 2.5, 0.05),
]
SIZES = [random_size(seed) for seed in range(12)] + EXTREMES


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_exactly_six_zero_modes_for_any_cell_shape(formulation, nu):
    """Rigid motions are free, and the element is definite on all that strains it.

    Straining displacements are taken one polynomial each and scaled to unit energy, so that a
    soft bending mode of a needle is not mistaken for a spurious one.
    """
    for size in SIZES:
        K = hex8_stiffness(size, Material(0.147, nu, 1.0), formulation)
        assert np.array_equal(K, K.T)
        modes = rigid_modes((VTK_CORNERS - 0.5) * np.array(size))
        for mode in modes.T:
            assert np.abs(K @ mode).max() < 1e-14 * (np.abs(K) @ np.abs(mode)).max()
        straining = straining_basis(size)
        assert np.linalg.matrix_rank(np.hstack([modes, straining]), tol=1e-12) == 24
        reduced = straining.T @ K @ straining
        scale = 1.0 / np.sqrt(np.diag(reduced))
        scaled = scale[:, None] * reduced * scale
        assert np.linalg.eigvalsh(scaled)[0] > 1e-8
        cholesky(scaled)


def test_mean_dilatation_with_the_nine_modes_would_have_nine_zero_modes():
    """Why the incompatible element keeps the whole dilatation, and that the test above sees it."""
    size, material = (1.0, 2.0, 0.5), Material(0.147, 0.3, 1.0)
    B = strain_displacement(shape_gradients(size, GAUSS))
    G = mode_strains(size, GAUSS)[..., :9]
    D = deviatoric_matrix(material)
    mean_b, mean_g = (TRACE @ strain.mean(axis=0) for strain in (B, G))

    def energy(p, q, mean_p, mean_q):
        deviatoric = np.einsum("gri,rs,gsj->ij", p, D, q)
        return deviatoric + 8.0 * material.bulk_modulus_mpa * np.outer(mean_p, mean_q)

    cross = energy(B, G, mean_b, mean_g)
    inner = energy(G, G, mean_g, mean_g)
    K = energy(B, B, mean_b, mean_b) - cross @ np.linalg.solve(inner, cross.T)
    values = np.linalg.eigvalsh(K)
    assert (np.abs(values) < 1e-12 * values[-1]).sum() == 9
    straining = straining_basis(size)
    reduced = straining.T @ K @ straining
    scale = 1.0 / np.sqrt(np.diag(reduced))
    assert np.linalg.eigvalsh(scale[:, None] * reduced * scale)[2] < 1e-12


def straining_basis(size):
    """(24, 18) displacements of a cell, none of them rigid, each with a strain of its own."""
    local = 2.0 * VTK_CORNERS - 1.0
    x = (VTK_CORNERS - 0.5) * np.array(size)
    found = []
    for i in range(3):
        found.append(np.outer(x[:, i], np.eye(3)[i]))
    for i, j in SHEARS:
        # Largest displacement 1, whatever the aspect: else the other component would vanish.
        found.append(np.outer(x[:, i], np.eye(3)[j]) + np.outer(x[:, j], np.eye(3)[i]))
    for power in ((1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)):
        for i in range(3):
            found.append(np.outer((local**power).prod(axis=1), np.eye(3)[i]))
    return np.stack([f.ravel() / np.abs(f).max() for f in found], axis=1)


@pytest.mark.parametrize("size", [(1, 1, 1), (Fraction(1, 50), 3, 1), (7, Fraction(1, 3), 50)])
def test_mode_strains_are_independent_of_the_cells_own(size):
    """Exact rational proof that the condensed element has the six rigid zero modes only.

    Its energy vanishes only if B u + G a = 0 at every Gauss point, that is for every
    coefficient of these multilinear polynomials. [B G] has rank 18 + 12, so a = 0 and u is
    rigid: for every ν with a positive-definite D.
    """
    B, G = polynomial_strains(size)
    assert exact_rank(B) == 18
    assert exact_rank(G) == 12
    assert exact_rank([b + g for b, g in zip(B, G, strict=True)]) == 30
    assert all(value == 0 for row in G[:6] for value in row)  # no mode has a mean
    # These polynomials are those of the code.
    points = np.random.default_rng(0).uniform(-1.0, 1.0, size=(5, 3))
    floats = [float(h) for h in size]
    for polynomial, code in (
        (B, strain_displacement(shape_gradients(floats, points))),
        (G, mode_strains(floats, points)),
    ):
        values = evaluate(polynomial, points)
        assert code == pytest.approx(values, rel=1e-12, abs=1e-14 * np.abs(values).max())


def polynomial_strains(size):
    """Coefficient rows (monomial, strain component) of B (24 columns) and G (12 columns)."""
    gradient = {}
    for a, corner in enumerate(VTK_CORNERS.tolist()):
        sign = [2 * c - 1 for c in corner]
        for j in range(3):
            others = [axis for axis in range(3) if axis != j]
            for powers in product((0, 1), repeat=2):
                monomial = [0, 0, 0]
                value = Fraction(sign[j], 4) / Fraction(size[j])
                for axis, power in zip(others, powers, strict=True):
                    monomial[axis] = power
                    value *= sign[axis] if power else 1
                gradient[a, j, tuple(monomial)] = value
    B = _strain_rows(gradient, 8)
    wilson = {}
    for m in range(3):
        monomial = tuple(int(axis == m) for axis in range(3))
        wilson[m, m, monomial] = Fraction(-4) / Fraction(size[m])
    G = _strain_rows(wilson, 3)
    for row, (monomial, component) in enumerate(product(MONOMIALS, range(6))):
        for pair in ((0, 1, 1), (1, 0, 1), (1, 1, 0)):
            G[row].append(Fraction(int(monomial == pair and component < 3)))
    return B, G


def _strain_rows(gradient, n):
    rows = []
    for monomial, component in product(MONOMIALS, range(6)):
        row = [Fraction(0)] * (3 * n)
        for a in range(n):
            if component < 3:
                row[3 * a + component] = gradient.get((a, component, monomial), Fraction(0))
            else:
                i, j = SHEARS[component - 3]
                row[3 * a + i] = gradient.get((a, j, monomial), Fraction(0))
                row[3 * a + j] = gradient.get((a, i, monomial), Fraction(0))
        rows.append(row)
    return rows


def exact_rank(rows):
    rows, rank = [list(row) for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((r for r in range(rank, len(rows)) if rows[r][column]), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for r in range(rank + 1, len(rows)):
            if rows[r][column]:
                factor = rows[r][column] / rows[rank][column]
                rows[r] = [x - factor * y for x, y in zip(rows[r], rows[rank], strict=True)]
        rank += 1
    return rank


def evaluate(rows, points):
    table = np.array([[float(v) for v in row] for row in rows]).reshape(8, 6, -1)
    monomials = np.stack([(points ** np.array(m)).prod(axis=1) for m in MONOMIALS], axis=1)
    return np.einsum("pm,mrc->prc", monomials, table)


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("size", SIZES[:6])
def test_elements_from_exact_integrals_of_the_polynomials(size, nu):
    """An independent route to all three: moments of monomials instead of Gauss points."""
    material = Material(0.147, nu, 1.0)
    B, G = (
        np.array([[float(v) for v in row] for row in rows]).reshape(8, 6, -1)
        for rows in polynomial_strains([Fraction(h) for h in size])
    )
    volume = np.prod(size)
    moments = volume / 3.0 ** np.array([sum(m) for m in MONOMIALS])
    D = elasticity_matrix(material)

    def energy(p, q):
        return np.einsum("m,mri,rs,msj->ij", moments, p, D, q)

    full = energy(B, B)
    trace = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    swelling = np.einsum("r,mri->mi", trace, B)[1:]
    fluctuation = np.einsum("m,mi,mj->ij", moments[1:], swelling, swelling)
    bbar = full - material.bulk_modulus_mpa * fluctuation
    condensed = full - energy(B, G) @ np.linalg.solve(energy(G, G), energy(G, B))
    bound = 1e-12 * np.abs(full).max()
    for formulation, expected in (("full", full), ("bbar", bbar), ("incompatible", condensed)):
        assert np.abs(hex8_stiffness(size, material, formulation) - expected).max() < bound


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("seed", range(4))
def test_permutation_mirror_and_scaling_of_random_cells(formulation, seed):
    size, nu = random_size(seed), NUS[seed]
    K = hex8_stiffness(size, Material(0.147, nu, 1.0), formulation)
    bound = 1e-13 * np.abs(K).max()
    corner = {tuple(c): a for a, c in enumerate(VTK_CORNERS.tolist())}
    for order in ((1, 0, 2), (2, 1, 0), (1, 2, 0)):
        image = [corner[tuple(c[list(order)])] for c in VTK_CORNERS]
        at = [3 * image[a] + order.index(i) for a in range(8) for i in range(3)]
        turned_size = tuple(size[i] for i in order)
        turned = hex8_stiffness(turned_size, Material(0.147, nu, 1.0), formulation)
        assert np.abs(turned[np.ix_(at, at)] - K).max() < bound
    for axis in range(3):
        flipped = VTK_CORNERS.copy()
        flipped[:, axis] = 1 - flipped[:, axis]
        image = [corner[tuple(c)] for c in flipped.tolist()]
        at = [3 * b + i for b in image for i in range(3)]
        sign = np.tile(np.where(np.arange(3) == axis, -1.0, 1.0), 8)
        assert np.abs(K[np.ix_(at, at)] * np.outer(sign, sign) - K).max() < bound
    doubled = tuple(2.0 * h for h in size)
    stiff = hex8_stiffness(doubled, Material(0.294, nu, 1.0), formulation)
    assert np.abs(stiff - 4.0 * K).max() < 4.0 * bound


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("seed", "nu"), [(0, 0.3223), (1, 0.49), (2, 0.4999)])
def test_patch_test_by_solution(formulation, seed, nu):
    """Linear displacement held where a cell is missing: the inside follows it exactly."""
    occupancy = random_occupancy(seed, (6, 5, 4), 0.93)
    size = (0.5, 0.7, 0.4)
    mesh = PadMesh.from_occupancy(occupancy, size, (0.0, 0.0, 0.0))
    K = assemble_csr(occupancy, hex8_stiffness(size, Material(0.147, nu, 1.0), formulation))
    exact = mesh.nodes_mm @ np.random.default_rng(seed).normal(size=(3, 3)) + [0.1, -0.2, 0.3]
    inside = np.bincount(mesh.hexes.ravel(), minlength=mesh.n_nodes) == 8
    assert inside.sum() > 8
    held = np.repeat(~inside[:, None], 3, axis=1)
    u = solve_held(K, held, np.where(held, exact, 0.0))
    assert np.abs(u - exact).max() < 1e-10


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("nu", "swells"), [(0.3, True), (0.3, False), (0.4999, False)])
def test_displacement_error_falls_with_the_square_of_the_cell(formulation, nu, swells):
    """Manufactured fields on a brick, least-squares slope of log error over log h."""
    material = Material(1.0, nu, 1.0)
    cells = np.array([4, 6, 8, 12])
    errors = [manufactured_error(formulation, material, int(n), swells) for n in cells]
    slope = np.polyfit(np.log(1.0 / cells), np.log(errors), 1)[0]
    if formulation == "full" and nu > 0.49:
        # Locked: it has hardly begun to converge on these meshes.
        assert errors[-1] > 0.05
        assert slope < 1.0
        return
    assert 1.9 < slope < 2.8
    assert errors[-1] < 0.02


def manufactured_error(formulation, material, n, swells):
    cells = (n, n, n // 2)
    size = (1.0 / n, 0.8 / n, 1.0 / n)
    mesh = PadMesh.from_occupancy(np.ones(cells, dtype=bool), size, (0.2, 0.1, 0.3))
    K = assemble_csr(mesh.occupancy, hex8_stiffness(size, material, formulation))
    points, weights = np.polynomial.legendre.leggauss(3)
    local = np.array(list(product(points, repeat=3)))
    weight = np.array([a * b * c for a, b, c in product(weights, repeat=3)])
    signs = 2.0 * VTK_CORNERS - 1.0
    shape = (1.0 + local[:, None, :] * signs).prod(axis=2) / 8.0
    places = np.einsum("ga,cai->cgi", shape, mesh.nodes_mm[mesh.hexes])
    force = body_force(places, material, swells)
    corner_load = np.prod(size) / 8.0 * np.einsum("g,ga,cgi->cai", weight, shape, force)
    load = np.zeros((mesh.n_nodes, 3))
    np.add.at(load, mesh.hexes, corner_load)
    exact = field(mesh.nodes_mm, swells)
    inside = np.bincount(mesh.hexes.ravel(), minlength=mesh.n_nodes) == 8
    held = np.repeat(~inside[:, None], 3, axis=1)
    u = solve_held(K, held, np.where(held, exact, 0.0), load)
    return np.linalg.norm((u - exact)[inside]) / np.linalg.norm(exact[inside])


def field(x, swells):
    """(..., 3): a field that changes the volume, or one that does not."""
    s, c = np.sin(np.pi * x), np.cos(np.pi * x)
    if swells:
        return (s.prod(axis=-1))[..., None] * np.array([1.0, -0.5, 0.7])
    u = s[..., 0] * c[..., 1] * s[..., 2]
    v = -c[..., 0] * s[..., 1] * s[..., 2]
    return np.stack([u, v, np.zeros_like(u)], axis=-1)


def body_force(x, material, swells):
    """-div σ of `field`: 3π² G u - (λ + G) grad div u."""
    g, lam = material.shear_modulus_mpa, material.lame_lambda_mpa
    force = 3.0 * np.pi**2 * g * field(x, swells)
    if swells:
        s, c = np.sin(np.pi * x), np.cos(np.pi * x)
        direction = np.array([1.0, -0.5, 0.7])
        for i, j in product(range(3), repeat=2):
            factors = [s[..., a] for a in range(3)]
            if i == j:
                factors[i] = -s[..., i]
            else:
                factors[i], factors[j] = c[..., i], c[..., j]
            second = np.pi**2 * factors[0] * factors[1] * factors[2]
            force[..., i] -= (lam + g) * direction[j] * second
    return force
