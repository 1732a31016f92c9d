"""From pixels back to the surface that is seen."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.height_field import HeightGrid
from gelslim_optics.camera.rays import points_along

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Surface = float | HeightGrid | Callable[[Array, Array], ArrayLike]
Outside = Literal["raise", "nan"]

# Heights at which a ray is held against a surface that it might cross more than once.
LEVELS = 33
TOLERANCE_MM = 1e-13
MAX_STEPS = 200


def pixel_slopes(camera: VirtualCamera, pixels: ArrayLike) -> Array:
    """Parts along x and y (n, 2), per unit of height, of the rays in air behind pixels (n, 2).

    Raises ValueError for pixels whose ray does not rise to the window.
    """
    uv = np.atleast_2d(np.asarray(pixels, dtype=float))
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise ValueError(f"pixels have shape {np.shape(pixels)}: give (n, 2), u and v in px")
    xy = (uv - camera.principal_px) / camera.focal_px
    if camera.lens is not None:
        xy = camera.lens.undistort(xy)
    ray = xy[:, :1] * camera.right + xy[:, 1:] * camera.down + camera.forward
    level = ray[:, 2] <= 0
    if level.any():
        first = uv[np.argmax(level)]
        raise ValueError(
            f"{int(level.sum())} of {len(uv)} pixels, such as ({first[0]:g}, {first[1]:g}), look "
            "along or away from the window and see no point of it"
        )
    return ray[:, :2] / ray[:, 2:]


def backproject(
    camera: VirtualCamera,
    pixels: ArrayLike,
    surface: Surface = 0.0,
    *,
    z_range_mm: tuple[float, float] | None = None,
    outside: Outside = "raise",
) -> Array:
    """Points (n, 3) in mm on a surface, seen at pixels (n, 2); NaN pixels give NaN.

    `surface` is a height z in mm, a `HeightGrid`, or a function of arrays x and y (n,) that
    returns heights. A curved surface is met at the first crossing from the camera's side, found
    between the heights `z_range_mm` (by default the grid's, or from the gel's back to one gel
    thickness above its surface) by a scan of 33 levels and closed in to 1e-13 mm; a grid too
    flat to be crossed twice needs no scan. Rays that miss the surface raise ValueError, or give
    NaN with `outside="nan"`.
    """
    if outside not in ("raise", "nan"):
        raise ValueError(f'outside = {outside!r}: "raise" and "nan" are possible')
    slopes = pixel_slopes(camera, pixels)
    if isinstance(surface, HeightGrid) or callable(surface):
        low, high = z_range_mm or _heights(camera, surface)
        _check_range(camera, low, high)
        levels = 2 if _met_once(camera, slopes, surface) else LEVELS
        z = _first_crossing(camera, slopes, surface, np.linspace(low, high, levels))
        points = points_along(camera, slopes, z)
        if isinstance(surface, HeightGrid):
            points[np.logical_not(surface.contains(points[:, 0], points[:, 1]))] = np.nan
        _check_met(points, slopes, outside)
        return points
    height = float(surface)
    _check_range(camera, height, height)
    points = points_along(camera, slopes, np.full(len(slopes), height))
    points[np.isnan(slopes).any(axis=1)] = np.nan
    return points


def _heights(camera: VirtualCamera, surface: Surface) -> tuple[float, float]:
    """Heights between which the surface is looked for."""
    if isinstance(surface, HeightGrid):
        low, high = float(surface.z_mm.min()), float(surface.z_mm.max())
        slack = 1e-6 * max(1.0, abs(low), abs(high))
        return low - slack, high + slack
    if not camera.layers or camera.layers[-1].thickness_mm == 0:
        raise ValueError("a camera without a gel layer needs z_range_mm, where to look")
    gel = camera.layers[-1].thickness_mm
    back = camera.stack.tops_mm[-2]
    return back, back + 2 * gel


def _check_range(camera: VirtualCamera, low: float, high: float) -> None:
    if not (np.isfinite(low) and np.isfinite(high) and low <= high):
        raise ValueError(f"heights from {low:g} to {high:g} mm: give finite ones, the lower first")
    if low <= camera.position_mm[2]:
        raise ValueError(
            f"the surface at z = {low:g} mm does not lie above the virtual pinhole at "
            f"{camera.position_mm[2]:g} mm"
        )


def _met_once(camera: VirtualCamera, slopes: Array, surface: Surface) -> bool:
    """Whether every ray rises faster than a grid can: then it crosses it once."""
    if not isinstance(surface, HeightGrid) or not len(slopes):
        return False
    squared = np.nanmax(np.append((slopes**2).sum(axis=1), 0.0))
    n = min(camera.stack.indices[1:], default=1.0)
    lean = np.sqrt(squared / (n * n + (n - 1) * (n + 1) * squared))
    above_window = surface.z_mm.min() - 1e-3 >= camera.window_bottom_z_mm
    return bool(above_window and lean * surface.steepest < 0.9)


def _first_crossing(
    camera: VirtualCamera,
    slopes: Array,
    surface: HeightGrid | Callable[[Array, Array], ArrayLike],
    levels: Array,
) -> Array:
    """Height (n,) of each ray's first crossing from below, NaN where there is none."""

    def gap(z: Array, rays: Array) -> Array:
        points = points_along(camera, rays, z)
        height = np.asarray(surface(points[:, 0], points[:, 1]), dtype=float)
        if height.shape not in ((), z.shape):
            raise ValueError(
                f"the surface gave heights of shape {height.shape} for {z.shape} points"
            )
        return z - height

    low = np.full(len(slopes), np.nan)
    high, gap_low, gap_high = low.copy(), low.copy(), low.copy()
    before = gap(np.full(len(slopes), levels[0]), slopes)
    for under, over in pairwise(levels):
        after = gap(np.full(len(slopes), over), slopes)
        new = np.isnan(low) & (before <= 0) & (after >= 0)
        low[new], high[new] = under, over
        gap_low[new], gap_high[new] = before[new], after[new]
        before = after
    found = np.flatnonzero(~np.isnan(low))
    z = np.full(len(slopes), np.nan)
    z[found] = _closed_in(
        lambda at, k: gap(at, slopes[found[k]]),
        (low[found], high[found]),
        (gap_low[found], gap_high[found]),
    )
    return z


