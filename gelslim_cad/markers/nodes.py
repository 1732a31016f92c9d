"""The mesh node nearest to each marker, and the table of markers as CSV."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

    def __post_init__(self) -> None:
        if self.node_id.ndim != 1 or self.node_id.shape != self.distance_mm.shape:
            raise ValueError(
                f"nearest nodes: ids have shape {self.node_id.shape} and distances "
                f"{self.distance_mm.shape}; both must be (m,)"
            )


def nearest_nodes(
    positions_mm: ArrayLike, nodes_mm: ArrayLike, node_ids: ArrayLike | None = None
) -> NearestNodes:
    """Return the nearest of the surface nodes for each marker.

    `positions_mm` (m, 2), `nodes_mm` (n, 2) or (n, 3) in the sensor frame (z is not used),
    `node_ids` (n,) names the nodes, 0 to n-1 if left out. Of nodes equally far the smallest id
    wins. Raises ValueError for no nodes or lengths that disagree.
    """
    from scipy.spatial import cKDTree

    markers = np.asarray(positions_mm, dtype=np.float64)
    nodes = np.asarray(nodes_mm, dtype=np.float64)
    if nodes.ndim != 2 or len(nodes) == 0 or nodes.shape[1] not in (2, 3):
        raise ValueError(f"nearest nodes: nodes have shape {nodes.shape}; expected (n, 2 or 3)")
    ids = np.arange(len(nodes)) if node_ids is None else np.asarray(node_ids, dtype=np.int64)
    if ids.shape != (len(nodes),):
        raise ValueError(f"nearest nodes: {len(nodes)} nodes but ids of shape {ids.shape}")
    count = min(_CANDIDATES, len(nodes))
    distance, index = cKDTree(nodes[:, :2]).query(markers, k=list(range(1, count + 1)))
    tied = distance <= distance[:, :1] + _SAME_MM
    chosen = np.where(tied, ids[index], np.iinfo(np.int64).max).min(axis=1)
    return NearestNodes(node_id=chosen, distance_mm=distance[:, 0])


def render_csv(grid: MarkerGrid, nodes: NearestNodes) -> bytes:
    """Return one line per marker, in the order of the ids, under a header with units.

    Coordinates are in the sensor frame (x to the tip, y across, origin at the gel's centre);
    `kind` is `regular` or `anchor`. Raises ValueError when there is not one node per marker.
    """
    if len(nodes.node_id) != len(grid):
        raise ValueError(f"{len(grid)} markers but {len(nodes.node_id)} nearest nodes")
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
