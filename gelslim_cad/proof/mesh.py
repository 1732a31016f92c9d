"""STL, 3MF and GLB files read back with trimesh: closed, oriented, right size, right unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_cad.geometry.part import Part
from gelslim_cad.proof import ProofResult, at_most, equal, unreadable

VOLUME_LIMIT = 1e-3
GLB_LIMIT_MM = 0.25
"""The viewer's mesh may deviate by its linear tolerance; a wrong unit deviates by far more."""


def prove_stl(path: Path, volume_mm3: float) -> list[ProofResult]:
    """Reread an STL: watertight, winding consistent, volume (mm3) within 0.1 %."""
    import trimesh

    try:
        mesh = trimesh.load_mesh(path, file_type="stl")
    except Exception as error:
        return unreadable(path, error)
    return _prove_mesh(path.name, mesh, volume_mm3, "")


def prove_3mf(path: Path, name: str, volume_mm3: float) -> list[ProofResult]:
    """Reread a 3MF: unit mm; one object of that name, watertight, volume (mm3) within 0.1 %."""
    import trimesh

    try:
        scene = trimesh.load_scene(path, file_type="3mf")
    except Exception as error:
        return unreadable(path, error)
    file, meshes = path.name, _placed(scene)
    results = [
        equal(file, "unit is mm", scene.units == "millimeter", True, str(scene.units)),
        equal(file, "objects", len(meshes), 1),
        equal(file, "name present", name in meshes, True, name),
    ]
    return results + (_prove_mesh(file, meshes[name], volume_mm3, name) if name in meshes else [])


def prove_glb(path: Path, parts: Sequence[Part]) -> list[ProofResult]:
    """Reread a GLB: every part by name, its bounding box where it belongs in metres, y up."""
    import trimesh

    from gelslim_cad.export.brep import bounds_mm

    try:
        scene = trimesh.load_scene(path, file_type="glb")
    except Exception as error:
        return unreadable(path, error)
    file = path.name
    meshes = _placed(scene)
    results = [equal(file, "meshes", len(meshes), len(parts))]
    for part in parts:
        results.append(equal(file, "name present", part.name in meshes, True, part.name))
        if part.name not in meshes:
            continue
        low, high = bounds_mm(part.solid)
        expected = np.array([[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]])
        off = float(np.abs(meshes[part.name].bounds * 1000.0 - expected).max())
        detail = f"{part.name}: bounding box off by {off:.3g} mm"
        results.append(at_most(file, "bounds in metres", off, GLB_LIMIT_MM, detail))
    return results


def _placed(scene: Any) -> dict[str, Any]:
    """Meshes of a scene by node name, in world coordinates."""
    placed = {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        placed[node] = scene.geometry[geometry].copy().apply_transform(transform)
    return placed


def _prove_mesh(file: str, mesh: Any, volume_mm3: float, name: str) -> list[ProofResult]:
    error = abs(float(mesh.volume) / volume_mm3 - 1.0) if volume_mm3 > 0 else float("inf")
    label = f"{name}: " if name else ""
    detail = f"{label}{float(mesh.volume):.6g} mm3 read, {volume_mm3:.6g} mm3 built"
    return [
        equal(file, "watertight", bool(mesh.is_watertight), True, name),
        equal(file, "winding consistent", bool(mesh.is_winding_consistent), True, name),
        at_most(file, "volume", error, VOLUME_LIMIT, detail),
    ]
