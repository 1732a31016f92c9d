"""Files of meshes for printing: STL, and 3MF (core specification 1.x) with names and colours."""

from __future__ import annotations

import io
import zipfile
from xml.sax.saxutils import quoteattr

import numpy as np

from gelslim_cad.export.mesh import TriangleMesh

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_OPC = "http://schemas.openxmlformats.org/package/2006"
_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'

_TYPES = f"""{_XML}<Types xmlns="{_OPC}/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""

_RELATIONS = f"""{_XML}<Relationships xmlns="{_OPC}/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" \
Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
HEADER = b"gelslim-cad binary STL, "
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def threemf_bytes(
    name: str, mesh: TriangleMesh, material: str, colour: tuple[float, float, float, float]
) -> bytes:
    """Write a mesh as 3MF in mm, with its name, its material's name and its sRGB colour.

    The archive carries no times; coordinates are written so that float32 survives.
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        _add(archive, "[Content_Types].xml", _TYPES)
        _add(archive, "_rels/.rels", _RELATIONS)
        _add(archive, "3D/3dmodel.model", _model(name, mesh, material, colour))
    return stream.getvalue()


def _add(archive: zipfile.ZipFile, path: str, text: str) -> None:
    info = zipfile.ZipInfo(path, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = 3
    info.external_attr = 0o644 << 16
    archive.writestr(info, text.encode("utf-8"), compresslevel=6)


def _model(
    name: str, mesh: TriangleMesh, material: str, colour: tuple[float, float, float, float]
) -> str:
    vertices = "\n".join(
        f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in mesh.vertices_mm.tolist()
    )
    triangles = "\n".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist()
    )
    return (
        f'{_XML}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}">\n<resources>\n'
        f'<basematerials id="1">\n<base name={quoteattr(material)} '
        f"displaycolor={quoteattr(_hex(colour))}/>\n</basematerials>\n"
        f'<object id="2" type="model" name={quoteattr(name)} pid="1" pindex="0">\n'
        f"<mesh>\n<vertices>\n{vertices}\n</vertices>\n"
        f"<triangles>\n{triangles}\n</triangles>\n</mesh>\n</object>\n</resources>\n"
        '<build>\n<item objectid="2"/>\n</build>\n</model>\n'
    )


def _hex(colour: tuple[float, float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02X}" for c in colour)


def stl_bytes(mesh: TriangleMesh, unit: bytes = b"millimetres") -> bytes:
    """Write a mesh as binary STL: 80-byte header with its unit, count, 50 bytes a triangle."""
    corners = mesh.vertices_mm[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(corners), dtype=_RECORD)
    records["normal"] = normals / np.where(length > 0, length, 1.0) + 0.0
    records["corners"] = corners
    return (HEADER + unit).ljust(80) + np.uint32(len(corners)).tobytes() + records.tobytes()


def stl_size_mm(data: bytes) -> tuple[float, float, float]:
    """Sides of the box around the mesh of a binary STL."""
    records = np.frombuffer(data, dtype=_RECORD, offset=84)
    corners = records["corners"].reshape(-1, 3)
    x, y, z = (corners.max(axis=0) - corners.min(axis=0)).tolist()
    return x, y, z
