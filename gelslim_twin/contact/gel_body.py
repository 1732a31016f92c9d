"""The whole gel at large strain, and how it answers small changes about a state."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.contact.row_factor import LinAlgError, RowFactor
from ifem_export.bundle.bundle import Bundle
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
SPRINGS = (0.0, 0.3, 3.0)
"""Shares of the touched nodes' own stiffness at rest that hold them."""
STIFFENINGS = (0.1, 0.3, 1.0, 3.0)
"""Shares of the whole stiffness at rest that are added where springs do not do."""


@dataclass(frozen=True, eq=False)
class GelBody:
    """A neo-Hookean pad bonded at its lower face; fields (n, 3) over all its nodes.

    Raises MeshError for a crowned pad or one with cut cells.
    """

    bundle: Bundle

    @cached_property
    def pad(self) -> NeoHookeanPad:
        """The law."""
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
        return self._tangent(np.zeros((self.bundle.mesh.n_nodes, 3)))

    def _tangent(self, whole_mm: Array, pressure_mpa: Array | None = None) -> sparse.csr_array:
        whole = sparse.csr_array(self.pad.tangent(whole_mm, pressure_mpa))
        return sparse.csr_array(whole[self.free][:, self.free])

    def tangent(
        self,
        whole_mm: Array,
        pressure_mpa: Array,
        touched: NDArray[np.bool_],
        least: float = 0.0,
    ) -> Tangent:
        """The gel about a displacement (n, 3), its `touched` (c,) surface nodes held by springs.

        For the pressure of its cells (m,) see `NeoHookeanPad.tangent`.

        Pressed hard, the gel would buckle away from under the forces of nodes that a rigid tool
        holds in place: the tangent is positive definite with springs there only. They do not
        change where Newton's steps end, as they pull nowhere once nothing moves. `least` is the
        smallest share tried; raises ContactError, FiniteStrainError.
        """
        matrix = self._tangent(whole_mm, pressure_mpa)
        own = (3 * self.surface[touched][:, None] + np.arange(3)).ravel()
        place = np.searchsorted(self.free, own)
        for share in SPRINGS:
            if share < least:
                continue
            springs = np.zeros(len(self.free))
            springs[place] = share * self._at_rest.diagonal()[place]
            try:
                stiff = (
                    matrix if share == 0 else sparse.csr_array(matrix + sparse.diags_array(springs))
                )
                whole = np.zeros(3 * self.bundle.mesh.n_nodes)
                whole[self.free] = springs
                held = whole.reshape(-1, 3)[self.surface]
                return Tangent(self, RowFactor.of(stiff, self._rows), held, share)
            except LinAlgError:
                continue
        none = np.zeros((len(self.surface), 3))
        for share in STIFFENINGS:
            try:
                stiff = sparse.csr_array(matrix + share * self._at_rest)
                return Tangent(self, RowFactor.of(stiff, self._rows), none, SPRINGS[-1])
            except LinAlgError:
                continue
        raise ContactError("the gel buckles: its tangent stiffness is far from positive definite")


@dataclass(eq=False)
class Tangent:
    """A factored tangent."""

    body: GelBody
    factor: RowFactor
    springs: Array
    """(c, 3) in N/mm along the axes of the surface nodes."""
    share: float
    """Of `SPRINGS`."""
    _nodes: Nodes = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    _block: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def motion(self, force_n: Array) -> Array:
        """Displacement (n, 3) under forces (n, 3); those on bonded nodes do nothing."""
        found = np.zeros(force_n.size)
        found[self.body.free] = self.factor.solve(force_n.reshape(-1)[self.body.free])
        return found.reshape(-1, 3)

    def block(self, nodes: Nodes) -> Array:
        """Compliance (3m, 3m) among places `nodes` (m,) of the surface; kept for the next call."""
        if not np.array_equal(nodes, self._nodes):
            own = (3 * self.body.surface[nodes][:, None] + np.arange(3)).ravel()
            self._nodes = nodes
            self._block = self.factor.compliance(np.searchsorted(self.body.free, own))
        return self._block
