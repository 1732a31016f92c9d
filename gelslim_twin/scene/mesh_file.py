"""Facets of a mesh from an STL, OBJ or PLY file.

STL files are read without a mesh library, because a scene is planned from their extents alone.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KINDS = "an STL, OBJ or PLY file"
MAX_BYTES = 500_000_000
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_BY_TRIMESH = (".obj", ".ply")


def mesh_corners(path: str | os.PathLike[str]) -> Array:
    """Read the facets of a mesh; a file that does not end in .obj or .ply is read as STL.

    Args:
        path: The file. Polygons of OBJ and PLY are divided into triangles, and several objects
            become one mesh.

    Returns:
        Corners (n, 3, 3) in the file's unit.

    Raises:
        ValueError: The file is damaged, is larger than 500 MB, or holds no facets.
        OSError: It cannot be read.
    """
    size = os.path.getsize(path)
    if size > MAX_BYTES:
        raise ValueError(f"is larger than {MAX_BYTES / 1e6:.0f} MB")
    suffix = Path(path).suffix.lower()
    corners = _by_trimesh(path, suffix[1:]) if suffix in _BY_TRIMESH else _stl(path, size)
    if len(corners) == 0:
        raise ValueError("holds no facets")
    if not np.isfinite(corners).all():
        raise ValueError("holds a corner that is not finite")
    return corners


def footprint_mm(path: str | os.PathLike[str], down: str, scale: float) -> tuple[float, float]:
    """Extents in mm across the direction `down` ("z", "-x", ...). Raises as `mesh_corners`."""
    state = os.stat(path)
    extents = _extents(os.fspath(path), state.st_mtime_ns, state.st_size)
    a, b = (extents[i] * scale for i in range(3) if i != "xyz".index(down[-1]))
    return a, b


# The planner asks for the extents at every pose of a motion.
@lru_cache(maxsize=16)
def _extents(path: str, changed_ns: int, size: int) -> tuple[float, float, float]:
    """Extents in the unit of a file, which is read again when its time or size has changed."""
    x, y, z = np.ptp(mesh_corners(path).reshape(-1, 3), axis=0).tolist()
    return x, y, z


def _by_trimesh(path: str | os.PathLike[str], kind: str) -> Array:
    import trimesh

    with open(path, "rb") as source:
        try:
            found = trimesh.load(
                source, file_type=kind, force="mesh", process=False, skip_materials=True
            )
            return np.array(found.triangles, dtype=float).reshape(-1, 3, 3)
        # The readers of trimesh raise whatever a damaged file makes them fail with.
        except Exception as error:
            raise ValueError(f"is no {kind.upper()} file that can be read ({error})") from None


def _stl(path: str | os.PathLike[str], size: int) -> Array:
    data = Path(path).read_bytes()
    count = int.from_bytes(data[80:84], "little") if size >= 84 else -1
    if size == 84 + 50 * count:
        return np.frombuffer(data, _FACET, count, 84)["corners"].astype(float)
    return _ascii_corners(data)


def _ascii_corners(data: bytes) -> Array:
    lines = data.split(b"\n")
    if not lines[0].lstrip().lower().startswith(b"solid"):
        raise ValueError("is no STL file: neither its size nor its first word fits")
    words = [line.split() for line in lines if line.lstrip().lower().startswith(b"vertex")]
    try:
        values = np.array([[float(w) for w in row[1:4]] for row in words])
        return values.reshape(-1, 3, 3)
    except ValueError:
        raise ValueError("is no STL file: its vertices are not threes of three numbers") from None
