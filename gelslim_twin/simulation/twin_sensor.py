"""What a simulation needs to know of a sensor: its bundle, read as pad, print and light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ifem_export.bundle.bundle import Bundle

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap
    from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True, eq=False)
class TwinSensor:
    """A sensor as the digital twin sees it. All of it comes from the bundle.

    Attributes:
        bundle: The sensor. Without an outline in it, the box of the mesh is that of the pad;
            without light, the pad is lit evenly red and green from its sides.
    """

    bundle: Bundle

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Surface nodes (c, 3) at rest in mm."""
        return np.asarray(self.bundle.mesh.surface_mm)

    @property
    def camera_record(self) -> Mapping[str, Any]:
        """The camera's parameters."""
        return self.bundle.camera

    @cached_property
    def grid(self) -> MarkerGrid:
        """The marker grid. Raises IfemError for a bundle without markers."""
        from gelslim_force.lattice.bundle_grid import bundle_grid

        return bundle_grid(self.bundle)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad in mm."""
        outline = self.bundle.outline
        if outline is not None:
            return outline.length_mm, outline.width_mm
        box = self.points_mm.max(axis=0) - self.points_mm.min(axis=0)
        return float(box[0]), float(box[1])

    @property
    def corner_radius_mm(self) -> float:
        """Radius of the pad's corners in mm."""
        return 0.0 if self.bundle.outline is None else self.bundle.outline.corner_radius_mm

    def light(self) -> LightMap:
        """The light on the untouched pad."""
        from gelslim_optics.light.light_map import LightMap, red_green_sides

        if self.bundle.light:
            return LightMap(**{n: np.asarray(v) for n, v in self.bundle.light.items()})
        length, width = self.size_mm
        return red_green_sides(length, width, decay_mm=0.8 * width)
