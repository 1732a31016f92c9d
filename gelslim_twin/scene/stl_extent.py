"""The size of an STL file, read without a mesh library."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MAX_BYTES = 500_000_000
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_corners(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Corners of the facets, (n, 3, 3) in the file's unit, from binary or ASCII STL.

    Raises ValueError for a file that is no STL or holds no facets, OSError where unreadable.
    """
    size = os.path.getsize(path)
    if size > MAX_BYTES:
        raise ValueError(f"is larger than {MAX_BYTES / 1e6:.0f} MB")
    data = Path(path).read_bytes()
    count = int.from_bytes(data[80:84], "little") if size >= 84 else -1
    if size == 84 + 50 * count:
        corners = np.frombuffer(data, _FACET, count, 84)["corners"].astype(float)
    else:
        corners = _ascii_corners(data)
    if len(corners) == 0:
        raise ValueError("holds no facets")
    if not np.isfinite(corners).all():
        raise ValueError("holds a corner that is not finite")
    return corners


def _ascii_corners(data: bytes) -> NDArray[np.float64]:
    lines = data.split(b"\n")
    if not lines[0].lstrip().lower().startswith(b"solid"):
        raise ValueError("is no STL file: neither its size nor its first word fits")
    words = [line.split() for line in lines if line.lstrip().lower().startswith(b"vertex")]
    try:
        values = np.array([[float(w) for w in row[1:4]] for row in words])
        return values.reshape(-1, 3, 3)
    except ValueError:
        raise ValueError("is no STL file: its vertices are not threes of three numbers") from None


def footprint_mm(path: str | os.PathLike[str], down: str, scale: float) -> tuple[float, float]:
    """Extents in mm across the direction `down` ("z", "-x", ...). Raises as `stl_corners`."""
    corners = stl_corners(path).reshape(-1, 3) * scale
    extents = np.ptp(corners, axis=0)
    a, b = (extents[i] for i in range(3) if i != "xyz".index(down[-1]))
    return float(a), float(b)
