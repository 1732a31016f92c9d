"""Pictures of assembly steps: what is in place in pale colours, what moves in strong ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.pictures.mesh_scene import MeshScene, View
from gelslim_cad.pictures.shaded_mesh import ShadedMesh, shaded_mesh
from gelslim_cad.pictures.window import draw, png_bytes

Floats = NDArray[np.float64]
Colour = tuple[float, float, float, float]
WIDTH_PX = 720
"""Larger than pages show them, so that browsers and printers smooth the edges."""
ARROW: Colour = (0.78, 0.10, 0.12, 1.0)
SIDES = 20
HEAD_LENGTH = 0.45
HEAD_RATIO = 2.4
"""Diameter of an arrow's head over that of its shaft."""


@dataclass(frozen=True)
class Drawn:
    """A mesh, moved by `shift_mm` (3,), with its sRGB colour and opacity."""

    mesh: ShadedMesh
    shift_mm: Floats
    colour: Colour


@dataclass(frozen=True)
class Arrow:
    """An arrow: its tip, its unit direction, its length and its shaft's diameter in mm."""

    tip_mm: Floats
    direction: Floats
    length_mm: float
    shaft_mm: float


@dataclass(frozen=True)
class StepScene:
    """What one picture shows."""

    meshes: tuple[Drawn, ...]
    arrows: tuple[Arrow, ...]
    view: View


def picture_steps(
    window: Any, scenes: Sequence[StepScene], width_px: int = WIDTH_PX
) -> list[bytes]:
    """Draw steps as PNG.

    Args:
        window: Off-screen window, as `offscreen_window` gives it.
        scenes: What to draw.
        width_px: Width of each picture; the height follows from the content.

    Returns:
        A picture for each scene.
    """
    if not scenes:
        return []
    drawn = draw(window, [_scene(s) for s in scenes], width_px, oversampling=1)
    return [png_bytes(image) for image in drawn]


def _scene(step: StepScene) -> MeshScene:
    scene = MeshScene(step.view)
    for drawn in step.meshes:
        scene.add(drawn.mesh, drawn.colour, drawn.shift_mm)
    for arrow in step.arrows:
        scene.add(shaded_mesh(*arrow_mesh(arrow)), ARROW)
    return scene


def arrow_mesh(arrow: Arrow) -> tuple[Floats, NDArray[np.int64]]:
    """Closed mesh of an arrow, turned about its axis: vertices (n, 3) and faces (m, 3)."""
    head = HEAD_LENGTH * arrow.length_mm
    radius, wide = arrow.shaft_mm / 2, HEAD_RATIO * arrow.shaft_mm / 2
    profile = [(-arrow.length_mm, radius), (-head, radius), (-head, wide)]
    along = np.asarray(arrow.direction)
    across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across /= np.linalg.norm(across)
    other = np.cross(along, across)
    turn = np.arange(SIDES) * 2 * np.pi / SIDES
    ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * other
    points = [arrow.tip_mm - arrow.length_mm * along, arrow.tip_mm]
    rings = [arrow.tip_mm + x * along + r * ring for x, r in profile]
    k = np.arange(SIDES)
    after = (k + 1) % SIDES

    def number(row: int, place: NDArray[np.int64]) -> NDArray[np.int64]:
        return 2 + row * SIDES + place

    faces = [np.column_stack([np.zeros_like(k), number(0, after), number(0, k)])]
    for row in (0, 1):
        low, high = number(row, k), number(row, after)
        up, over = number(row + 1, k), number(row + 1, after)
        faces += [np.column_stack([low, high, over]), np.column_stack([low, over, up])]
    faces.append(np.column_stack([np.ones_like(k), number(2, k), number(2, after)]))
    return np.concatenate([np.array(points), *rings]), np.concatenate(faces)
