"""Several built fingers of one design: their sizes and parts, and a picture of all to scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape, has_markers
from gelslim_cad.pictures.mesh_scene import MeshScene, View
from gelslim_cad.pictures.shaded_mesh import shaded_mesh
from gelslim_cad.pictures.window import draw, offscreen_window
from gelslim_cad.sensor import marker_grid
from gelslim_core.figure import as_png

MM = 1000.0
"""Per metre: GLB is in metres."""
CORNERS, LIFT_MM = 12, 0.03
INK = (0.02, 0.02, 0.02, 1.0)
FRONT, EDGE = View(-62.0, 16.0), View(0.0, 0.0)
WIDTH_PX, OVERSAMPLING, DPI = 2000, 2, 150
GAP_MM = 9.0
BAR_MM = 10.0
UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""From the sensor frame to that of the picture: tips up, gels towards -y."""
Array = NDArray[np.float64]


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
    meshes = read_glb(folder / f"{name}.glb")
    return Member(
        name,
        (d["design.gel.length_mm"], d["design.gel.width_mm"], d["design.gel.thickness_mm"]),
        (d["finger.length_mm"], d["finger.width_mm"], d["finger.thickness_mm"]),
        folder,
        (*meshes, dots(d)) if has_markers(d) else meshes,
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


def family_png(members: Sequence[Member]) -> bytes:
    """Draw the fingers as PNG, each row at one scale with a bar of 10 mm.

    Raises PictureError where nothing can be drawn here, ValueError for no member.
    """
    if not members:
        raise ValueError("a family picture needs at least one finger")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shapes = [_upright(m) for m in members]
    middles = _middles(shapes)
    with offscreen_window() as window:
        front, edge = (_row(window, members, shapes, v, middles) for v in (FRONT, EDGE))
    caption = 140
    height = sum(image.shape[0] for image, *_ in (front, edge)) + 2 * caption
    figure = Figure(figsize=(WIDTH_PX / DPI, height / DPI), dpi=DPI)
    FigureCanvasAgg(figure)
    top = 0
    for image, places, mm_per_px, words in (
        (*front, _sizes(members)),
        (*edge, _thicknesses(members)),
    ):
        tall = image.shape[0] + caption
        axes = figure.add_axes((0, 1 - (top + tall) / height, 1, tall / height))
        axes.set_xlim(0, WIDTH_PX)
        axes.set_ylim(tall, 0)
        axes.axis("off")
        axes.imshow(image, extent=(0, WIDTH_PX, image.shape[0], 0), aspect="auto")
        for x, text in zip(places, words, strict=True):
            axes.text(x, image.shape[0] + 4, text, ha="center", va="top", fontsize=10)
        _bar(axes, mm_per_px, tall)
        top += tall
    return as_png(figure)


def _bar(axes: Any, mm_per_px: float, tall: int) -> None:
    length = BAR_MM / mm_per_px
    left, place = 24.0, tall - 14.0
    axes.plot([left, left + length], [place, place], color="black", lw=2.5, solid_capstyle="butt")
    axes.text(left, place - 8, f"{BAR_MM:g} mm", ha="left", va="bottom", fontsize=10)


def _sizes(members: Sequence[Member]) -> list[str]:
    return [f"{m.name}\ngel {m.gel_mm[0]:g} × {m.gel_mm[1]:g} mm" for m in members]


def _thicknesses(members: Sequence[Member]) -> list[str]:
    return [f"{m.size_mm[2]:.1f} mm thick\n{m.size_mm[0]:.1f} mm long" for m in members]


def _upright(m: Member) -> Array:
    """All vertices in the picture's frame, standing on z = 0, the gel at y = 0."""
    points = np.concatenate([mesh.vertices_mm for mesh in m.meshes]) @ UPRIGHT.T
    return np.asarray(points - (0.0, points[:, 1].min(), points[:, 2].min()))


def _middles(shapes: Sequence[Array]) -> list[float]:
    """Position of each finger's middle along the picture in mm, the same in both rows."""
    places, start = [], 0.0
    for points in shapes:
        width = max(float(np.ptp(points @ view.axes()[0])) for view in (FRONT, EDGE))
        places.append(start + width / 2)
        start += width + GAP_MM
    return places


def _row(
    window: Any,
    members: Sequence[Member],
    shapes: Sequence[Array],
    view: View,
    middles: Sequence[float],
) -> tuple[Any, list[float], float]:
    """Image, the middle of each finger in px from the left, and mm per px."""
    scene = MeshScene(view)
    right = view.axes()[0]
    for m, points, middle in zip(members, shapes, middles, strict=True):
        seen = points @ right
        along = (middle - float(seen.min() + seen.max()) / 2) * right
        first = 0
        for mesh in m.meshes:
            last = first + len(mesh.vertices_mm)
            scene.add(shaded_mesh(points[first:last], mesh.faces), mesh.rgba, along)
            first = last
    half = max(float(np.ptp(p @ FRONT.axes()[0])) for p in (shapes[0], shapes[-1])) / 2
    # Both rows as wide as the wider one, so that they come out at one scale.
    scene.include(np.outer([middles[0] - half, middles[-1] + half], right))
    (image,) = draw(window, [scene], WIDTH_PX, OVERSAMPLING)
    places = scene.pixel_positions(np.outer(middles, right), WIDTH_PX)[:, 0]
    return image, [float(x) for x in places], scene.mm_per_px(WIDTH_PX)
