"""GLB (glTF 2.0 binary) of an assembly, for viewers.

Lengths are in metres, as glTF demands. The scene's root node turns the sensor frame (z out of
the gel) to glTF's y-up; under it there is one node and one mesh per part, in the sensor frame.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError
from gelslim_cad.export.mesh import Patch, face_patches
from gelslim_cad.geometry.overlay import linear_light
from gelslim_cad.geometry.part import Part

LINEAR_MM, ANGULAR_DEG = 0.1, 20.0
"""Tolerances of the meshes of viewers: from chord to curve, and between neighbouring chords."""
OPTICAL_ANGULAR_DEG = {"light_guide": 0.5}
"""Finer chords by the name of the part: the bend of a guide, where chords turn the light. With 9°
the traced light on the coat is 3 to 5 % too bright; up to 0.5° none leaks (docs/light_guide.md)."""
_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
_HALF = 0.7071067811865476


@dataclass
class _Buffer:
    """The binary chunk as it grows, with its views and accessors."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def add(self, values: NDArray[Any], kind: str, component: int, target: int) -> int:
        raw = values.tobytes()
        self.views.append(
            {
                "buffer": 0,
                "byteOffset": len(self.data),
                "byteLength": len(raw),
                "target": target,
            }
        )
        self.data += raw + b"\0" * (-len(raw) % 4)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if kind == "VEC3":
            accessor |= {
                "min": values.min(axis=0).astype(float).tolist(),
                "max": values.max(axis=0).astype(float).tolist(),
            }
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def glb_bytes(
    parts: Sequence[Part],
    *,
    tolerances: tuple[float, float] | None = None,
    patches: Sequence[Sequence[Patch]] | None = None,
) -> bytes:
    """Write parts as GLB in metres, y up, with the surfaces' own normals and sharp edges.

    Each node has the part's name and `extras`: `explode_mm` (sensor frame), `process`,
    `quantity`, `material`, and `chord_deg`, the largest angle between neighbouring chords. Colours
    are taken as sRGB; an alpha below 1 is drawn transparent.

    Args:
        parts: The parts.
        tolerances: Largest distance in mm between a chord and its curve, and largest angle in
            degrees between neighbouring chords, of all parts; by default `viewer_tolerances`.
        patches: The triangulated faces of each part, where they are known already.

    Returns:
        Content of the file.

    Raises:
        ExportError: There are no parts, or a face cannot be triangulated.
    """
    if not parts:
        raise ExportError("GLB: 0 parts given, at least 1 needed")
    buffer = _Buffer()
    meshes = []
    chosen = [tolerances or viewer_tolerances(part) for part in parts]
    faces = patches or (face_patches(p.solid, *t) for p, t in zip(parts, chosen, strict=True))
    nodes = [_node(n, p, t[1]) for n, (p, t) in enumerate(zip(parts, chosen, strict=True))]
    for number, (part, of_part) in enumerate(zip(parts, faces, strict=True)):
        attributes, indices = _geometry(buffer, of_part)
        primitive = {"attributes": attributes, "indices": indices, "material": number}
        meshes.append({"name": part.name, "primitives": [primitive]})
    root = {
        "name": "assembly",
        "rotation": [-_HALF, 0.0, 0.0, _HALF],
        "children": list(range(1, len(parts) + 1)),
    }
    document = {
        "asset": {"version": "2.0", "generator": "gelslim-cad"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, *nodes],
        "meshes": meshes,
        "materials": [_material(part) for part in parts],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _container(document, bytes(buffer.data))


def viewer_tolerances(part: Part) -> tuple[float, float]:
    """Tolerances of a part's mesh for viewers: `LINEAR_MM` and `ANGULAR_DEG`, finer for optics."""
    return LINEAR_MM, OPTICAL_ANGULAR_DEG.get(part.name, ANGULAR_DEG)


def _geometry(buffer: _Buffer, patches: Sequence[Patch]) -> tuple[dict[str, int], int]:
    """One vertex set per CAD face: neighbours share no vertices, so edges stay sharp."""
    positions = np.concatenate([p.nodes_mm for p in patches]) / 1000.0
    normals = np.concatenate([p.normals for p in patches])
    starts = np.cumsum([0, *(len(p.nodes_mm) for p in patches[:-1])])
    triangles = np.concatenate([p.triangles + s for p, s in zip(patches, starts, strict=True)])
    small = len(positions) < 65535
    attributes = {
        "POSITION": buffer.add(_f4(positions), "VEC3", _FLOAT, _VERTICES),
        "NORMAL": buffer.add(_f4(normals), "VEC3", _FLOAT, _VERTICES),
    }
    indices = triangles.ravel().astype("<u2" if small else "<u4")
    return attributes, buffer.add(indices, "SCALAR", _UINT16 if small else _UINT32, _INDICES)


def _f4(values: NDArray[np.float64]) -> NDArray[np.float32]:
    # Rounding first keeps last-bit noise around zero (1e-17 or -0) out of the file.
    return (np.round(values, 9) + 0.0).astype("<f4")


def _node(number: int, part: Part, chord_deg: float) -> dict[str, Any]:
    extras = {
        "explode_mm": [float(x) for x in part.explode_mm],
        "process": part.process,
        "quantity": part.quantity,
        "material": part.material,
        "chord_deg": chord_deg,
    }
    return {"name": part.name, "mesh": number, "extras": extras}


def _material(part: Part) -> dict[str, Any]:
    red, green, blue, alpha = part.colour
    base = [round(linear_light(c), 6) for c in (red, green, blue)] + [round(float(alpha), 6)]
    material: dict[str, Any] = {
        "name": part.material,
        "pbrMetallicRoughness": {
            "baseColorFactor": base,
            "metallicFactor": 0.0,
            "roughnessFactor": 0.6,
        },
        "doubleSided": alpha < 1.0,
    }
    return material | ({"alphaMode": "BLEND"} if alpha < 1.0 else {})


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode("utf-8")
    text += b" " * (-len(text) % 4)
    chunks = b""
    for kind, chunk in ((b"JSON", text), (b"BIN\0", binary)):
        chunks += len(chunk).to_bytes(4, "little") + kind + chunk
    return b"glTF" + b"".join(n.to_bytes(4, "little") for n in (2, 12 + len(chunks))) + chunks
