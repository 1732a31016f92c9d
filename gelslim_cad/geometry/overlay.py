"""What pictures show beside the parts: printed dots, the camera's view, paths of light."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import corner_rays

Points = NDArray[np.float64]
Colour = tuple[float, float, float, float]
DISC_CORNERS = 16
LIFT_MM = 0.03
"""Dots are drawn this far above the gel, so that they do not flicker with its face."""
RAY_RADIUS_MM = 0.06
DOT_COLOUR: Colour = (0.05, 0.05, 0.06, 1.0)
VIEW_COLOUR: Colour = (0.95, 0.65, 0.1, 0.28)
LIGHT_COLOURS: dict[str, Colour] = {
    "red": (0.85, 0.12, 0.1, 1.0),
    "green": (0.1, 0.6, 0.2, 1.0),
    "blue": (0.1, 0.3, 0.85, 1.0),
}
OTHER_LIGHT: Colour = (0.55, 0.45, 0.2, 1.0)


@dataclass(frozen=True)
class Overlay:
    """Triangles that are shown with the finger but are no part of it.

    Attributes:
        name: What it shows.
        vertices_mm: (n, 3) in the sensor frame.
        faces: (m, 3) indices of vertices.
        colour: sRGB colour with opacity, each from 0 to 1.
        with_part: The part with which it moves in the exploded view; empty if it stays.
        shown: Whether the 3D view shows it from the start.
    """

    name: str
    vertices_mm: Points
    faces: NDArray[np.int64]
    colour: Colour
    with_part: str = ""
    shown: bool = True

    def packed(self) -> tuple[Any, ...]:
        """All fields as plain values, which cross process borders and give a key."""
        vertices = tuple(map(tuple, np.round(self.vertices_mm, 6).tolist()))
        faces = tuple(map(tuple, self.faces.tolist()))
        return self.name, vertices, faces, self.colour, self.with_part, self.shown

    def record(self, explode_mm: Mapping[str, tuple[float, float, float]]) -> Mapping[str, Any]:
        """As the 3D view of the report reads it; `explode_mm` are the parts' displacements."""
        return {
            "name": self.name,
            "positions": np.round(self.vertices_mm, 3).ravel().tolist(),
            "indices": self.faces.ravel().tolist(),
            "colour": [*map(linear_light, self.colour[:3]), self.colour[3]],
            "explode": explode_mm.get(self.with_part, (0.0, 0.0, 0.0)),
            "shown": self.shown,
        }

    @classmethod
    def unpacked(cls, values: tuple[Any, ...]) -> Overlay:
        """From what `packed` gave."""
        name, vertices, faces, *rest = values
        return cls(name, np.array(vertices), np.array(faces, dtype=np.int64), *rest)


def linear_light(srgb: float) -> float:
    """Linear light from sRGB (IEC 61966-2-1); glTF's factors are linear."""
    return srgb / 12.92 if srgb <= 0.04045 else ((srgb + 0.055) / 1.055) ** 2.4


def printed_dots(d: Lookup, centres_mm: Points, diameters_mm: Points) -> Overlay:
    """Discs on the gel's outer surface at `centres_mm` (n, 2)."""
    angle = np.arange(DISC_CORNERS) * (2 * np.pi / DISC_CORNERS)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    plane = centres_mm[:, None, :] + diameters_mm[:, None, None] / 2 * circle
    height = GelShape.of(d).surface_z_mm(plane[..., 0], plane[..., 1]) + LIFT_MM
    fan = np.array([[0, k, k + 1] for k in range(1, DISC_CORNERS - 1)])
    faces = (np.arange(len(centres_mm)) * DISC_CORNERS)[:, None, None] + fan
    vertices = np.concatenate([plane, height[..., None]], axis=2)
    return Overlay(
        "printed_dots", vertices.reshape(-1, 3), faces.reshape(-1, 3), DOT_COLOUR, "gel_pad"
    )


def camera_view(d: Lookup) -> Overlay:
    """Pyramid from the camera to the mirror and frustum from there to the window."""
    _, mirror, window = corner_rays(d)
    pinhole = np.array([[d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]]])
    vertices = np.concatenate([pinhole, mirror, window])
    pyramid = [[0, 1 + k, 1 + (k + 1) % 4] for k in range(4)]
    walls = [
        [a, b, c]
        for k in range(4)
        for a, b, c in (
            (1 + k, 1 + (k + 1) % 4, 5 + (k + 1) % 4),
            (1 + k, 5 + (k + 1) % 4, 5 + k),
        )
    ]
    return Overlay("camera_view", vertices, np.array(pyramid + walls), VIEW_COLOUR, shown=False)


def light_paths(paths: Sequence[tuple[str, Points]]) -> tuple[Overlay, ...]:
    """Rays as thin prisms, one overlay for each colour; `paths` are colour and points (k, 3)."""
    found = []
    for colour in dict.fromkeys(name for name, _ in paths):
        prisms = [
            _prism(a, b)
            for name, points in paths
            if name == colour
            for a, b in pairwise(points)
            if np.linalg.norm(b - a) > RAY_RADIUS_MM
        ]
        vertices = np.array(prisms).reshape(-1, 3)
        sides = [[k, (k + 1) % 3, 3 + k] for k in range(3)]
        sides += [[(k + 1) % 3, 3 + (k + 1) % 3, 3 + k] for k in range(3)]
        faces = (6 * np.arange(len(prisms)))[:, None, None] + np.array(sides)
        shade = LIGHT_COLOURS.get(colour, OTHER_LIGHT)
        found.append(Overlay(f"light_{colour}", vertices, faces.reshape(-1, 3), shade, shown=False))
    return tuple(found)


def _prism(start: Points, end: Points) -> Points:
    """Corners (6, 3) of a thin three-sided prism from start to end."""
    along = (end - start) / np.linalg.norm(end - start)
    aside = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    other = np.cross(along, aside)
    turns = [(np.cos(t), np.sin(t)) for t in (0.0, 2 * np.pi / 3, 4 * np.pi / 3)]
    ring = np.array([c * aside + s * other for c, s in turns]) * RAY_RADIUS_MM
    return np.concatenate([start + ring, end + ring])
