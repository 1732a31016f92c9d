"""Markers and pictures of displaced surfaces, one after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState

if TYPE_CHECKING:
    from gelslim_twin.simulation.picture import Viewer

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SingleDrawing:
    """Draws one surface after the other."""

    view: Callable[[], Viewer]

    def markers_px(self, displacement_mm: Array) -> Array:
        """Images (k, m, 2) of the dots' centres under displacements (k, c, 3)."""
        view = self.view()
        found = [view.markers_px(_still(one)) for one in displacement_mm]
        return np.array(found).reshape(len(found), len(view.sensor.grid.positions_mm), 2)

    def images(self, displacement_mm: Array, numbers: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Pictures (k, h, w, 3) or (k, h, w); the noise is that of a step of the next number."""
        view = self.view()
        camera = view.camera
        size = (camera.image_height_px, camera.image_width_px)
        shape = size if view.renderer.mono else (*size, 3)
        found = np.empty((len(numbers), *shape), dtype=np.uint8)
        for image, moved, number in zip(found, displacement_mm, numbers, strict=True):
            image[:] = view.frame(_still(moved), None, int(number) + 1, 0.0).image
        return found


def _still(displacement_mm: Array) -> GelState:
    nothing = np.zeros_like(displacement_mm)
    return GelState(displacement_mm, nothing, np.zeros(len(nothing), dtype=np.int8))
