"""Marker frames drawn for the tests: every dot's true centre is the centroid of its image.

A dot is a disc on the gel; its rim is projected point by point through the camera, filled with
4 x 4 samples per pixel, and its centre is the area centroid of that outline (which is not the
projection of the disc's centre).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from camera_rig import finger_view
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import MarkerGrid, build_marker_grid

Vector = NDArray[np.float64]
_RIM = 48
_SUB = 4


@dataclass(frozen=True)
class Look:
    """How a frame looks; lengths in px, levels in grey values."""

    noise: float = 0.0
    blur: float = 0.5
    contrast: float = 0.75
    light: float = 170.0
    gradient: float = 0.45
    colour: bool = True
    specular: int = 0
    dirt: int = 0
    missing: float = 0.0
    double: bool = False
    seed: int = 1


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture (h, w, 3) or (h, w) uint8 with the true centres (m, 2) of the dots drawn."""

    image: NDArray[np.uint8]
    centres_px: Vector
    diameter_px: Vector
    """(m,) of the disc of the same area."""
    drawn: NDArray[np.bool_]
    """(m,) false where a dot was left out."""
    dirt_px: Vector = field(default_factory=lambda: np.zeros((0, 2)))


def grid_of_dots(anchors: str = "odd_sized") -> MarkerGrid:
    """19 x 18 dots of 0.45 mm on a pitch of 1.1 mm."""
    return build_marker_grid(19, 18, 1.1, 0.45, anchors=anchors)  # type: ignore[arg-type]


def outlines(
    grid: MarkerGrid, camera: VirtualCamera, moved_mm: Vector | None = None, stretch: Vector = None
) -> Vector:
    """Rims (m, k, 2) in px of the dots; `moved_mm` (m, 2 or 3) shifts each dot on the gel."""
    turn = np.linspace(0, 2 * np.pi, _RIM, endpoint=False)
    disc = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(_RIM)])
    centre = np.zeros((len(grid), 3))
    centre[:, :2] = grid.positions_mm
    if moved_mm is not None:
        centre[:, : moved_mm.shape[1]] += moved_mm
    points = centre[:, None, :] + grid.diameter_mm[:, None, None] / 2 * disc
    return camera.project(points.reshape(-1, 3)).reshape(len(grid), _RIM, 2)


def centroids(rims: Vector) -> tuple[Vector, Vector]:
    """Area centroids (m, 2) and areas (m,) of closed outlines (m, k, 2), by Green's theorem."""
    following = np.roll(rims, -1, axis=1)
    cross = rims[..., 0] * following[..., 1] - following[..., 0] * rims[..., 1]
    area = cross.sum(axis=1) / 2
    centre = ((rims + following) * cross[..., None]).sum(axis=1) / (6 * area[:, None])
    return centre, np.abs(area)


def coverage(rim: Vector, shape: tuple[int, int]) -> tuple[slice, slice, Vector]:
    """Share of each pixel inside a convex outline (k, 2), with the box it stands in."""
    low = np.clip(np.floor(rim.min(axis=0) - 1).astype(int), 0, None)
    high = np.minimum(np.ceil(rim.max(axis=0) + 2).astype(int), [shape[1], shape[0]])
    if np.any(high <= low):
        return slice(0, 0), slice(0, 0), np.zeros((0, 0))
    offset = (np.arange(_SUB) + 0.5) / _SUB - 0.5
    x = (np.arange(low[0], high[0])[:, None] + offset).ravel()
    y = (np.arange(low[1], high[1])[:, None] + offset).ravel()
    left, right = _crossings(rim, y)
    inside = ((x >= left[:, None]) & (x <= right[:, None])).astype(float)
    rows, columns = high[1] - low[1], high[0] - low[0]
    share = inside.reshape(rows, _SUB, columns, _SUB).mean(axis=(1, 3))
    return slice(low[1], high[1]), slice(low[0], high[0]), share