def _closed_in(
    gap: Callable[[Array, NDArray[np.intp]], Array],
    ends: tuple[Array, Array],
    gaps: tuple[Array, Array],
) -> Array:
    """Roots between `ends` by false position with the Illinois halving (Dowell, Jarratt 1971)."""
    (a, b), (ga, gb) = (e.copy() for e in ends), (g.copy() for g in gaps)
    swap = np.abs(ga) < np.abs(gb)
    a[swap], b[swap], ga[swap], gb[swap] = b[swap], a[swap], gb[swap], ga[swap]
    for _ in range(MAX_STEPS):
        k = np.flatnonzero((np.abs(gb) > TOLERANCE_MM) & (np.abs(b - a) > TOLERANCE_MM))
        if not len(k):
            return b
        c = b[k] - gb[k] * (b[k] - a[k]) / (gb[k] - ga[k])
        gc = gap(c, k)
        crossed = (gc > 0) != (gb[k] > 0)
        a[k] = np.where(crossed, b[k], a[k])
        ga[k] = np.where(crossed, gb[k], ga[k] / 2)
        b[k], gb[k] = c, gc
    raise ValueError(f"{len(k)} rays do not settle on the surface: it must be continuous")


def _check_met(points: Array, slopes: Array, outside: Outside) -> None:
    missed = np.isnan(points).any(axis=1) & ~np.isnan(slopes).any(axis=1)
    if outside == "raise" and missed.any():
        raise ValueError(
            f"{int(missed.sum())} of {len(points)} pixels see no point of the surface: "
            'choose pixels on it, a larger surface or z_range_mm, or outside="nan"'
        )
