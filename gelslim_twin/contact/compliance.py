"""How the surface moves under forces on some of its nodes: columns of C, made once and kept.

A column holds the displacement of all c surface nodes under 1 N along one axis on one node. They
are made when a contact first needs them, with one factor of the pad, and a file keeps them.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ifem_export.bundle import Bundle
from ifem_export.sparse_factor import Factor, factored
from ifem_export.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
BATCH = 24
FORMAT = "gelslim-compliance/1"


class SurfaceCompliance:
    """Columns of a bundle's surface compliance, float32 mm/N, in memory and in `folder`.

    The file is `compliance-KEY.npy` with as many rows as there are columns of C; a row that is
    all zero is not made yet. Without a folder nothing is kept. Not for two threads at once.
    """

    def __init__(self, bundle: Bundle, folder: Path | None = None) -> None:
        self.bundle = bundle
        self.nodes = len(bundle.mesh.surface)
        self._folder = folder
        self._rows = self._loaded()
        self._made: NDArray[np.bool_] = np.any(self._rows.reshape(3 * self.nodes, -1) != 0, axis=1)
        self._fresh = False

    @cached_property
    def _operator(self) -> SurfaceOperator:
        return self.bundle.surface_operator("factor")

    @cached_property
    def _factor(self) -> Factor | None:
        system = getattr(self._operator, "system", None)
        stiffness = getattr(system, "stiffness", None)
        layered = stiffness is not None and getattr(system, "columns", 0) == self.nodes
        return factored(stiffness) if layered else None

    @property
    def key(self) -> str:
        """Tells one pad's compliance from another's."""
        parts = (FORMAT, self.bundle.geometry_hash, repr(self.bundle.material),
                 self.bundle.formulation)  # fmt: skip
        return hashlib.sha256("|".join(parts).encode()).hexdigest()[:16]

    def require(self, nodes: Nodes) -> None:
        """Make the columns of these nodes."""
        missing = np.asarray(nodes)[~self._made[3 * np.asarray(nodes)]]
        for first in range(0, len(missing), BATCH):
            self._make(missing[first : first + BATCH])

    def block(self, nodes: Nodes) -> Array:
        """C among nodes (n,), (3n, 3n) in mm/N, symmetric."""
        self.require(nodes)
        from gelslim_twin.contact.compliance_kernel import gather_block

        block = np.empty((3 * len(nodes), 3 * len(nodes)))
        gather_block(self._rows.reshape(self.nodes, 3, self.nodes, 3), np.asarray(nodes), block)
        return block

    def displacement(self, nodes: Nodes, force_n: Array) -> Array:
        """Motion (c, 3) under forces (n, 3) on `nodes` (n,)."""
        self.require(nodes)
        from gelslim_twin.contact.compliance_kernel import add_motion

        moved = np.zeros(3 * self.nodes)
        rows = self._rows.reshape(self.nodes, 3, 3 * self.nodes)
        add_motion(rows, np.asarray(nodes), np.ascontiguousarray(force_n, dtype=float), moved)
        return moved.reshape(-1, 3)

    def whole(self, force_n: Array) -> Array:
        """Motion (c, 3) under forces (c, 3) on any nodes, solved."""
        return self._operator.displacement(force_n)

    def store(self) -> None:
        """Write new columns to the folder, whole or not at all."""
        if self._folder is None or not self._fresh:
            return
        target = self._path
        handle, part = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as out:
                np.save(out, self._rows)
            os.replace(part, target)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
        self._fresh = False

    @property
    def _path(self) -> Path:
        assert self._folder is not None
        return self._folder / f"compliance-{self.key}.npy"

    def _loaded(self) -> NDArray[np.float32]:
        shape = (3 * self.nodes, self.nodes, 3)
        if self._folder is not None and self._path.is_file():
            try:
                held = np.load(self._path, allow_pickle=False)
            except (OSError, ValueError, EOFError):
                held = np.zeros(0, dtype=np.float32)
            if held.shape == shape and held.dtype == np.float32 and np.isfinite(held).all():
                return held
        return np.zeros(shape, dtype=np.float32)

    def _make(self, nodes: Nodes) -> None:
        self._fresh = True
        for axis in range(3):
            self._rows[3 * nodes + axis] = self._solved(nodes, axis)
        self._made[(3 * nodes[:, None] + np.arange(3)).ravel()] = True

    def _solved(self, nodes: Nodes, axis: int) -> Array:
        """Displacements (n, c, 3) under 1 N along an axis on each node."""
        if self._factor is None:
            return np.stack([self._one(node, axis) for node in nodes])
        unknowns = 3 * self.nodes * self.bundle.mesh.layers
        first = unknowns - 3 * self.nodes
        loads = np.zeros((unknowns, len(nodes)))
        loads[first + 3 * nodes + axis, np.arange(len(nodes))] = 1.0
        moved = np.asarray(self._factor.solve(loads))[first:]
        return np.asarray(moved.T.reshape(len(nodes), self.nodes, 3))

    def _one(self, node: int, axis: int) -> Array:
        force = np.zeros((self.nodes, 3))
        force[node, axis] = 1.0
        return self._operator.displacement(force)