def _crossings(rim: Vector, y: Vector) -> tuple[Vector, Vector]:
    """Where lines of constant y (n,) enter and leave a convex outline; empty ranges outside."""
    edge = (np.roll(rim, -1, axis=0) - rim) * np.sign(_turning(rim))
    slanted, falling = edge[:, 1] != 0, edge[:, 1] < 0
    slope = np.divide(edge[:, 0], edge[:, 1], out=np.zeros(len(rim)), where=slanted)
    x = rim[:, 0] + slope * (y[:, None] - rim[:, 1])
    left = np.where(falling, x, -np.inf).max(axis=1)
    right = np.where(slanted & ~falling, x, np.inf).min(axis=1)
    level = edge[:, 0] * (y[:, None] - rim[:, 1])
    right[np.any(~slanted & (level < 0), axis=1)] = -np.inf
    return left, right


def _turning(rim: Vector) -> float:
    following = np.roll(rim, -1, axis=0)
    return float(np.sum(rim[:, 0] * following[:, 1] - following[:, 0] * rim[:, 1]))


def render(
    grid: MarkerGrid,
    camera: VirtualCamera | None = None,
    look: Look | None = None,
    moved_mm: Vector | None = None,
) -> Frame:
    """Draw the grid as the camera sees it."""
    camera, look = camera or finger_view(), look or Look()
    rng = np.random.default_rng(look.seed)
    shape = (camera.image_height_px, camera.image_width_px)
    rims = outlines(grid, camera, moved_mm)
    centres, areas = centroids(rims)
    drawn = rng.random(len(grid)) >= look.missing
    ink = np.zeros(shape)
    for rim in rims[drawn]:
        parts = _halves(rim) if look.double else [rim]
        for part in parts:
            rows, columns, share = coverage(part, shape)
            ink[rows, columns] = np.maximum(ink[rows, columns], share)
    dirt = _dirt(ink, look, rng, float(np.sqrt(np.median(areas))))
    light = _light(shape, look)
    image = light * (1 - look.contrast * ink[..., None])
    _glare(image, look, rng)
    if look.blur > 0:
        image = gaussian_filter(image, (look.blur, look.blur, 0))
    if not look.colour:
        image = image.mean(axis=2, keepdims=True)
    image = image + rng.normal(0, 1, image.shape) * look.noise
    picture = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return Frame(
        image=picture if look.colour else picture[:, :, 0],
        centres_px=centres,
        diameter_px=np.sqrt(4 * areas / np.pi),
        drawn=drawn,
        dirt_px=dirt,
    )


def _halves(rim: Vector) -> list[Vector]:
    """Two discs side by side in place of one, with the same common centre."""
    centre = centroids(rim[None])[0][0]
    size = np.ptp(rim[:, 0])
    small = centre + 0.75 * (rim - centre)
    shift = np.array([0.42 * size, 0.0])
    return [small - shift, small + shift]


def _light(shape: tuple[int, int], look: Look) -> Vector:
    """Red from the left, green from the right, both falling off; blue weak and even."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    across = x / (shape[1] - 1)
    along = 1 - 0.3 * look.gradient * (y / (shape[0] - 1)) ** 2
    red = look.light * (1 - look.gradient * across) * along
    green = look.light * (1 - look.gradient * (1 - across)) * along
    return np.stack([red, green, 0.6 * look.light * along], axis=2)


def _dirt(ink: Vector, look: Look, rng: np.random.Generator, usual_px: float) -> Vector:
    """Dark specks and hairs, much smaller or much longer than dots."""
    places = rng.uniform([20, 20], [ink.shape[1] - 20, ink.shape[0] - 20], (look.dirt, 2))
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    for k, place in enumerate(places):
        angle, hair = rng.uniform(0, np.pi), k % 2 == 0
        long, short = (1.6 * usual_px, 0.7) if hair else (0.16 * usual_px, 0.13 * usual_px)
        c, s = np.cos(angle), np.sin(angle)
        rim = np.column_stack([long * np.cos(turn), short * np.sin(turn)]) @ [[c, s], [-s, c]]
        rows, columns, share = coverage(place + rim, ink.shape)
        ink[rows, columns] = np.maximum(ink[rows, columns], share)
    return places


def _glare(image: Vector, look: Look, rng: np.random.Generator) -> None:
    """Saturated spots of 2 to 5 px, in place."""
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    for _ in range(look.specular):
        cx, cy = rng.uniform(10, image.shape[1] - 10), rng.uniform(10, image.shape[0] - 10)
        radius = rng.uniform(1.0, 2.5)
        image[np.hypot(x - cx, y - cy) < radius] = 400.0
