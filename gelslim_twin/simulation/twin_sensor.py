"""What a simulation needs to know about the sensor; the light only if it is looked at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ifem_export.bundle.bundle import Bundle

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap
    from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True, eq=False)
class TwinSensor:
    """A bundle, and how its pad is lit and cut.

    `lit` makes the light's map, when a picture asks for it; None lights the pad evenly red and
    green from its sides. Without an outline the mesh's box is the pad's.
    """

    bundle: Bundle
    lit: Callable[[], LightMap] | None = None
    length_mm: float | None = None
    width_mm: float | None = None
    corner_radius_mm: float = 0.0

    @property
    def points_mm(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """(c, 3) surface nodes at rest."""
        return np.asarray(self.bundle.mesh.surface_mm)

    @property
    def camera_record(self) -> Mapping[str, Any]:
        """The camera as the bundle has it."""
        return self.bundle.camera

    @cached_property
    def grid(self) -> MarkerGrid:
        """The print. Raises IfemError for a bundle without markers."""
        from gelslim_force.lattice.bundle_grid import bundle_grid

        return bundle_grid(self.bundle)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad."""
        low, high = self.points_mm.min(axis=0), self.points_mm.max(axis=0)
        box = high - low
        return float(self.length_mm or box[0]), float(self.width_mm or box[1])

    def light(self) -> LightMap:
        """The light on the pad."""
        if self.lit is not None:
            return self.lit()
        from gelslim_optics.light.light_map import red_green_sides

        length, width = self.size_mm
        return red_green_sides(length, width, decay_mm=0.8 * width)
