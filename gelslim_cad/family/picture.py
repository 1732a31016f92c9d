"""A family in one picture to scale: first with the gels towards the viewer, then from the side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.family.member import Member
from gelslim_cad.pictures.finger_pictures import render_window
from gelslim_cad.pictures.mesh_scene import MeshScene, View
from gelslim_core.figure import as_png

FRONT, EDGE = View(-62.0, 16.0), View(0.0, 0.0)
WIDTH_PX, OVERSAMPLING, DPI = 2000, 2, 150
GAP_MM = 9.0
BAR_MM = 10.0
UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""From the sensor frame to that of the picture: tips up, gels towards -y."""
Array = NDArray[np.float64]


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
    front, edge = _row(members, shapes, FRONT, middles), _row(members, shapes, EDGE, middles)
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
    members: Sequence[Member], shapes: Sequence[Array], view: View, middles: Sequence[float]
) -> tuple[Any, list[float], float]:
    """Image, the middle of each finger in px from the left, and mm per px."""
    window = render_window()
    scene = MeshScene(window, view)
    right = view.axes()[0]
    for m, points, middle in zip(members, shapes, middles, strict=True):
        seen = points @ right
        along = (middle - float(seen.min() + seen.max()) / 2) * right
        first = 0
        for mesh in m.meshes:
            last = first + len(mesh.vertices_mm)
            scene.add(points[first:last] + along, mesh.faces, mesh.rgba)
            first = last
    half = max(float(np.ptp(p @ FRONT.axes()[0])) for p in (shapes[0], shapes[-1])) / 2
    # Both rows as wide as the wider one, so that they come out at one scale.
    scene.include(np.outer([middles[0] - half, middles[-1] + half], right))
    try:
        image = scene.image(WIDTH_PX, OVERSAMPLING)
    finally:
        window.Finalize()
    places = scene.pixel_positions(np.outer(middles, right), WIDTH_PX)[:, 0]
    return image, [float(x) for x in places], scene.mm_per_px(WIDTH_PX)
