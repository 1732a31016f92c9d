"""Marker frames drawn for the tests: every dot's true centre is the centroid of its image.

A dot is a disc on the gel; its rim is projected point by point through the camera, filled with
4 x 4 samples per pixel, and its centre is the area centroid of that outline (which is not the
projection of the disc's centre).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

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


def rims_mm(grid: MarkerGrid) -> Vector:
    """(m, k, 2) places at rest of the points of the dots' rims."""
    turn = np.linspace(0, 2 * np.pi, _RIM, endpoint=False)
    disc = np.column_stack([np.cos(turn), np.sin(turn)])
    return grid.positions_mm[:, None, :] + grid.diameter_mm[:, None, None] / 2 * disc


def moved_rims(motion: Callable[[Vector], Vector], grid: MarkerGrid) -> Vector:
    """(m, k, 3) motion of the rims by a motion of the surface, places (n, 2) to (n, 3)."""
    places = rims_mm(grid)
    return motion(places.reshape(-1, 2)).reshape(*places.shape[:2], 3)


def outlines(grid: MarkerGrid, camera: VirtualCamera, moved_mm: Vector | None = None) -> Vector:
    """Rims (m, k, 2) in px of the dots.

    Args:
        grid: The dots.
        camera: What sees them.
        moved_mm: Their motion on the gel: (m, 2 or 3) of whole dots, or (m, k, 3) of the points of
            their rims, which strains the dots.
    """
    flat = rims_mm(grid)
    points = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)
    if moved_mm is not None:
        moved = moved_mm if moved_mm.ndim == 3 else moved_mm[:, None, :]
        points[..., : moved.shape[2]] += moved
    return camera.project(points.reshape(-1, 3)).reshape(len(grid), _RIM, 2)


def centroids(rims: Vector) -> tuple[Vector, Vector]:
    """Area centroids (m, 2) and areas (m,) of closed outlines (m, k, 2), by Green's theorem."""
    following = np.roll(rims, -1, axis=1)
    cross = rims[..., 0] * following[..., 1] - following[..., 0] * rims[..., 1]
    area = cross.sum(axis=1) / 2
    centre = ((rims + following) * cross[..., None]).sum(axis=1) / (6 * area[:, None])
    return centre, np.abs(area)


def paint(ink: Vector, rims: Vector) -> None:
    """Fill convex outlines (n, k, 2), in place: `ink` (h, w) is the share of a pixel inside."""
    low = np.clip(np.floor(rims.min(axis=1) - 1).astype(int), 0, None)
    high = np.minimum(np.ceil(rims.max(axis=1) + 2).astype(int), ink.shape[::-1])
    seen = np.all(high > low, axis=1)
    if not seen.any():
        return
    low, high, rims = low[seen], high[seen], rims[seen]
    offset = (np.arange(_SUB) + 0.5) / _SUB - 0.5
    x, y = (
        (low[:, axis, None, None] + np.arange(size)[:, None] + offset).reshape(len(low), -1)
        for axis, size in enumerate((high - low).max(axis=0))
    )
    left, right = _crossings(rims, y)
    inside = (x[:, None] >= left[..., None]) & (x[:, None] <= right[..., None])
    samples = [inside[:, k::_SUB, m::_SUB] for k in range(_SUB) for m in range(_SUB)]
    share = np.add.reduce(samples, dtype=np.uint8) / _SUB**2
    for (x0, y0), (x1, y1), filled in zip(low.tolist(), high.tolist(), share, strict=True):
        box = ink[y0:y1, x0:x1]
        np.maximum(box, filled[: y1 - y0, : x1 - x0], out=box)


def _crossings(rims: Vector, y: Vector) -> tuple[Vector, Vector]:
    """Where lines of constant y (n, l) enter and leave convex outlines; empty ranges outside."""
    rims = np.moveaxis(rims, 0, 2)
    following = np.roll(rims, -1, axis=0)
    turning = np.sum(rims[:, 0] * following[:, 1] - following[:, 0] * rims[:, 1], axis=0)
    across, along = np.moveaxis((following - rims) * np.sign(turning), 1, 0)
    slanted, falling = along != 0, along < 0
    slope = np.divide(across, along, out=np.zeros(along.shape), where=slanted)
    left, right = np.full(y.shape, -np.inf), np.full(y.shape, np.inf)
    for k, (x0, y0) in enumerate(rims):
        x = x0[:, None] + slope[k][:, None] * (y - y0[:, None])
        np.maximum(left, x, out=left, where=falling[k][:, None])
        np.minimum(right, x, out=right, where=(slanted & ~falling)[k][:, None])
    for k, n in np.argwhere(~slanted):
        right[n, across[k, n] * (y[n] - rims[k, 1, n]) < 0] = -np.inf
    return left, right


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
    paint(ink, _halves(rims[drawn]) if look.double else rims[drawn])
    dirt = _dirt(ink, look, rng, float(np.sqrt(np.median(areas))))
    light = _light(shape, look.light, look.gradient)
    image = light * (1 - look.contrast * ink[..., None])
    _glare(image, look, rng)
    if look.blur > 0:
        image = gaussian_filter(image, (look.blur, look.blur, 0))
    if not look.colour:
        image = image.mean(axis=2, keepdims=True)
    if look.noise > 0:
        image = image + rng.normal(0, 1, image.shape) * look.noise
    picture = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return Frame(
        image=picture if look.colour else picture[:, :, 0],
        centres_px=centres,
        diameter_px=np.sqrt(4 * areas / np.pi),
        drawn=drawn,
        dirt_px=dirt,
    )


def _halves(rims: Vector) -> Vector:
    """Two discs (2 n, k, 2) side by side in place of each one, with the same common centre."""
    centre = centroids(rims)[0][:, None]
    small = centre + 0.75 * (rims - centre)
    shift = np.zeros((len(rims), 1, 2))
    shift[:, 0, 0] = 0.42 * np.ptp(rims[..., 0], axis=1)
    return np.concatenate([small - shift, small + shift])


@cache
def _light(shape: tuple[int, int], level: float, gradient: float) -> Vector:
    """Red from the left, green from the right, both falling off; blue weak and even."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    across = x / (shape[1] - 1)
    along = 1 - 0.3 * gradient * (y / (shape[0] - 1)) ** 2
    red = level * (1 - gradient * across) * along
    green = level * (1 - gradient * (1 - across)) * along
    return np.stack([red, green, 0.6 * level * along], axis=2)


def _dirt(ink: Vector, look: Look, rng: np.random.Generator, usual_px: float) -> Vector:
    """Dark specks and hairs, much smaller or much longer than dots."""
    places = rng.uniform([20, 20], [ink.shape[1] - 20, ink.shape[0] - 20], (look.dirt, 2))
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    for k, place in enumerate(places):
        angle, hair = rng.uniform(0, np.pi), k % 2 == 0
        long, short = (1.6 * usual_px, 0.7) if hair else (0.16 * usual_px, 0.13 * usual_px)
        c, s = np.cos(angle), np.sin(angle)
        rim = np.column_stack([long * np.cos(turn), short * np.sin(turn)]) @ [[c, s], [-s, c]]
        paint(ink, (place + rim)[None])
    return places


def _glare(image: Vector, look: Look, rng: np.random.Generator) -> None:
    """Saturated spots of 2 to 5 px, in place."""
    if not look.specular:
        return
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    for _ in range(look.specular):
        cx, cy = rng.uniform(10, image.shape[1] - 10), rng.uniform(10, image.shape[0] - 10)
        radius = rng.uniform(1.0, 2.5)
        image[np.hypot(x - cx, y - cy) < radius] = 400.0
