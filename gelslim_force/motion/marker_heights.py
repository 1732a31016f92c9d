"""Height of the gel at the markers: zero on a flat gel, falling away from a crown's apex."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ifem_export.markers.interpolation import marker_to_node

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle


def marker_heights_mm(bundle: Bundle) -> NDArray[np.float64]:
    """Heights (k,) of the bundle's markers at rest, bilinear in its surface nodes.

    Raises IfemError for a bundle without markers.
    """
    from ifem_export.errors import IfemError

    if bundle.markers is None:
        raise IfemError("the bundle has no markers: rebuild it with marker positions")
    surface = np.asarray(bundle.mesh.surface_mm)
    places = np.asarray(bundle.markers.positions_mm, dtype=float)
    if not np.ptp(surface[:, 2]) > 0:
        return np.zeros(len(places))
    return np.asarray(marker_to_node(surface, places) @ surface[:, 2])
