"""Write a hexahedral mesh as VTK XML UnstructuredGrid (.vtu).

The format is that of the VTK User's Guide, chapter on file formats. Arrays are inline: base64 of
an 8-byte length and the little-endian data, uncompressed, so that the same mesh always gives the
same bytes.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator, Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_core.files.replaced_file import replace_file
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh

_VTK_HEXAHEDRON = 12
_VTK_TYPES = {
    "f8": "Float64",
    "f4": "Float32",
    "i8": "Int64",
    "i4": "Int32",
    "u1": "UInt8",
    "i1": "Int8",
}


def write_vtu(
    path: str | os.PathLike[str],
    mesh: PadMesh,
    *,
    point_data: Mapping[str, ArrayLike] | None = None,
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write the mesh, with fields on nodes and cells, atomically.

    The node sets are always written as the point field `node_set` (bit 0 bonded, bit 1 surface,
    bit 2 sides), and the filled fractions of cut cells as the cell field `fill`.

    Args:
        path: File to write.
        mesh: The mesh.
        point_data: Fields on the n nodes by name, each (n,) or (n, c).
        cell_data: Fields on the m cells by name, each (m,) or (m, c).

    Raises:
        MeshError: The length, type or name of a field does not fit.
    """
    points = {"node_set": _node_set_bits(mesh), **(point_data or {})}
    cells = {**_fill(mesh), **(cell_data or {})}
    body = "\n".join(_document(mesh, points, cells)) + "\n"
    replace_file(path, body.encode("ascii"))


def _fill(mesh: PadMesh) -> dict[str, NDArray[np.float64]]:
    if mesh.fill is None:
        return {}
    # Cells are numbered x fastest, z slowest.
    return {"fill": mesh.fill.transpose(2, 1, 0)[mesh.occupancy.transpose(2, 1, 0)]}


def _node_set_bits(mesh: PadMesh) -> NDArray[np.uint8]:
    bits = np.zeros(mesh.n_nodes, dtype=np.uint8)
    for bit, nodes in enumerate((mesh.bonded, mesh.surface, mesh.sides)):
        bits[nodes] |= 1 << bit
    return bits


def _document(
    mesh: PadMesh, point_data: Mapping[str, ArrayLike], cell_data: Mapping[str, ArrayLike]
) -> Iterator[str]:
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
    for tag, fields, count in (("PointData", point_data, n), ("CellData", cell_data, m)):
        yield f"<{tag}>"
        for name, values in fields.items():
            yield _data_array(name, _checked_field(name, values, count))
        yield f"</{tag}>"
    yield "</Piece>"
    yield "</UnstructuredGrid>"
    yield "</VTKFile>"


def _checked_field(name: str, values: ArrayLike, count: int) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype == np.bool_:
        array = array.view(np.uint8)
    if array.ndim not in (1, 2) or len(array) != count:
        raise MeshError(
            f"field {name!r} has shape {array.shape}: must be ({count},) or ({count}, c)",
            field=name,
        )
    if array.dtype.str[1:] not in _VTK_TYPES:
        raise MeshError(
            f"field {name!r} has type {array.dtype}: must be one of {', '.join(_VTK_TYPES)}",
            field=name,
        )
    if not name.isascii():
        raise MeshError(f"field name {name!r}: must be plain ASCII", field=name)
    return array


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
