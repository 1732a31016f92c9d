"""A surface z(x, y) given by samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HeightGrid:
    """Heights `z_mm` (len(y), len(x)) at increasing `x_mm` and `y_mm`, bilinear in between.

    Raises ValueError for axes that do not increase, shapes that do not fit, values not finite.
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
            raise ValueError("a height grid must have finite values: fill in missing heights first")

    def __call__(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Heights at points (any shape); beyond the edge, that of the nearest edge point."""
        i, u = _cell(self.x_mm, np.asarray(x_mm, dtype=float))
        j, v = _cell(self.y_mm, np.asarray(y_mm, dtype=float))
        z = self.z_mm
        low = z[j, i] * (1 - u) + z[j, i + 1] * u
        high = z[j + 1, i] * (1 - u) + z[j + 1, i + 1] * u
        return np.asarray(low * (1 - v) + high * v, dtype=float)

    def contains(
        self, x_mm: ArrayLike, y_mm: ArrayLike, slack_mm: float = 1e-9
    ) -> NDArray[np.bool_]:
        """Whether points (any shape) are on the grid, its edge included."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        inside = (x >= self.x_mm[0] - slack_mm) & (x <= self.x_mm[-1] + slack_mm)
        inside &= (y >= self.y_mm[0] - slack_mm) & (y <= self.y_mm[-1] + slack_mm)
        return np.asarray(inside)

    @property
    def steepest(self) -> float:
        """Upper bound of the gradient's size: the steepest sides of a cell, together."""
        along = np.abs(np.diff(self.z_mm, axis=1) / np.diff(self.x_mm)).max()
        across = np.abs(np.diff(self.z_mm, axis=0) / np.diff(self.y_mm)[:, None]).max()
        return float(np.hypot(along, across))


def _cell(axis: Array, at: Array) -> tuple[NDArray[np.intp], Array]:
    """Cell number and fraction within it, held to the axis' ends; NaN stays NaN."""
    held = np.clip(at, axis[0], axis[-1])
    number = np.clip(np.searchsorted(axis, held, side="right") - 1, 0, len(axis) - 2)
    return number, (held - axis[number]) / (axis[number + 1] - axis[number])
