"""Mirror images and quarter turns that leave a pad as it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
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
