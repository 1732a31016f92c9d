"""Where the rays of pixels meet the surface that is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.rays import check_above, points_along
from gelslim_optics.camera.refraction import LayerStack

Array = NDArray[np.float64]
Outside = Literal["raise", "nan"]

# Heights at which a ray is compared with a surface that it might cross more than once.
LEVELS = 33
TOLERANCE_MM = 1e-13
MAX_STEPS = 200


@dataclass(frozen=True)
class HeightGrid:
    """A surface z(x, y) given by samples, bilinear between them.

    Attributes:
        x_mm: Increasing coordinates (nx,), two or more.
        y_mm: Increasing coordinates (ny,), two or more.
        z_mm: Heights (ny, nx).

    Raises:
        ValueError: An axis does not increase, the shapes do not fit, or a value is not finite.
    """

    x_mm: Array
    y_mm: Array
    z_mm: Array

    def __post_init__(self) -> None:
        for name in ("x_mm", "y_mm", "z_mm"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        for name in ("x_mm", "y_mm"):
            axis = getattr(self, name)
            if axis.ndim != 1 or len(axis) < 2 or not np.all(np.diff(axis) > 0):
                raise ValueError(f"{name} of a height grid must be two or more increasing values")
        if self.z_mm.shape != (len(self.y_mm), len(self.x_mm)):
            raise ValueError(
                f"z_mm of a height grid has shape {self.z_mm.shape}: with {len(self.y_mm)} rows "
                f"(y) and {len(self.x_mm)} columns (x) it must be "
                f"({len(self.y_mm)}, {len(self.x_mm)})"
            )
        if not all(np.isfinite(a).all() for a in (self.x_mm, self.y_mm, self.z_mm)):
            raise ValueError("a height grid must have finite values")

    def __call__(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Heights at points of any shape; outside the grid that of the nearest edge point."""
        i, u = _cell(self.x_mm, np.asarray(x_mm, dtype=float))
        j, v = _cell(self.y_mm, np.asarray(y_mm, dtype=float))
        z = self.z_mm
        low = z[j, i] * (1 - u) + z[j, i + 1] * u
        high = z[j + 1, i] * (1 - u) + z[j + 1, i + 1] * u
        return np.asarray(low * (1 - v) + high * v, dtype=float)

    def contains(
        self, x_mm: ArrayLike, y_mm: ArrayLike, margin_mm: float = 1e-9
    ) -> NDArray[np.bool_]:
        """Whether points of any shape are on the grid, its edge included."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        inside = (x >= self.x_mm[0] - margin_mm) & (x <= self.x_mm[-1] + margin_mm)
        inside &= (y >= self.y_mm[0] - margin_mm) & (y <= self.y_mm[-1] + margin_mm)
        return np.asarray(inside)

    @property
    def max_gradient(self) -> float:
        """Upper bound of the size of the gradient."""
        along = np.abs(np.diff(self.z_mm, axis=1) / np.diff(self.x_mm)).max()
        across = np.abs(np.diff(self.z_mm, axis=0) / np.diff(self.y_mm)[:, None]).max()
        return float(np.hypot(along, across))


Surface = float | HeightGrid | Callable[[Array, Array], ArrayLike]


def surface_points(
    pinhole_mm: Array,
    stack: LayerStack,
    slopes: Array,
    surface: Surface,
    z_range_mm: tuple[float, float] | None,
    outside: Outside,
) -> Array:
    """Points (n, 3) where the rays with `slopes` (n, 2) in air meet `surface` first.

    See `VirtualCamera.backproject`; a function needs `z_range_mm`.

    Raises:
        ValueError: A choice or a range cannot be used, or a ray misses the surface and `outside`
            is "raise".
    """
    if outside not in ("raise", "nan"):
        raise ValueError(f'outside = {outside!r} must be "raise" or "nan"')
    if not (isinstance(surface, HeightGrid) or callable(surface)):
        height = float(surface)
        _check_range(pinhole_mm, height, height)
        points = points_along(pinhole_mm, stack, slopes, np.full(len(slopes), height))
        points[np.isnan(slopes).any(axis=1)] = np.nan
        return points
    low, high = z_range_mm or _height_range(surface)
    _check_range(pinhole_mm, low, high)
    levels = 2 if _met_once(stack, slopes, surface) else LEVELS
    view = (pinhole_mm, stack)
    z = _first_crossing(view, slopes, surface, np.linspace(low, high, levels))
    points = points_along(*view, slopes, z)
    if isinstance(surface, HeightGrid):
        points[np.logical_not(surface.contains(points[:, 0], points[:, 1]))] = np.nan
    _check_met(points, slopes, outside)
    return points


def _height_range(surface: Surface) -> tuple[float, float]:
    """Heights of a grid, with a margin for rounding."""
    if not isinstance(surface, HeightGrid):
        raise ValueError("a surface given by a function needs z_range_mm")
    low, high = float(surface.z_mm.min()), float(surface.z_mm.max())
    margin = 1e-6 * max(1.0, abs(low), abs(high))
    return low - margin, high + margin


def _check_range(pinhole_mm: Array, low: float, high: float) -> None:
    if not (np.isfinite(low) and np.isfinite(high) and low <= high):
        raise ValueError(f"heights from {low:g} to {high:g} mm: give finite ones, the lower first")
    check_above(pinhole_mm, np.array([low]))


def _met_once(stack: LayerStack, slopes: Array, surface: Surface) -> bool:
    """Whether every ray is steeper than the grid anywhere, and so crosses it only once."""
    if not isinstance(surface, HeightGrid) or not len(slopes):
        return False
    squared = np.nanmax(np.append((slopes**2).sum(axis=1), 0.0))
    n = min(stack.indices[1:], default=1.0)
    slope_in_medium = np.sqrt(squared / (n * n + (n - 1) * (n + 1) * squared))
    above_window = surface.z_mm.min() - 1e-3 >= stack.tops_mm[0]
    return bool(above_window and slope_in_medium * surface.max_gradient < 0.9)


def _first_crossing(
    view: tuple[Array, LayerStack],
    slopes: Array,
    surface: HeightGrid | Callable[[Array, Array], ArrayLike],
    levels: Array,
) -> Array:
    """Height (n,) at which each ray first crosses the surface from below, or NaN."""

    def gap(z: Array, rays: Array) -> Array:
        points = points_along(*view, rays, z)
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
    z[found] = _false_position(
        lambda at, k: gap(at, slopes[found[k]]),
        (low[found], high[found]),
        (gap_low[found], gap_high[found]),
    )
    return z


def _false_position(
    gap: Callable[[Array, NDArray[np.intp]], Array],
    ends: tuple[Array, Array],
    gaps: tuple[Array, Array],
) -> Array:
    """Roots between `ends` by the Illinois variant of false position (Dowell and Jarratt 1971)."""
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
    raise ValueError(f"{len(k)} rays do not converge to the surface: it must be continuous")


def _check_met(points: Array, slopes: Array, outside: Outside) -> None:
    missed = np.isnan(points).any(axis=1) & ~np.isnan(slopes).any(axis=1)
    if outside == "raise" and missed.any():
        raise ValueError(
            f"{int(missed.sum())} of {len(points)} pixels see no point of the surface: "
            'choose other pixels, a larger surface or z_range_mm, or outside="nan"'
        )


def _cell(axis: Array, at: Array) -> tuple[NDArray[np.intp], Array]:
    """Number of the cell and fraction within it, limited to the axis; NaN stays NaN."""
    limited = np.clip(at, axis[0], axis[-1])
    number = np.clip(np.searchsorted(axis, limited, side="right") - 1, 0, len(axis) - 2)
    return number, (limited - axis[number]) / (axis[number + 1] - axis[number])
