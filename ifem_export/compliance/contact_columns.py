"""The surface compliance as fits of contact forces use it: columns of the nodes in contact."""

from __future__ import annotations

from functools import cached_property
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.table_size import require_room, table_bytes
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.mesh.surface_lattice import edge_distance_mm
from ifem_export.operators.pad_system import PadSystem

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


EDGE_THICKNESSES = 1.5
"""Distance from the edge, in thicknesses, within which the infinite pad's forces of a fitted
contact err by more than a hundredth of the field."""
FEW = 512
"""Number of nodes whose columns are solved for in some seconds."""
_SHARED: WeakValueDictionary[int, ContactCompliance] = WeakValueDictionary()


class ContactCompliance:
    """Surface operator of a bundle whose compliance is known by columns, exact up to the edge.

    A step of a fit multiplies by the products of the columns in contact and solves nothing. Columns
    are computed when they are needed first, and kept, as are the products of the last contact.

    Args:
        bundle: The sensor.

    Attributes:
        bundle: As given.
        name: Name of the operator.

    Raises:
        MeshError: The pad has too many surface nodes.
    """

    name = "columns"

    def __init__(self, bundle: Bundle) -> None:
        require_room(len(bundle.mesh.surface))
        self.bundle = bundle
        self._last = np.zeros(0, dtype=np.intp), np.zeros((0, 0))

    @classmethod
    def shared(cls, bundle: Bundle) -> ContactCompliance:
        """The compliance of a bundle that others use too. Raises MeshError as the constructor."""
        found = _SHARED.get(id(bundle))
        if found is None or found.bundle is not bundle:
            found = _SHARED[id(bundle)] = cls(bundle)
        return found

    @cached_property
    def near_edge(self) -> NDArray[np.bool_]:
        """(c,) nodes within `EDGE_THICKNESSES` of the edge."""
        return near_edge(self.bundle.mesh)

    @cached_property
    def ahead(self) -> NDArray[np.bool_]:
        """(c,) nodes whose columns contacts near the edge need.

        These are all where symmetry leaves few to solve for, else those within twice the distance
        of `near_edge`: a contact that reaches farther waits for its columns once.
        """
        if self.compliance.distinct <= FEW:
            return np.ones(self.compliance.nodes, dtype=bool)
        return near_edge(self.bundle.mesh, 2 * EDGE_THICKNESSES)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """The columns."""
        return SurfaceCompliance(self.bundle, skin=self.bundle.membranes)

    @property
    def system(self) -> PadSystem:
        """Equations of the pad."""
        return self.compliance.system

    def prepare(self) -> None:
        """Compute the columns of the nodes `ahead` now."""
        self.compliance.require(np.flatnonzero(self.ahead))

    def contact_products(self, nodes: Nodes) -> tuple[NDArray[np.float32], Array]:
        """Columns (3n, 3c) of nodes (n,) and their products CᵀC (3n, 3n), in mm/N and mm²/N²."""
        columns = self.compliance.columns(nodes).reshape(3 * len(nodes), -1)
        before, kept = self._last
        products = np.empty((3 * len(nodes), 3 * len(nodes)))
        _, old, again = np.intersect1d(before, nodes, return_indices=True)
        sources, places = (np.ravel(3 * k[:, None] + np.arange(3)) for k in (old, again))
        products[np.ix_(places, places)] = kept[np.ix_(sources, sources)]
        new = np.setdiff1d(np.arange(len(columns)), places)
        fresh = columns[new] @ columns.T
        products[new], products[:, new] = fresh, fresh.T
        self._last = np.array(nodes), products
        return columns, products

    def displacement(self, force_n: ArrayLike) -> Array:
        """Displacement (c, 3) in mm under forces (c, 3) in N on all nodes, by a solve."""
        return self.compliance.whole(np.asarray(force_n, dtype=float))

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces (c, 3) in N of a motion (c, 3) in mm, by exact condensation."""
        return self.compliance.operator.force(displacement_mm)

    @property
    def n_bytes(self) -> int:
        """Bytes of all columns."""
        return table_bytes(self.compliance.nodes)


def near_edge(mesh: PadMesh, thicknesses: float = EDGE_THICKNESSES) -> NDArray[np.bool_]:
    """(c,) surface nodes of a pad within some of its thicknesses of its edge."""
    thickness_mm = mesh.layers * mesh.cell_size_mm[2]
    distance_mm = edge_distance_mm(np.asarray(mesh.surface_mm), mesh.cell_size_mm[:2])
    return np.asarray(distance_mm < thicknesses * thickness_mm)
