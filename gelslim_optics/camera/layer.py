"""Flat refracting layers and what a ray crosses of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """A flat layer above the air: thickness and refractive index, camera side first.

    Raises ValueError for a thickness below zero or an index below that of air.
    """

    thickness_mm: float
    index: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.thickness_mm) and self.thickness_mm >= 0):
            raise ValueError(
                f"a layer is {self.thickness_mm} mm thick: it must be finite and not below zero"
            )
        if not (math.isfinite(self.index) and self.index >= 1):
            raise ValueError(
                f"a layer has a refractive index of {self.index}: relative to air it must be "
                "finite and at least 1"
            )


@dataclass(frozen=True)
class LayerStack:
    """Air from `start_z_mm` (the pinhole) up to the first layer, then the layers upwards.

    The last layer has no end: a gel pressed or pulled out of its plane stays gel.
    """

    start_z_mm: float
    tops_mm: tuple[float, ...]
    indices: tuple[float, ...]

    @classmethod
    def above(cls, start_z_mm: float, bottom_z_mm: float, layers: tuple[Layer, ...]) -> LayerStack:
        """The stack of `layers` whose lowest face is at `bottom_z_mm`."""
        faces = bottom_z_mm + np.cumsum([0.0, *(layer.thickness_mm for layer in layers)])
        return cls(
            start_z_mm,
            (*faces[:-1].tolist(), math.inf),
            (1.0, *(layer.index for layer in layers)),
        )

    def crossed_mm(self, z_mm: Array) -> list[Array]:
        """Height of each medium, air first, between the pinhole and `z_mm` (any shape)."""
        heights: list[Array] = []
        floor = self.start_z_mm
        for top in self.tops_mm:
            heights.append(np.maximum(np.minimum(z_mm, top) - floor, 0.0))
            floor = max(floor, top)
        return heights

    def index_at(self, z_mm: Array) -> Array:
        """Refractive index at heights `z_mm` (any shape); on a face, that of the medium above."""
        number = np.searchsorted(self.tops_mm, z_mm, side="right")
        return np.asarray(self.indices)[np.minimum(number, len(self.indices) - 1)]
