"""Still pictures of the finger, drawn off screen with VTK: assembled, exploded, in section.

VTK is used without PyVista's plotter, whose import alone takes longer than all three pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gelslim_cad.pictures.mesh_scene import MeshScene, View
from gelslim_cad.pictures.shaded_mesh import ShadedMesh, shaded_mesh
from gelslim_cad.pictures.window import draw, offscreen_window, png_bytes

Mesh = tuple[
    str,
    np.ndarray,
    np.ndarray,
    tuple[float, float, float, float],
    tuple[float, float, float],
]
"""Name, vertices (n, 3) in mm, faces (m, 3), sRGB colour with opacity, explode vector in mm."""


@dataclass(frozen=True)
class Shown:
    """A part as pictures show it: mesh, sRGB colour with opacity, explode vector in mm."""

    mesh: ShadedMesh
    colour: tuple[float, float, float, float]
    explode_mm: tuple[float, float, float]


Axis = Literal["x", "y", "z"]

ISO = View(yaw_deg=-56.0, pitch_deg=27.0)
SECTIONS = {"x": View(0.0, 0.0), "y": View(-90.0, 0.0), "z": View(-90.0, 90.0)}
"""Views at right angles to a section: x from the tip, y from the -y side, z from above the gel."""

KINDS = ("whole", "exploded", "section", "section_across")
"""Pictures of a set."""
WIDTH_PX = 1200
OVERSAMPLING = 2


def picture_whole(meshes: Sequence[Mesh]) -> bytes:
    """Draw the assembled finger as PNG.

    Raises:
        PictureError: VTK or a system library that it needs is missing.
    """
    return _alone(lambda: _scene(_shown(meshes), ISO))


def picture_exploded(meshes: Sequence[Mesh], explode: float = 1.0) -> bytes:
    """Draw the parts moved by `explode` times their explode vectors; raises as picture_whole."""
    return _alone(lambda: _scene(_shown(meshes), ISO, explode))


def picture_section(meshes: Sequence[Mesh], axis: Axis = "y", at_mm: float = 0.0) -> bytes:
    """Draw a section of the finger at `axis` = `at_mm`, seen at right angles, cut faces hatched.

    Everything between the plane and the viewer is removed. Raises as picture_whole, and
    ValueError where the plane misses every part.
    """
    shown = _shown(meshes)
    cut = _cut(shown, axis, at_mm)
    return _alone(lambda: _scene(shown, SECTIONS[axis], 0.0, cut))


def _shown(meshes: Sequence[Mesh]) -> list[Shown]:
    return [Shown(shaded_mesh(v, f), colour, explode) for _, v, f, colour, explode in meshes]


def picture_set(
    window: Any,
    parts: Sequence[Shown],
    at_mm: float = 0.0,
    dots: Mesh | None = None,
    view: Mesh | None = None,
    kinds: Sequence[str] = KINDS,
) -> dict[str, bytes]:
    """Draw the finger assembled, exploded, and in sections at y and x = `at_mm`, as PNG.

    The printed `dots` are drawn where the gel is seen from above, the camera's `view` in the
    section along the finger; both whole, without edges.

    All that `kinds` asks for are drawn in one window, as `offscreen_window` gives it. Raises
    ValueError where a section misses every part.
    """
    along, across = _cut(parts, "y", at_mm), _cut(parts, "x", at_mm)
    above = () if dots is None else (dots,)
    beside = () if view is None else (view,)
    makers = {
        "whole": lambda: _scene(parts, ISO, overlays=above),
        "exploded": lambda: _scene(parts, ISO, 1.0, overlays=above),
        "section": lambda: _scene(parts, SECTIONS["y"], 0.0, along, beside),
        "section_across": lambda: _scene(parts, SECTIONS["x"], 0.0, across),
    }
    images = _images(window, [makers[kind]() for kind in kinds])
    return {kind: png_bytes(image) for kind, image in zip(kinds, images, strict=True)}


def _cut(parts: Sequence[Shown], axis: Axis, at_mm: float) -> tuple[int, float]:
    """Axis and place of a section. Raises ValueError where it misses every part."""
    index = "xyz".index(axis)
    along = [part.mesh.vertices_mm[:, index] for part in parts]
    spans = [(places.min(), places.max()) for places in along]
    if not any(low < at_mm < high for low, high in spans):
        low, high = min(s[0] for s in spans), max(s[1] for s in spans)
        raise ValueError(
            f"section at {axis} = {at_mm} mm meets no part; they span {low:.2f} to {high:.2f} mm"
        )
    return index, at_mm


def _scene(
    parts: Sequence[Shown],
    view: View,
    explode: float = 0.0,
    cut: tuple[int, float] | None = None,
    overlays: Sequence[Mesh] = (),
) -> MeshScene:
    scene = MeshScene(view, cut)
    for number, part in enumerate(parts):
        moved = explode * np.asarray(part.explode_mm)
        scene.add(part.mesh, part.colour, moved, hatch_up=number % 2 == 0)
    for _, vertices, faces, rgba, shift in overlays:
        scene.add_overlay(vertices + explode * np.asarray(shift), faces, rgba)
    return scene


def _alone(scene: Callable[[], MeshScene]) -> bytes:
    """The PNG of one scene, in a window of its own, without which VTK cannot make a scene."""
    with offscreen_window() as window:
        return png_bytes(_images(window, [scene()])[0])


def _images(window: Any, scenes: Sequence[MeshScene]) -> list[np.ndarray]:
    return draw(window, scenes, WIDTH_PX, OVERSAMPLING)
