"""The mesh node nearest to each marker, and the table of markers as CSV."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.layout import decimal
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

_CANDIDATES = 8
_SAME_MM = 1e-9
COLUMNS = (
    "marker_id",
    "row",
    "column",
    "x_mm",
    "y_mm",
    "diameter_mm",
    "kind",
    "node_id",
    "node_distance_mm",
)


@dataclass(frozen=True, eq=False)
class NearestNodes:
    """The surface node nearest to each marker: ids (m,) and distances in the surface (m,)."""

    node_id: NDArray[np.int64]
    distance_mm: NDArray[np.float64]


def nearest_nodes(
    positions_mm: NDArray[np.float64], nodes_mm: NDArray[np.float64], node_ids: NDArray[np.integer]
) -> NearestNodes:
    """Return the nearest of the surface nodes for each marker.

    `positions_mm` (m, 2), `nodes_mm` (n, 3) in the sensor frame (z is not used), `node_ids` (n,)
    names the nodes. Of nodes equally far the smallest id wins.
    """
    from scipy.spatial import cKDTree

    count = min(_CANDIDATES, len(nodes_mm))
    tree = cKDTree(nodes_mm[:, :2])
    distance, index = tree.query(positions_mm, k=list(range(1, count + 1)))
    tied = distance <= distance[:, :1] + _SAME_MM
    ids = node_ids.astype(np.int64)
    chosen = np.where(tied, ids[index], np.iinfo(np.int64).max).min(axis=1)
    return NearestNodes(node_id=chosen, distance_mm=distance[:, 0])


def render_csv(grid: MarkerGrid, nodes: NearestNodes) -> bytes:
    """Return one line per marker, in the order of the ids, under a header with units.

    Coordinates are in the sensor frame (x to the tip, y across, origin at the gel's centre);
    `kind` is `regular` or `anchor`.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for i in range(len(grid)):
        x, y = grid.positions_mm[i]
        writer.writerow(
            [
                i,
                int(grid.row[i]),
                int(grid.column[i]),
                decimal(x, 6),
                decimal(y, 6),
                decimal(grid.diameter_mm[i], 6),
                "anchor" if grid.kind[i] == ANCHOR_LARGE else "regular",
                int(nodes.node_id[i]),
                decimal(nodes.distance_mm[i], 6),
            ]
        )
    return text.getvalue().encode("ascii")
