"""Reading the surface of a body from a mesh file, and proving that it is closed."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.mesh_file import KINDS, mesh_corners
from gelslim_twin.stepping.step_error import StepError

Array = NDArray[np.float64]
SHOWN = 3


def read_closed_mesh(path: str | os.PathLike[str], scale: float = 1.0) -> Array:
    """Read the facets of a closed surface.

    Args:
        path: STL, OBJ or PLY file.
        scale: Millimetres per unit of the file.

    Returns:
        Corners (n, 3, 3) in mm.

    Raises:
        StepError: The file cannot be read, the scale is not above 0, the surface has
            an open edge, or its facets point inwards.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise StepError(f"scale = {scale}: must be above 0, in millimetres per unit of the file")
    try:
        corners = mesh_corners(path) * scale
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise StepError(f"{os.fspath(path)}: {reason}; name {KINDS}") from None
    except ValueError as error:
        raise StepError(f"{os.fspath(path)}: {error}; name {KINDS}") from None
    try:
        require_closed(corners)
    except StepError as error:
        raise StepError(f"{os.fspath(path)}: {error}") from None
    return corners


def require_closed(corners: Array) -> None:
    """Raise StepError unless facets (n, 3, 3) are the outside of a closed body.

    Every edge must be passed once in each direction (or equally often where bodies touch), and the
    enclosed volume must be positive.
    """
    _, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    facets = number.reshape(-1, 3)
    starts = facets.ravel()
    ends = facets[:, [1, 2, 0]].ravel()
    real = starts != ends
    starts, ends = starts[real], ends[real]
    edge = np.column_stack([np.minimum(starts, ends), np.maximum(starts, ends)])
    _, first, of = np.unique(edge, axis=0, return_index=True, return_inverse=True)
    balance = np.bincount(of.ravel(), np.where(starts < ends, 1.0, -1.0))
    unmatched = np.flatnonzero(balance != 0)
    if len(unmatched):
        points = corners.reshape(-1, 3)
        at = [np.flatnonzero(number.ravel() == starts[first[k]])[0] for k in unmatched[:SHOWN]]
        places = ", ".join(str(tuple(float(f"{v:.4g}") for v in points[k])) for k in at)
        raise StepError(
            f"the mesh is not closed: {len(unmatched)} edges have a facet on one side only or "
            f"facets of opposite directions, for example at {places} mm; repair the mesh"
        )
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    volume = float((a * np.cross(b, c)).sum() / 6)
    if volume <= 0:
        raise StepError(
            f"the mesh encloses {volume:.3g} mm³: its facets point inwards; reverse their order"
        )
