"""Files of meshes for printing: STL, and 3MF (core specification 1.x) with names and colours."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

from gelslim_cad.export import ExportError
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
HEADER = b"gelslim-cad binary STL, millimetres"
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class NamedMesh:
    """A mesh with its name, its material's name and its sRGB colour with alpha, 0 to 1."""

    name: str
    mesh: TriangleMesh
    material: str
    colour: tuple[float, float, float, float]


def threemf_bytes(items: NamedMesh | Sequence[NamedMesh]) -> bytes:
    """Write meshes as 3MF in mm, one object and one build item each.

    The archive carries no times; coordinates are written so that float32 survives.

    Raises:
        ExportError: nothing to write.
    """
    chosen = [items] if isinstance(items, NamedMesh) else list(items)
    if not chosen:
        raise ExportError("3MF: 0 meshes given, at least 1 needed")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        _add(archive, "[Content_Types].xml", _TYPES)
        _add(archive, "_rels/.rels", _RELATIONS)
        _add(archive, "3D/3dmodel.model", _model(chosen))
    return stream.getvalue()


def _add(archive: zipfile.ZipFile, path: str, text: str) -> None:
    info = zipfile.ZipInfo(path, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = 3
    info.external_attr = 0o644 << 16
    archive.writestr(info, text.encode("utf-8"), compresslevel=6)


def _model(items: Sequence[NamedMesh]) -> str:
    bases = "\n".join(
        f"<base name={quoteattr(i.material)} displaycolor={quoteattr(_hex(i.colour))}/>"
        for i in items
    )
    objects = "\n".join(_object(number, item) for number, item in enumerate(items))
    build = "\n".join(f'<item objectid="{number + 2}"/>' for number in range(len(items)))
    return (
        f'{_XML}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}">\n<resources>\n'
        f'<basematerials id="1">\n{bases}\n</basematerials>\n{objects}\n</resources>\n'
        f"<build>\n{build}\n</build>\n</model>\n"
    )


def _object(number: int, item: NamedMesh) -> str:
    vertices = "\n".join(
        f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>'
        for x, y, z in item.mesh.vertices_mm.tolist()
    )
    triangles = "\n".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in item.mesh.faces.tolist()
    )
    return (
        f'<object id="{number + 2}" type="model" name={quoteattr(item.name)} pid="1" '
        f'pindex="{number}">\n<mesh>\n<vertices>\n{vertices}\n</vertices>\n'
        f"<triangles>\n{triangles}\n</triangles>\n</mesh>\n</object>"
    )


def _hex(colour: tuple[float, float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02X}" for c in colour)


def stl_bytes(mesh: TriangleMesh) -> bytes:
    """Write a mesh as binary STL in mm: 80-byte header, count, 50 bytes a triangle."""
    corners = mesh.vertices_mm[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(corners), dtype=_RECORD)
    records["normal"] = normals / np.where(length > 0, length, 1.0) + 0.0
    records["corners"] = corners
    return HEADER.ljust(80) + np.uint32(len(corners)).tobytes() + records.tobytes()
