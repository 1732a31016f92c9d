"""A built finger of a family: its sizes and the mesh of its parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.sensor.pad import marker_grid

MM = 1000.0
"""Per metre: GLB is in metres."""
CORNERS, LIFT_MM = 12, 0.03
INK = (0.02, 0.02, 0.02, 1.0)


@dataclass(frozen=True)
class Mesh:
    """A part: vertices (n, 3) in mm in the sensor frame, faces (m, 3), sRGB with opacity."""

    name: str
    vertices_mm: NDArray[np.float64]
    faces: NDArray[np.int64]
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True)
class Member:
    """A finger: name, gel and outer sizes in mm, folder of its build and meshes."""

    name: str
    gel_mm: tuple[float, float, float]
    size_mm: tuple[float, float, float]
    folder: Path
    meshes: tuple[Mesh, ...]


def member(name: str, d: Dimensions, folder: Path) -> Member:
    """A finger from its dimensions and the GLB of its build."""
    return Member(
        name,
        (d["design.gel.length_mm"], d["design.gel.width_mm"], d["design.gel.thickness_mm"]),
        (d["finger.length_mm"], d["finger.width_mm"], d["finger.thickness_mm"]),
        folder,
        (*read_glb(folder / f"{name}.glb"), dots(d)),
    )


def dots(d: Dimensions) -> Mesh:
    """The printed markers as one mesh of flat discs just above the gel, for the picture."""
    grid, shape = marker_grid(d), GelShape.of(d)
    angles = np.arange(CORNERS) * 2 * np.pi / CORNERS
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1) / 2
    spread = grid.diameter_mm[:, None, None] * np.concatenate([[[0.0, 0.0]], rim])
    xy = (grid.positions_mm[:, None, :2] + spread).reshape(-1, 2)
    z = shape.surface_z_mm(xy[:, 0], xy[:, 1]) + LIFT_MM
    fan = np.array([(0, k, 1 + k % CORNERS) for k in range(1, CORNERS + 1)])
    faces = (np.arange(len(grid))[:, None, None] * (CORNERS + 1) + fan).reshape(-1, 3)
    return Mesh("markers", np.column_stack([xy, z]), faces.astype(np.int64), INK)


def read_glb(path: Path) -> tuple[Mesh, ...]:
    """Parts of a GLB in the scene's order, back in mm and in the sensor frame."""
    import trimesh

    scene: Any = trimesh.load(path, process=False)
    found = []
    for node in scene.graph.nodes_geometry:
        placement, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        x, y, z = trimesh.transform_points(mesh.vertices, placement).T * MM
        vertices = np.column_stack([x, -z, y])  # GLB is y up
        found.append(
            Mesh(
                str(node),
                np.asarray(vertices, dtype=float),
                np.asarray(mesh.faces, dtype=np.int64),
                _colour(mesh),
            )
        )
    return tuple(found)


def _colour(mesh: Any) -> tuple[float, float, float, float]:
    material = mesh.visual.material
    colour = np.asarray(material.baseColorFactor, dtype=float)
    if colour.max() > 1:
        colour = colour / 255
    red, green, blue = (_from_linear(float(c)) for c in colour[:3])
    return red, green, blue, float(colour[3])


def _from_linear(light: float) -> float:
    """SRGB from linear light (IEC 61966-2-1), which glTF keeps."""
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055
