"""Binary STL."""

from __future__ import annotations

import numpy as np

from gelslim_cad.export.mesh import TriangleMesh

HEADER = b"gelslim-cad binary STL, millimetres"

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_bytes(mesh: TriangleMesh) -> bytes:
    """Write a mesh as binary STL in mm: 80-byte header, count, 50 bytes a triangle."""
    corners = mesh.vertices_mm[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(corners), dtype=_RECORD)
    records["normal"] = normals / np.where(length > 0, length, 1.0) + 0.0
    records["corners"] = corners
    return HEADER.ljust(80) + np.uint32(len(corners)).tobytes() + records.tobytes()
