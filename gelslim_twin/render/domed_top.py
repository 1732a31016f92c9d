"""The gel's outer surface at rest where it is domed: heights under the plane z = 0 at its apex.

A motion of the dome is drawn as a motion of that plane, heights included: dots, the points that
rays meet and slopes then follow by the same formulas as on a flat gel.
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
    """Heights as `rest`, whose lateral motion is zero."""

    rest: SurfaceState

    @classmethod
    def of_nodes(cls, nodes_mm: ArrayLike) -> DomedTop | None:
        """The top through surface nodes (n, 3) of a regular mesh; None for a flat one at z = 0."""
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
        """A motion of the dome (None: at rest) as one of the plane."""
        if motion is None:
            return self.rest
        raised = motion.displacement_mm.copy()
        raised[..., 2] += self._heights_at(motion)
        return replace(motion, displacement_mm=raised)

    def seen_mm(self, sight: Sight) -> Array:
        """Points (h, w, 2) of the dome at rest that the rays of `sight` meet."""
        start = sight.rest_mm.reshape(-1, 2)
        lean, at = sight.lean.reshape(-1, 2), start
        for _ in range(_ROUNDS):
            moved = start + lean * self.height_mm(at)[:, None]
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
