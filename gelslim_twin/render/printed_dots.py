"""The dots as printed on the gel, before it is deformed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PrintedDots:
    """Ellipses of ink on the rest surface: centres (m, 2), semi-axes (m, 2), turn (m,)."""

    centres_mm: Array
    semi_axes_mm: Array
    turn_rad: Array
    present: NDArray[np.bool_]

    @classmethod
    def nominal(cls, grid: MarkerGrid) -> PrintedDots:
        """A perfect print of a marker grid: round dots in their places."""
        half = np.asarray(grid.diameter_mm, dtype=float) / 2
        return cls(
            centres_mm=np.array(grid.positions_mm, dtype=float),
            semi_axes_mm=np.column_stack([half, half]),
            turn_rad=np.zeros(len(half)),
            present=np.ones(len(half), dtype=bool),
        )

    def __len__(self) -> int:
        return len(self.centres_mm)

    def rim_mm(self, count: int, scale: float = 1.0) -> Array:
        """Points (m, count, 2) on the rims, whose semi-axes are stretched by `scale`."""
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        u = self.semi_axes_mm[:, :1] * np.cos(angle) * scale
        v = self.semi_axes_mm[:, 1:] * np.sin(angle) * scale
        c, s = np.cos(self.turn_rad)[:, None], np.sin(self.turn_rad)[:, None]
        offset = np.stack([c * u - s * v, s * u + c * v], axis=2)
        rim: Array = self.centres_mm[:, None, :] + offset
        return rim
