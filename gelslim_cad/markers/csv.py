"""The table of markers as CSV."""

from __future__ import annotations

import csv
import io

from gelslim_cad.markers.nodes import NearestNodes
from gelslim_cad.markers.number import decimal
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

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
