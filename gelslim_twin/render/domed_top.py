"""The outer surface of a crowned gel at rest: heights relative to the plane z = 0 at its apex.

A displacement of the crowned surface is treated as one of that plane that includes the heights.
Dots, intersections of rays and slopes then follow by the same formulas as on a flat gel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_twin.render.surface_state import SurfaceState

if TYPE_CHECKING:
    from gelslim_twin.render.sight import Sight

Array = NDArray[np.float64]
_ROUNDS = 12
_NEAR_MM = 1e-5


@dataclass(frozen=True, eq=False)
class DomedTop:
    """The heights, as a displacement `rest` without lateral part."""

    rest: SurfaceState

    @classmethod
    def of_nodes(cls, nodes_mm: ArrayLike) -> DomedTop | None:
        """The surface through nodes (n, 3) of a regular mesh; None for a flat one at z = 0."""
        nodes = np.asarray(nodes_mm, dtype=float)
        if not nodes[:, 2].any():
            return None
        raised = np.zeros((len(nodes), 3))
        raised[:, 2] = nodes[:, 2]
        return cls(SurfaceState.from_nodes(nodes, raised))

    def height_mm(self, points_mm: Array) -> Array:
        """Heights (n,) at points (n, 2)."""
        return np.asarray(self.rest.at(points_mm)[:, 2])

    def carrying(self, motion: SurfaceState | None) -> SurfaceState:
        """A displacement of the crowned surface (None: at rest) as one of the plane."""
        if motion is None:
            return self.rest
        raised = motion.displacement_mm.copy()
        raised[..., 2] += self._heights_at(motion)
        return replace(motion, displacement_mm=raised)

    def seen_mm(self, sight: Sight) -> Array:
        """Points (h, w, 2) of the crowned surface at rest where the rays of `sight` meet it."""
        start = sight.rest_mm.reshape(-1, 2)
        slope, at = sight.slope.reshape(-1, 2), start
        for _ in range(_ROUNDS):
            moved = start + slope * self.height_mm(at)[:, None]
            left = float(np.abs(moved - at).max())
            at = moved
            if left < _NEAR_MM:
                break
        return np.asarray(at.reshape(sight.rest_mm.shape))

    def _heights_at(self, motion: SurfaceState) -> Array:
        if np.array_equal(motion.x_mm, self.rest.x_mm) and np.array_equal(
            motion.y_mm, self.rest.y_mm
        ):
            return self._heights
        grid = np.stack(np.meshgrid(motion.x_mm, motion.y_mm), axis=2)
        return self.height_mm(grid.reshape(-1, 2)).reshape(grid.shape[:2])

    @cached_property
    def _heights(self) -> Array:
        return np.asarray(self.rest.displacement_mm[..., 2])
