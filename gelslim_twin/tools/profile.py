"""Profiles: height of the lower surface of each shape of a tool over its lowest point."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from gelslim_twin.scene.indenter import (
    Cone,
    Cylinder,
    FlatPunch,
    Indenter,
    MeshFile,
    Ring,
    Sphere,
    TexturedPlane,
    Wedge,
)
from gelslim_twin.scene.mesh_file import mesh_corners
from gelslim_twin.tools.profile_kernel import arc_heights, convex_heights

Array = NDArray[np.float64]
Profile = Callable[[Array, Array], Array]
"""Height in mm of the lower surface at points x and y (n,); infinite outside the shape."""
RIM_MM = 0.01
"""Margin of a rim, so that rounding does not decide about rows of nodes exactly on it."""


@dataclass(frozen=True)
class BallProfile:
    """The lower half of a ball."""

    radius_mm: float

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights (n,) at points x and y (n,)."""
        return _arc(self.radius_mm, np.hypot(x, y))


@dataclass(frozen=True, eq=False)
class ConvexProfile:
    """Lower surface of the points p with n·p <= reach for every outer normal.

    Attributes:
        normals: Unit normals (m, 3).
        reach_mm: Reaches (m,).
    """

    normals: Array
    reach_mm: Array

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights at points x and y of any shape."""
        height = np.empty(x.shape)
        flat = np.ravel(x), np.ravel(y), height.reshape(-1)
        convex_heights(self.normals, self.reach_mm, RIM_MM, *flat)
        return height


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights on an even grid, bilinear; infinite where a corner is, and beside the grid.

    Attributes:
        x_mm: Axis (nx,).
        y_mm: Axis (ny,).
        height_mm: Heights (nx, ny), infinite beside the shape.
    """

    x_mm: Array
    y_mm: Array
    height_mm: Array

    @cached_property
    def missing(self) -> NDArray[np.bool_]:
        """Whether (nx, ny) a point of the grid lies beside the shape."""
        return ~np.isfinite(self.height_mm)

    @cached_property
    def known_mm(self) -> Array:
        """Heights (nx, ny), 0 beside the shape."""
        return np.where(self.missing, 0.0, self.height_mm)

    @cached_property
    def _share_missing(self) -> Array:
        return self.missing.astype(float)

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights at points x and y of any shape."""
        at = [(v - a[0]) / (a[1] - a[0]) for v, a in ((x, self.x_mm), (y, self.y_mm))]
        share = map_coordinates(self._share_missing, at, order=1, cval=1.0)
        # Rounding must not make a grid point infinite because of a neighbour outside the shape.
        return np.where(share > NEGLIGIBLE, np.inf, map_coordinates(self.known_mm, at, order=1))


def profile(indenter: Indenter, folder: Path, seed: int = 0) -> Profile:
    """Lower surface of a shape about its origin. Raises ValueError or OSError for a bad mesh."""
    match indenter:
        case Sphere():
            return BallProfile(indenter.radius_mm)
        case Cylinder():
            half = indenter.length_mm / 2 + RIM_MM
            return _turned(
                indenter.axis_deg,
                lambda x, y: _within(np.abs(x) <= half, _arc(indenter.radius_mm, np.abs(y))),
            )
        case Ring():
            inner = indenter.inner_radius_mm - RIM_MM
            outer = indenter.outer_radius_mm + RIM_MM
            return lambda x, y: _within((np.hypot(x, y) >= inner) & (np.hypot(x, y) <= outer), 0.0)
        case FlatPunch():
            return _punch(indenter)
        case Wedge():
            half = indenter.length_mm / 2 + RIM_MM
            tip, lean = indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)
            return _turned(
                indenter.axis_deg,
                lambda x, y: _within(np.abs(x) <= half, _tipped(tip, lean, np.abs(y))),
            )
        case Cone():
            tip, lean = indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)
            return lambda x, y: _tipped(tip, lean, np.hypot(x, y))
        case TexturedPlane():
            return _texture(indenter, seed)
        case MeshFile():
            return mesh_file_profile(indenter, folder)


def _punch(punch: FlatPunch) -> Profile:
    if punch.radius_mm is not None:
        radius = punch.radius_mm + RIM_MM
        return lambda x, y: _within(np.hypot(x, y) <= radius, 0.0)
    a, b = (punch.length_mm or 0.0) / 2 + RIM_MM, (punch.width_mm or 0.0) / 2 + RIM_MM
    return lambda x, y: _within((np.abs(x) <= a) & (np.abs(y) <= b), 0.0)


def _texture(plane: TexturedPlane, seed: int) -> Profile:
    """Waves with their crests at height 0 pointing down; rough ones from a sum of random waves."""
    wave, relief = 2 * math.pi / plane.pitch_mm, plane.relief_mm

    def ridges(x: Array, y: Array) -> Array:
        return np.asarray(relief / 2 * (1 - np.cos(wave * y)))

    def bumps(x: Array, y: Array) -> Array:
        return np.asarray(relief / 4 * (2 - np.cos(wave * x) - np.cos(wave * y)))

    if plane.texture == "rough":
        relief_of: Profile = rough_profile(plane, seed)
    else:
        relief_of = ridges if plane.texture == "ridges" else bumps
    a, b = plane.length_mm / 2 + RIM_MM, plane.width_mm / 2 + RIM_MM

    def cut(x: Array, y: Array) -> Array:
        return _within((np.abs(x) <= a) & (np.abs(y) <= b), relief_of(x, y))

    return _turned(plane.axis_deg, cut)


def _turned(angle_deg: float, shape: Profile) -> Profile:
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return lambda x, y: shape(c * x + s * y, c * y - s * x)


def _arc(radius: float, reach: Array) -> Array:
    height = np.empty(reach.shape)
    arc_heights(radius, reach.reshape(-1), height.reshape(-1))
    return height


def _tipped(tip: float, half: float, reach: Array) -> Array:
    """Flanks at `half` from the axis behind a round tip that they touch."""
    edge, start = tip * math.cos(half), tip * (1 - math.sin(half))
    flank = start + (reach - edge) / math.tan(half)
    if tip == 0:
        return np.asarray(flank)
    return np.where(reach <= edge, _arc(tip, np.minimum(reach, edge)), flank)


def _within(inside: NDArray[np.bool_], height: Array | float) -> Array:
    return np.where(inside, height, np.inf)


_WAVES = 64
_MOST_CELLS = 4_000_000
NEGLIGIBLE = 1e-9
"""Weight of a grid point below which it is ignored."""


def mesh_file_profile(shape: MeshFile, folder: Path) -> Profile:
    """Lower surface of a mesh, centred on the middle of its extents, its lowest point at 0.

    Raises ValueError for a file that is no mesh, or a grid of more than four million cells.
    """
    return mesh_profile(facets_down(shape, folder), shape.resolution_mm)[0]


def facets_down(shape: MeshFile, folder: Path) -> Array:
    """Facets (n, 3, 3) in mm of a mesh, turned so that its lower side points to -z.

    Raises ValueError for a file that is no mesh, OSError for one that cannot be read.
    """
    return _down(mesh_corners(folder / shape.file) * shape.scale, shape.down)


def mesh_profile(corners: Array, resolution_mm: float) -> tuple[Profile, Array]:
    """Lower surface of facets (n, 3, 3) by a height map, and where it lies.

    Args:
        corners: Corners of the facets in mm; z points up.
        resolution_mm: Cell size of the height map.

    Returns:
        The profile about the middle of the extents, its lowest point at 0; and the point (3,) of
        the mesh's frame that is the profile's origin.

    Raises:
        ValueError: The height map would have more than four million cells, or one row.
    """
    origin = lowest_middle(corners)
    half = np.ptp(corners.reshape(-1, 3)[:, :2], axis=0) / 2
    count = np.ceil(2 * half / resolution_mm).astype(int) + 1
    if count.prod() > _MOST_CELLS or count.min() < 2:
        raise ValueError(
            f"a height map of {count[0]} x {count[1]} cells is no good; change resolution_mm"
        )
    x, y = (np.linspace(-h, h, n) for h, n in zip(half, count, strict=True))
    return HeightMap(x, y, _lowest(corners - origin, x, y)), origin


def lowest_middle(corners: Array) -> Array:
    """The middle of the extents of facets (n, 3, 3) at the height of their lowest point, (3,)."""
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([*((low + high) / 2)[:2], low[2]])


def rough_profile(plane: TexturedPlane, seed: int) -> Profile:
    """A sum of waves of random directions about the correlation length.

    The relief is four standard deviations; what is beyond is cut off there.
    """
    rng = np.random.Generator(np.random.Philox(key=[seed, 0x7E47]))
    angle = rng.uniform(0, 2 * math.pi, _WAVES)
    number = 2 * math.pi / plane.pitch_mm * np.sqrt(rng.uniform(0.25, 2.0, _WAVES))
    phase = rng.uniform(0, 2 * math.pi, _WAVES)
    kx, ky = number * np.cos(angle), number * np.sin(angle)

    def height(x: Array, y: Array) -> Array:
        total = np.zeros(np.broadcast(x, y).shape)
        for a, b, p in zip(kx, ky, phase, strict=True):
            total += np.cos(a * x + b * y + p)
        unit = total / math.sqrt(_WAVES / 2)
        return np.asarray(plane.relief_mm * (0.5 + np.clip(unit, -2, 2) / 4))

    return height


def _down(corners: Array, direction: str) -> Array:
    """Turn the mesh so that `direction` points to -z."""
    axis = "xyz".index(direction[-1])
    turned = corners[..., [(axis + 1) % 3, (axis + 2) % 3, axis]]
    if direction.startswith("-"):
        return np.asarray(turned)
    return np.asarray(turned * np.array([1.0, -1.0, -1.0]))


def _lowest(corners: Array, x: Array, y: Array) -> Array:
    """Lowest height (nx, ny) of the facets over the grid's points; infinite where there is none."""
    from gelslim_twin.tools.height_map_kernel import lower_heights

    height = np.full((len(x), len(y)), np.inf)
    lower_heights(np.ascontiguousarray(corners), x, y, height)
    return height
