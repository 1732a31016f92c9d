"""A bezel over its shims with quadratic hexahedra of scikit-fem: the reference of the frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bezel:
    """Half of a bezel, y >= 0. Lengths in mm, E in MPa, foundation in MPa/mm."""

    start_x: float
    end_x: float
    half_width: float
    open_x: tuple[float, float]
    open_half_width: float
    thickness: float
    youngs: float
    poisson: float
    strips: tuple[tuple[float, float], ...]
    strip_half_width: float
    foundation: float
    screws: tuple[tuple[float, float], ...]
    ring: float


@dataclass(frozen=True)
class Found:
    """Per mm of compression under a rigid bezel."""

    least: float
    mean: float
    bow: float
    force_n: float


def lines(marks: Iterable[float], step: float) -> Array:
    """Mesh lines through all marks, no further apart than a step."""
    ends = sorted({round(m, 9) for m in marks})
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / step))) + 1)[:-1] for a, b in pairwise(ends)
    ]
    return np.concatenate([*parts, [ends[-1]]])


def mesh_of(b: Bezel, step: float, layers: int) -> Any:
    import skfem

    x = [b.start_x, b.end_x, *b.open_x, *(e for strip in b.strips for e in strip)]
    y = [0.0, b.half_width, b.open_half_width, b.strip_half_width]
    for sx, sy in b.screws:
        x += [sx - b.ring, sx, sx + b.ring]
        y += [sy - b.ring, sy, sy + b.ring]
    mesh = skfem.MeshHex.init_tensor(
        lines(x, step), lines(y, step), np.linspace(0, b.thickness, layers + 1)
    )
    middle = mesh.p[:, mesh.t].mean(axis=1)
    opening = (
        (middle[0] > b.open_x[0]) & (middle[0] < b.open_x[1]) & (middle[1] < b.open_half_width)
    )
    return mesh.remove_elements(np.flatnonzero(opening))


def solve_bezel(b: Bezel, *, step: float = 2.0, layers: int = 1) -> Found:
    """Solve the half bezel, held in z where the cone of each screw's head fills it."""
    import skfem
    from skfem.helpers import ddot, eye, sym_grad, trace

    mesh = mesh_of(b, step, layers)
    element = skfem.ElementVector(skfem.ElementHex2())
    basis = skfem.Basis(mesh, element, intorder=4)
    shear = b.youngs / (2 * (1 + b.poisson))
    bulk = b.youngs * b.poisson / ((1 + b.poisson) * (1 - 2 * b.poisson))

    @skfem.BilinearForm
    def elastic(u: Any, v: Any, _: Any) -> Any:
        strain = sym_grad(u)
        return ddot(2 * shear * strain + bulk * eye(trace(strain), 3), sym_grad(v))

    def pressed(x: Array) -> NDArray[np.bool_]:
        under = np.zeros(x.shape[1], dtype=bool)
        for low, high in b.strips:
            under |= (x[0] > low) & (x[0] < high)
        return under & (x[1] < b.strip_half_width) & (np.abs(x[2]) < 1e-9)

    facets = mesh.facets_satisfying(pressed, boundaries_only=True)
    face = skfem.FacetBasis(mesh, element, facets=facets, intorder=4)
    springs = skfem.BilinearForm(lambda u, v, _: b.foundation * u[2] * v[2]).assemble(face)
    load = skfem.LinearForm(lambda v, _: b.foundation * v[2]).assemble(face)
    stiffness = elastic.assemble(basis) + springs
    where = basis.doflocs
    component = np.zeros(basis.N, dtype=int)
    for k in range(3):
        component[_component(basis, k)] = k
    held = (component == 1) & (np.abs(where[1]) < 1e-9)
    for sx, sy in b.screws:
        near = np.hypot(where[0] - sx, where[1] - sy) <= b.ring * 1.001
        held |= near & (component == 2)
        axis = np.hypot(where[0] - sx, where[1] - sy) < 1e-6
        held |= axis & (component == 0) & (np.abs(where[2]) < 1e-9)
    u = skfem.solve(*skfem.condense(stiffness, load, D=np.flatnonzero(held)))
    lifted = face.interpolate(u)[2]
    area = float(np.sum(face.dx))
    mean = 1 - float(np.sum(lifted * face.dx)) / area
    vertical = u[component == 2]
    return Found(
        least=1 - float(lifted.max()),
        mean=mean,
        bow=float(np.abs(vertical).max()),
        force_n=2 * b.foundation * area * mean,
    )


def _component(basis: Any, k: int) -> NDArray[np.int64]:
    """Degrees of freedom of one component of a vector element, vertices to interiors."""
    return np.concatenate(
        [
            np.asarray(table[k::3]).ravel()
            for table in (
                basis.nodal_dofs,
                basis.edge_dofs,
                basis.facet_dofs,
                basis.interior_dofs,
            )
            if len(table)
        ]
    )
