"""What a bundle says of its sensor as designed: camera, print, heights of the markers at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.errors import IfemError
from ifem_export.markers.grid import LABELS, MarkerGrid
from ifem_export.markers.interpolation import marker_to_node

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle


def bundle_camera(bundle: Bundle) -> VirtualCamera:
    """Return the virtual camera of the design. Raises IfemError where the bundle has none."""
    if not bundle.camera:
        raise IfemError("the bundle has no camera: rebuild it with `gelslim bundle SPEC -o BUNDLE`")
    try:
        return VirtualCamera.from_record(bundle.camera)
    except ValueError as error:
        raise IfemError(f"the bundle's camera cannot be used: {error}") from error


def marker_heights_mm(bundle: Bundle) -> NDArray[np.float64]:
    """Heights (k,) of the bundle's markers at rest, bilinear in its surface nodes.

    They are zero on a flat gel and fall away from the apex of a crowned one.
    Raises IfemError for a bundle without markers.
    """
    if bundle.markers is None:
        raise IfemError("the bundle has no markers: rebuild it with marker positions")
    surface = np.asarray(bundle.mesh.surface_mm)
    positions = np.asarray(bundle.markers.positions_mm, dtype=float)
    if not np.ptp(surface[:, 2]) > 0:
        return np.zeros(len(positions))
    return np.asarray(marker_to_node(surface, positions) @ surface[:, 2])


def bundle_grid(bundle: Bundle) -> MarkerGrid:
    """Return the print of a bundle, with the markers in the order of the bundle.

    A bundle lists dots only. Pitch and extent of the lattice follow from their positions, and the
    sites that are omitted on purpose are those without a dot inside the convex hull of the dots.
    The lattice of an imported sensor is as the bundle states it.
    Raises IfemError if the bundle has no markers, or if they form no lattice.
    """
    field = bundle.markers
    if field is None:
        raise IfemError("the bundle has no markers: rebuild it from a spec with a marker print")
    absent = [name for name in LABELS if name not in field.arrays]
    if absent:
        raise IfemError(
            f"the bundle's markers have no {', '.join(absent)}: rebuild it with "
            "`gelslim bundle SPEC -o BUNDLE`"
        )
    positions = np.asarray(field.positions_mm, dtype=float)[:, :2]
    sites = np.column_stack([field.arrays["row"], field.arrays["column"]]).astype(np.int64)
    frame = None if bundle.imported is None else bundle.imported.lattice
    if frame is None:
        pitch = _pitch_mm(positions, sites)
        # The lattice is centred on the origin: site 0 is (count - 1) / 2 pitches below it.
        counts = 2 * np.mean(sites - positions / pitch, axis=0) + 1
        rows, columns = (int(n) for n in np.rint(counts))
    else:
        pitch = float(np.mean(frame.pitches_mm))
        rows, columns = (int(n) + 1 for n in sites.max(axis=0))
    try:
        return MarkerGrid(
            positions_mm=positions,
            row=sites[:, 0],
            column=sites[:, 1],
            diameter_mm=field.arrays["diameter_mm"],
            kind=field.arrays["kind"],
            pitch_mm=pitch,
            lattice_shape=(rows, columns),
            omitted=_omitted_sites(sites, (rows, columns)),
            frame=frame,
        )
    except ValueError as error:
        raise IfemError(f"the markers of the bundle are not a printed lattice: {error}") from error


def _pitch_mm(positions_mm: NDArray[np.float64], sites: NDArray[np.int64]) -> float:
    apart = sites - sites.mean(axis=0)
    spread = float((apart**2).sum())
    if spread == 0:
        raise IfemError("the bundle has a single marker, which makes no lattice")
    return float((apart * (positions_mm - positions_mm.mean(axis=0))).sum() / spread)


def _omitted_sites(sites: NDArray[np.int64], shape: tuple[int, int]) -> NDArray[np.int64]:
    """Sites (k, 2) without a dot within the convex hull of the dots, row by row.

    Dots that the outline of the gel cuts off lie outside the hull.
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
        raise IfemError(
            "the markers of the bundle are on one line, which makes no lattice"
        ) from error
    beyond = empty @ hull.equations[:, :2].T + hull.equations[:, 2]
    omitted: NDArray[np.int64] = empty[np.all(beyond <= 1e-9, axis=1)]
    return omitted
