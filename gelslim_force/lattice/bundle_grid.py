"""The printed marker lattice, as a bundle's marker arrays tell it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import IfemError
from ifem_export.markers.grid import MarkerGrid

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

_ARRAYS = ("row", "column", "diameter_mm", "kind")


def bundle_grid(bundle: Bundle) -> MarkerGrid:
    """Return the print of a bundle; marker ids are the bundle's marker indices.

    A bundle lists dots only: pitch and extent of the lattice follow from the positions, and the
    sites left out on purpose are those without a dot inside the dots' convex hull.
    Raises IfemError for a bundle without markers, or whose markers form no square lattice.
    """
    field = bundle.markers
    if field is None:
        raise IfemError("the bundle has no markers: rebuild it from a spec with a marker print")
    absent = [name for name in _ARRAYS if name not in field.arrays]
    if absent:
        raise IfemError(
            f"the bundle's markers have no {', '.join(absent)}: rebuild it with "
            "`gelslim bundle SPEC -o BUNDLE`"
        )
    places = np.asarray(field.positions_mm, dtype=float)[:, :2]
    sites = np.column_stack([field.arrays["row"], field.arrays["column"]]).astype(np.int64)
    pitch = _pitch_mm(places, sites)
    # The lattice is centred on the origin: site 0 lies (count - 1) / 2 pitches below it.
    counts = 2 * np.mean(sites - places / pitch, axis=0) + 1
    rows, columns = (int(n) for n in np.rint(counts))
    try:
        return MarkerGrid(
            positions_mm=places,
            row=sites[:, 0],
            column=sites[:, 1],
            diameter_mm=field.arrays["diameter_mm"],
            kind=field.arrays["kind"],
            pitch_mm=pitch,
            lattice_shape=(rows, columns),
            omitted=_left_out(sites, (rows, columns)),
        )
    except ValueError as error:
        raise IfemError(f"the bundle's markers are no printed lattice: {error}") from error


def _pitch_mm(places_mm: NDArray[np.float64], sites: NDArray[np.int64]) -> float:
    apart = sites - sites.mean(axis=0)
    spread = float((apart**2).sum())
    if spread == 0:
        raise IfemError("the bundle has a single marker: a lattice needs neighbours")
    return float((apart * (places_mm - places_mm.mean(axis=0))).sum() / spread)


def _left_out(sites: NDArray[np.int64], shape: tuple[int, int]) -> NDArray[np.int64]:
    """Sites (k, 2) without a dot within the dots' convex hull, row-major.

    Dots clipped by the gel's outline lie outside the hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    used = np.zeros(shape, dtype=bool)
    inside = np.all((sites >= 0) & (sites < np.array(shape)), axis=1)
    used[tuple(sites[inside].T)] = True
    empty = np.argwhere(~used)
    if not len(empty):
        return empty
    try:
        hull = ConvexHull(sites.astype(float))
    except QhullError as error:
        raise IfemError("the bundle's markers stand in one line: no lattice to register") from error
    beyond = empty @ hull.equations[:, :2].T + hull.equations[:, 2]
    left_out: NDArray[np.int64] = empty[np.all(beyond <= 1e-9, axis=1)]
    return left_out
