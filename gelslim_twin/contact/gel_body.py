"""The whole gel at large strain, and its tangent stiffness at a state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_twin.contact.gel_state import ContactError
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.row_factor import LinAlgError, RowFactor
from ifem_export.elements.material import Material
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
SPRINGS = (0.0, 1.0, 10.0, 100.0)
"""Stiffness of the stabilising springs over that of the node in the undeformed gel."""
STIFFENINGS = (0.1, 0.3, 1.0, 3.0)
"""Shares of the undeformed gel's stiffness that are added where springs are not enough."""


@dataclass(frozen=True, eq=False)
class GelBody:
    """A neo-Hookean pad bonded at its lower face; fields (n, 3) over all its nodes.

    Raises MeshError for a crowned pad or one with cut cells.
    """

    bundle: Bundle

    @cached_property
    def pad(self) -> NeoHookeanPad:
        """The constitutive law."""
        return NeoHookeanPad(self.bundle.mesh, self.bundle.material)

    @cached_property
    def surface(self) -> Nodes:
        """(c,) nodes of the outer surface."""
        return np.asarray(self.bundle.mesh.surface, dtype=np.intp)

    @cached_property
    def free(self) -> Nodes:
        """Unknowns, 3 x node + axis, that are not bonded."""
        nodes = np.asarray(self.bundle.mesh.free, dtype=np.intp)
        return (3 * nodes[:, None] + np.arange(3)).ravel()

    @cached_property
    def _rows(self) -> NDArray[np.intp]:
        """Lattice row of each unknown, along the longer side."""
        numbering = self.bundle.mesh.numbering
        _, j, i = np.unravel_index(numbering.positions[self.free // 3], numbering.shape)
        return np.asarray(j if np.ptp(j) >= np.ptp(i) else i)

    @cached_property
    def _at_rest(self) -> sparse.csr_array:
        """Stiffness of an undeformed gel with the same shear modulus that is compressible.

        The tangent preserves the volume, and what is added to it must not counteract that.
        """
        shear = self.bundle.material.shear_modulus_mpa
        soft = Material(2.0 * shear, 0.0, self.bundle.material.density_kg_m3)
        whole = replace(self.pad, material=soft).tangent(np.zeros((self.pad.n_nodes, 3)))
        return sparse.csr_array(sparse.csr_array(whole)[self.free][:, self.free])

    @cached_property
    def _spring_n_mm(self) -> Array:
        """(c,) stiffness at rest of each surface node, the mean over its axes."""
        place = np.searchsorted(self.free, 3 * self.surface[:, None] + np.arange(3))
        return np.asarray(self._at_rest.diagonal()[place].mean(axis=1))

    def _scattered(self, springs: Array) -> sparse.csr_array:
        """Springs (c, 3, 3) of the surface nodes as a matrix over the unknowns."""
        on = np.flatnonzero(springs.any(axis=(1, 2)))
        own = np.searchsorted(self.free, 3 * self.surface[on, None] + np.arange(3))
        row, column = np.repeat(own, 3, axis=1).ravel(), np.tile(own, (1, 3)).ravel()
        shape = (len(self.free), len(self.free))
        return sparse.csr_array((springs[on].ravel(), (row, column)), shape=shape)

    def _tangent(self, whole_mm: Array, pressure_mpa: Array | None = None) -> sparse.csr_array:
        whole = sparse.csr_array(self.pad.tangent(whole_mm, pressure_mpa))
        return sparse.csr_array(whole[self.free][:, self.free])

    def tangent(
        self,
        whole_mm: Array,
        pressure_mpa: Array,
        held: Array,
        least: float = 0.0,
    ) -> Tangent:
        """Factored tangent stiffness at a displacement (n, 3) and cell pressures (m,).

        `held` (c, 3, 3) projects the motion of each surface node onto the directions in which the
        tool constrains it. A gel under large contact forces would buckle if the tool did not hold
        it, so its tangent is positive definite only with springs in these directions. The springs
        do not change the solution, since their forces vanish when Newton's method has converged.
        `least` is the smallest share tried. Raises ContactError, FiniteStrainError.
        """
        matrix = self._tangent(whole_mm, pressure_mpa)
        for share in SPRINGS:
            if share < least:
                continue
            springs = share * self._spring_n_mm[:, None, None] * held
            stiff = matrix if share == 0 else sparse.csr_array(matrix + self._scattered(springs))
            try:
                return Tangent(self, RowFactor.of(stiff, self._rows), springs, share)
            except LinAlgError:
                continue
        none = np.zeros_like(held)
        for share in STIFFENINGS:
            try:
                stiff = sparse.csr_array(matrix + share * self._at_rest)
                return Tangent(self, RowFactor.of(stiff, self._rows), none, SPRINGS[-1], True)
            except LinAlgError:
                continue
        raise ContactError("the gel buckles: its tangent stiffness is far from positive definite")


@dataclass(eq=False)
class Tangent:
    """A factored tangent stiffness."""

    body: GelBody
    factor: RowFactor
    springs: Array
    """Springs (c, 3, 3) in N/mm at the surface nodes."""
    share: float
    """Share of `SPRINGS` that was needed."""
    stiffened: bool = False
    """Whether stiffness was added, so that its steps are shorter than Newton's."""
    _nodes: Nodes = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    _block: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def motion(self, force_n: Array) -> Array:
        """Displacement (n, 3) under forces (n, 3); forces on bonded nodes have no effect."""
        found = np.zeros(force_n.size)
        found[self.body.free] = self.factor.solve(force_n.reshape(-1)[self.body.free])
        return found.reshape(-1, 3)

    def block(self, nodes: Nodes) -> Array:
        """Compliance (3m, 3m) among surface nodes `nodes` (m,), cached for the next call."""
        if not np.array_equal(nodes, self._nodes):
            own = (3 * self.body.surface[nodes][:, None] + np.arange(3)).ravel()
            self._nodes = nodes
            self._block = self.factor.compliance(np.searchsorted(self.body.free, own))
        return self._block
