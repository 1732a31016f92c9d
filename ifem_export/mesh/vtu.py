"""Write a hexahedral mesh as VTK XML UnstructuredGrid (.vtu).

The format is that of the VTK User's Guide, chapter on file formats. Arrays are inline: base64 of
an 8-byte length and the little-endian data, uncompressed, so that the same mesh always gives the
same bytes.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import replace_file
from ifem_export.mesh.pad_mesh import PadMesh

_VTK_HEXAHEDRON = 12
_VTK_TYPES = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def write_vtu(path: str | os.PathLike[str], mesh: PadMesh) -> None:
    """Write the mesh atomically, with its node sets and filled fractions.

    The node sets are the point field `node_set` (bit 0 bonded, bit 1 surface, bit 2 sides), and the
    filled fractions of cut cells are the cell field `fill`.

    Args:
        path: File to write.
        mesh: The mesh.

    Raises:
        OSError: The file cannot be written.
    """
    replace_file(path, ("\n".join(_document(mesh)) + "\n").encode("ascii"))


def _document(mesh: PadMesh) -> Iterator[str]:
    n, m = mesh.n_nodes, mesh.n_elements
    yield '<?xml version="1.0"?>'
    yield (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">'
    )
    yield "<UnstructuredGrid>"
    yield f'<Piece NumberOfPoints="{n}" NumberOfCells="{m}">'
    yield "<Points>"
    yield _data_array("Points", mesh.nodes_mm)
    yield "</Points>"
    yield "<Cells>"
    yield _data_array("connectivity", mesh.hexes.reshape(-1))
    yield _data_array("offsets", np.arange(8, 8 * m + 1, 8, dtype=np.int64))
    yield _data_array("types", np.full(m, _VTK_HEXAHEDRON, dtype=np.uint8))
    yield "</Cells>"
    yield "<PointData>"
    yield _data_array("node_set", _node_set_bits(mesh))
    yield "</PointData>"
    yield "<CellData>"
    if mesh.fill is not None:
        # Cells are numbered x fastest, z slowest.
        fill = mesh.fill.transpose(2, 1, 0)[mesh.occupancy.transpose(2, 1, 0)]
        yield _data_array("fill", fill)
    yield "</CellData>"
    yield "</Piece>"
    yield "</UnstructuredGrid>"
    yield "</VTKFile>"


def _node_set_bits(mesh: PadMesh) -> NDArray[np.uint8]:
    bits = np.zeros(mesh.n_nodes, dtype=np.uint8)
    for bit, nodes in enumerate((mesh.bonded, mesh.surface, mesh.sides)):
        bits[nodes] |= 1 << bit
    return bits


def _data_array(name: str, array: NDArray[Any]) -> str:
    little = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
    data = little.tobytes()
    encoded = base64.b64encode(np.uint64(len(data)).astype("<u8").tobytes() + data).decode("ascii")
    components = 1 if array.ndim == 1 else array.shape[1]
    vtk_type = _VTK_TYPES[array.dtype.str[1:]]
    return (
        f"<DataArray type={quoteattr(vtk_type)} Name={quoteattr(name)} "
        f'NumberOfComponents="{components}" format="binary">{encoded}</DataArray>'
    )
