"""Surface compliance C: columns that are computed when needed and stored in a file.

A column is the displacement of all c surface nodes under a force of 1 N along one axis on one node.
The columns are solved with one factorisation of the pad. Among nodes that are images of each other
in a symmetric pad, only one is solved; for a square pad that is an eighth.
"""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import SuperLU

from gelslim_core.files.replaced_file import replacement
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.row_factor import RowFactor
from ifem_export.compliance.table_size import require_room
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import factored
from ifem_export.operators.surface_operator import SurfaceOperator

if TYPE_CHECKING:
    from ifem_export.elements.skin import Membrane

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
BATCH = 64
FORMAT = "gelslim-compliance/3"
MOST_ROW = 1500
"""Unknowns per row of the lattice up to which dense blocks are faster than a sparse factor."""


class SurfaceCompliance:
    """Columns of a bundle's surface compliance, float32 mm/N, in memory and in `folder`.

    The file is `compliance-KEY.npy` with one row per column of C; a row whose own entry is zero is
    not computed yet. The file is memory-mapped, so that only the rows used are read. Without a
    folder nothing is stored. An instance must not be used by two threads at once.

    `skin` are membranes on the surface, whose stiffness adds to that of the pad.

    Raises MeshError for a pad whose table would not fit.
    """

    def __init__(
        self, bundle: Bundle, folder: Path | None = None, skin: tuple[Membrane, ...] = ()
    ) -> None:
        self.bundle = bundle
        self.skin = skin
        self.nodes = len(bundle.mesh.surface)
        require_room(self.nodes)
        self._folder = folder
        self._rows = self._loaded()
        own = np.arange(self.nodes)
        self._made: NDArray[np.bool_] = np.all(
            [self._rows[3 * own + axis, own, axis] > 0 for axis in range(3)], axis=0
        )
        self._fresh = False

    @cached_property
    def operator(self) -> SurfaceOperator:
        """The exact operator of the pad in its skin."""
        return self.bundle.surface_operator("factor", membranes=self.skin)

    @property
    def system(self) -> PadSystem:
        """Equations of the pad."""
        system: PadSystem = self.operator.system  # type: ignore[attr-defined]
        return system

    @property
    def _stiffness(self) -> sparse.csr_array:
        """Stiffness of the free nodes, with the skin."""
        return self.system.stiffness

    @cached_property
    def _factor(self) -> SuperLU | RowFactor:
        system = self.system
        if type(system) is not PadSystem:
            return factored(self._stiffness)
        places = np.asarray(system.lattice_positions)
        row = places[:, int(np.ptp(places[:, 1]) > np.ptp(places[:, 0]))]
        if 3 * system.layers * np.bincount(row - row.min()).max() > MOST_ROW:
            return factored(self._stiffness)
        return RowFactor.of(self._stiffness, np.repeat(np.tile(row, system.layers), 3))

    @cached_property
    def _symmetries(self) -> tuple[Symmetry, ...]:
        return symmetries(self.bundle.mesh)

    @cached_property
    def _originals(self) -> Nodes:
        """(c,) the node of lowest number among the images of each node."""
        images = np.stack([s.image for s in self._symmetries])
        return np.asarray(images.min(axis=0))

    @property
    def distinct(self) -> int:
        """Number of nodes that are no images of others, whose columns must be solved for."""
        return len(np.unique(self._originals))

    @property
    def key(self) -> str:
        """Hash of everything that the compliance depends on."""
        parts = (FORMAT, self.bundle.geometry_hash, repr(self.bundle.material),
                 self.bundle.formulation, *map(repr, self.skin))  # fmt: skip
        return hashlib.sha256("|".join(parts).encode()).hexdigest()[:16]

    def require(self, nodes: Nodes) -> None:
        """Compute the columns of these nodes, and of their images."""
        missing = np.asarray(nodes)[~self._made[nodes]]
        if len(missing) == 0:
            return
        self._fresh = True
        originals = self._filled(np.unique(self._originals[missing]))
        for first in range(0, len(originals), BATCH):
            part = originals[first : first + BATCH]
            self._rows.reshape(self.nodes, 3, self.nodes, 3)[part] = self._solved(part)
            self._made[part] = True
            for symmetry in self._symmetries[1:]:
                self._copy(part, symmetry)

    def _filled(self, wanted: Nodes) -> Nodes:
        """`wanted`, filled up to whole batches with nodes that are probably needed next."""
        room = -len(wanted) % BATCH
        unmade = np.flatnonzero(~self._made & (self._originals == np.arange(self.nodes)))
        others = np.setdiff1d(unmade, wanted)
        near = np.argsort(np.abs(others - np.median(wanted)), kind="stable")[:room]
        return np.sort(np.concatenate([wanted, others[near]]))

    def _copy(self, nodes: Nodes, symmetry: Symmetry) -> None:
        """Columns of the images of `nodes`: C(Pi, Pj) = Q C(i, j) Q'."""
        rows = self._rows.reshape(self.nodes, 3, self.nodes, 3)
        axes = np.abs(symmetry.turn).argmax(axis=1)
        signs = symmetry.turn[np.arange(3), axes].astype(np.float32)
        for node in nodes:
            image = symmetry.image[node]
            if self._made[image]:
                continue
            column = rows[node][axes][:, :, axes] * signs[:, None, None] * signs
            turned = np.empty_like(column)
            turned[:, symmetry.image] = column
            rows[image] = turned
            self._made[image] = True

    def block(self, nodes: Nodes, known: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """C among nodes (n,), (3n, 3n) in mm/N, symmetric.

        `known` is the block of the first of the nodes, which is not read again.
        """
        self.require(nodes)
        from ifem_export.compliance.columns_kernel import gather_block

        block = np.empty((3 * len(nodes), 3 * len(nodes)), dtype=np.float32)
        kept = 0 if known is None else len(known)
        if known is not None:
            block[:kept, :kept] = known
        rows = self._rows.reshape(self.nodes, 3, self.nodes, 3)
        gather_block(rows, np.asarray(nodes), block, kept // 3)
        return block

    def columns(self, nodes: Nodes) -> NDArray[np.float32]:
        """Displacement (n, 3, c, 3) of all nodes under 1 N along each axis on nodes (n,)."""
        self.require(nodes)
        return np.asarray(self._rows.reshape(self.nodes, 3, self.nodes, 3)[nodes])

    def displacement(self, nodes: Nodes, force_n: Array, known_mm: Array | None = None) -> Array:
        """Displacement (c, 3) under forces (n, 3) on `nodes` (n,).

        `known_mm` (n, 3) is the displacement of `nodes`, where it is known.
        """
        self.require(nodes)
        from ifem_export.compliance.columns_kernel import add_motion

        moved = np.zeros(3 * self.nodes)
        sought = np.ones(self.nodes + 2, dtype=bool)
        sought[0] = sought[-1] = False
        if known_mm is not None:
            sought[1 + np.asarray(nodes)] = False
        turns = 3 * np.flatnonzero(sought[1:] != sought[:-1])
        rows = self._rows.reshape(self.nodes, 3, 3 * self.nodes)
        force = np.ascontiguousarray(force_n, dtype=float)
        add_motion(rows, np.asarray(nodes), force, turns[::2], turns[1::2], moved)
        found = moved.reshape(-1, 3)
        if known_mm is not None:
            found[nodes] = known_mm
        return found

    def whole(self, force_n: Array) -> Array:
        """Displacement (c, 3) under forces (c, 3) on all nodes, by a solve."""
        if self.skin:
            load = np.zeros(self._stiffness.shape[0])
            load[-3 * self.nodes :] = np.ravel(force_n)
            return np.array(self._factor.solve(load)[-3 * self.nodes :]).reshape(-1, 3)
        return self.operator.displacement(force_n)

    def store(self) -> None:
        """Write new columns to the folder atomically, unless it is not writable."""
        if self._folder is None or not self._fresh:
            return
        # In a read-only or full folder the next run computes the columns again.
        with contextlib.suppress(OSError), replacement(self._path) as out:
            np.save(out, self._rows)
        self._fresh = False

    @property
    def _path(self) -> Path:
        assert self._folder is not None
        return self._folder / f"compliance-{self.key}.npy"

    def _loaded(self) -> NDArray[np.float32]:
        shape = (3 * self.nodes, self.nodes, 3)
        if self._folder is not None and self._path.is_file():
            try:
                # Copy on write: new columns are in the file only after `store`.
                held = np.load(self._path, mmap_mode="c", allow_pickle=False)
            except (OSError, ValueError, EOFError):
                held = np.zeros(0, dtype=np.float32)
            if held.shape == shape and held.dtype == np.float32:
                return np.asarray(held)
        return np.zeros(shape, dtype=np.float32)

    def _solved(self, nodes: Nodes) -> Array:
        """Columns (n, 3, c, 3)."""
        n, unknowns = len(nodes), self.system.stiffness.shape[0]
        first = unknowns - 3 * self.nodes
        # The number of right-hand sides is constant, because it affects the last bits: results
        # must not depend on which columns were requested before.
        loads = np.zeros((unknowns, 3 * BATCH))
        own = (3 * nodes[:, None] + np.arange(3)).ravel()
        loads[first + own, np.arange(3 * n)] = 1.0
        moved = np.asarray(self._factor.solve(loads))[first:, : 3 * n]
        return np.asarray(moved.T.reshape(n, 3, self.nodes, 3))


GRID = 1e-6
"""Positions closer than this share of a cell are the same."""


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A node's image (c,) among the surface nodes, and the axes' turn (3, 3): x' = Q x."""

    image: Nodes
    turn: Array


def symmetries(mesh: PadMesh) -> tuple[Symmetry, ...]:
    """Symmetries of a pad about the middle of its surface, the identity first.

    A pad with cut cells or a crown counts as having no others.
    """
    points = np.asarray(mesh.surface_mm)[:, :2]
    identity = Symmetry(np.arange(len(points)), np.eye(3))
    if mesh.fill is not None or mesh.surface_shift is not None:
        return (identity,)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    unit = GRID * min(mesh.cell_size_mm[:2])
    centres = np.asarray(mesh.nodes_mm)[np.asarray(mesh.hexes)].mean(axis=1) - [*middle, 0.0]
    found = [identity]
    for swapped in (False, True):
        for sx in (1.0, -1.0):
            for sy in (1.0, -1.0):
                turn = np.diag([sx, sy, 1.0])
                turn = turn[:, [1, 0, 2]] if swapped else turn
                if (turn == np.eye(3)).all() or _matched(centres, centres @ turn.T, unit) is None:
                    continue
                image = _matched(points - middle, (points - middle) @ turn[:2, :2].T, unit)
                if image is not None:
                    found.append(Symmetry(image, turn))
    return tuple(found)


def _matched(points: Array, images: Array, unit: float) -> Nodes | None:
    """Number of the point at each image; None where one has none."""
    sites, wanted = (np.rint(p / unit).astype(np.int64) for p in (points, images))
    # Rounding may fall on either side: compare sorted orders, then distances.
    order, other = (np.lexsort((s // 1000).T) for s in (sites + 500, wanted + 500))
    if np.abs(sites[order] - wanted[other]).max() > 2:
        return None
    found = np.empty(len(points), dtype=np.intp)
    found[other] = order
    return found
