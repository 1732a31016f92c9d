"""Tangent stiffness of the whole gel against dense matrices: plain, on springs and stiffened."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from contact_pads import small_pad
from numpy.typing import NDArray

from gelslim_twin.contact.gel_body import SPRINGS, STIFFENINGS, GelBody
from gelslim_twin.contact.gel_state import ContactError
from ifem_export.bundle.bundle import build_bundle
from ifem_export.elements.material import Material
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]


@cache
def body() -> GelBody:
    return GelBody(small_pad(0.49, 4, 2, 4.0))


@cache
def strained() -> Array:
    """Displacement (n, 3) of some hundredths of a millimetre, zero at the bond."""
    u = 0.05 * np.random.default_rng(0).standard_normal((body().pad.n_nodes, 3))
    u[np.asarray(body().bundle.mesh.bonded)] = 0.0
    return np.asarray(u)


def dense(pressure_mpa: Array) -> Array:
    free = body().free
    whole = body().pad.tangent(strained(), pressure_mpa).toarray()
    return np.asarray(whole[np.ix_(free, free)])


@cache
def compressible() -> Array:
    """Stiffness at rest with the same shear modulus and Poisson's ratio 0."""
    mesh, free = body().bundle.mesh, body().free
    soft = Material(2 * body().bundle.material.shear_modulus_mpa, 0.0, 1000.0)
    whole = NeoHookeanPad(mesh, soft).tangent(np.zeros((body().pad.n_nodes, 3))).toarray()
    return np.asarray(whole[np.ix_(free, free)])


def pressures(size: float) -> Array:
    return np.full(len(body().pad.mesh.hexes), size)


def held_by(kind: str) -> Array:
    """Projections (c, 3, 3): no node, all in all directions, or some along slanted normals."""
    held = np.zeros((len(body().surface), 3, 3))
    if kind == "all":
        held[:] = np.eye(3)
    if kind == "some":
        normal = np.array([0.36, 0.48, 0.8])
        held[3:20:2] = np.outer(normal, normal)
    return held


def springs_of(held: Array) -> Array:
    """Springs of share 1 as a dense matrix over the unknowns."""
    free, rest = list(body().free), compressible()
    out = np.zeros_like(rest)
    for node, own in zip(body().surface, held, strict=True):
        dof = [free.index(3 * node + axis) for axis in range(3)]
        out[np.ix_(dof, dof)] += own * np.diag(rest)[dof].mean()
    return out


def check(pressure: float, held: Array, least: float, expected: Array) -> None:
    """The tangent's motion and block are those of the expected matrix."""
    tangent = body().tangent(strained(), pressures(pressure), held, least)
    inverse, free = np.linalg.inv(expected), body().free
    force = np.random.default_rng(1).standard_normal((body().pad.n_nodes, 3))
    moved = tangent.motion(force).reshape(-1)
    wanted = inverse @ force.reshape(-1)[free]
    np.testing.assert_allclose(moved[free], wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())
    assert not moved.reshape(-1, 3)[np.asarray(body().bundle.mesh.bonded)].any()
    for nodes in (np.array([4, 0, 17]), np.array([7, 9])):
        dof = (3 * body().surface[nodes][:, None] + np.arange(3)).ravel()
        at = np.searchsorted(free, dof)
        block = tangent.block(nodes)
        scale = np.abs(inverse[at][:, at]).max()
        np.testing.assert_allclose(block, inverse[np.ix_(at, at)], atol=1e-8 * scale)
        assert tangent.block(nodes) is block


def definite(matrix: Array) -> bool:
    return bool(np.linalg.eigvalsh(matrix)[0] > 0)


@pytest.mark.parametrize("kind", ["none", "all"])
def test_a_definite_gel_needs_no_springs(kind: str) -> None:
    matrix = dense(pressures(0.0))
    assert definite(matrix)
    check(0.0, held_by(kind), 0.0, matrix)
    tangent = body().tangent(strained(), pressures(0.0), held_by(kind))
    assert (tangent.share, tangent.stiffened, tangent.springs.any()) == (0.0, False, False)


@pytest.mark.parametrize(("kind", "pressure", "least"), [("all", -0.05, 0.0), ("some", 0.0, 10.0),
                                                         ("all", -0.05, 100.0)])  # fmt: skip
def test_springs_hold_a_gel_that_would_buckle(kind: str, pressure: float, least: float) -> None:
    """The smallest share of the node's own stiffness at rest that makes it definite."""
    matrix, held = dense(pressures(pressure)), held_by(kind)
    share = next(s for s in SPRINGS if s >= least and definite(matrix + s * springs_of(held)))
    assert share > 0
    check(pressure, held, least, matrix + share * springs_of(held))
    tangent = body().tangent(strained(), pressures(pressure), held, least)
    assert (tangent.share, tangent.stiffened) == (share, False)
    diagonal = np.diag(compressible()).reshape(-1, 3).mean(axis=1)
    own = np.searchsorted(body().free // 3, body().surface, side="left") // 3
    np.testing.assert_allclose(tangent.springs, share * diagonal[own, None, None] * held)


@pytest.mark.parametrize("pressure", [-0.05, -0.1, 0.2])
def test_a_gel_that_springs_do_not_hold_is_stiffened(pressure: float) -> None:
    matrix = dense(pressures(pressure))
    share = next(s for s in STIFFENINGS if definite(matrix + s * compressible()))
    check(pressure, held_by("none"), 0.0, matrix + share * compressible())
    tangent = body().tangent(strained(), pressures(pressure), held_by("none"))
    assert (tangent.share, tangent.stiffened, tangent.springs.any()) == (SPRINGS[-1], True, False)


def test_a_gel_far_from_stable_is_refused() -> None:
    assert not definite(dense(pressures(-1.0)) + STIFFENINGS[-1] * compressible())
    with pytest.raises(ContactError, match="buckles"):
        body().tangent(strained(), pressures(-1.0), held_by("all"))


@pytest.mark.parametrize("cells", [(6, 3), (3, 6)])
def test_the_factor_goes_along_the_longer_side(cells: tuple[int, int]) -> None:
    """Its blocks are the rows across the pad, so that they are small."""
    mesh = PadMesh.from_occupancy(np.ones((*cells, 2), dtype=bool), (1, 1, 1), (0, 0, -2))
    pad = build_bundle(mesh, Material(0.147, 0.49, 1000.0), "bbar", with_stiffness=False)
    one = GelBody(pad)
    still, held = np.zeros((mesh.n_nodes, 3)), np.zeros((len(one.surface), 3, 3))
    tangent = one.tangent(still, np.zeros(len(mesh.hexes)), held)
    assert [len(row) for row in tangent.factor.rows] == [3 * 4 * 2] * 7
