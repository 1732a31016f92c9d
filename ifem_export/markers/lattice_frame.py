"""Where the sites of a lattice of markers lie, for lattices that are not square or not centred."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MarkerGridError

Array = NDArray[np.float64]
_LEAST_SINE = 0.2
"""Smallest sine of the angle between the rows and the columns of a lattice."""


@dataclass(frozen=True, eq=False)
class LatticeFrame:
    """The steps of a plane lattice and the place of its middle, in the sensor frame.

    Attributes:
        row_step_mm: (2,) from one row to the next.
        column_step_mm: (2,) from one column to the next.
        middle_mm: (2,) point in the middle between the first and the last row and column.

    Raises:
        MarkerGridError: A value is not finite, or the steps are nearly parallel.
    """

    row_step_mm: Array
    column_step_mm: Array
    middle_mm: Array

    def __post_init__(self) -> None:
        for name in ("row_step_mm", "column_step_mm", "middle_mm"):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != (2,) or not np.isfinite(value).all():
                raise MarkerGridError(
                    f"marker lattice: {name} must be two finite numbers", field=name
                )
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        across = abs(np.linalg.det(self.steps_mm))
        if not across > _LEAST_SINE * np.prod(np.hypot(*self.steps_mm.T)):
            raise MarkerGridError(
                "marker lattice: the steps along rows and columns are nearly parallel",
                field="column_step_mm",
            )

    @classmethod
    def square(cls, pitch_mm: float) -> LatticeFrame:
        """A square lattice along the axes, centred on the origin; rows follow x, columns y."""
        return cls(np.array([pitch_mm, 0.0]), np.array([0.0, pitch_mm]), np.zeros(2))

    @classmethod
    def fitted(
        cls, sites: ArrayLike, positions_mm: ArrayLike, shape: tuple[int, int]
    ) -> LatticeFrame:
        """The lattice with the least squared distance of sites (k, 2) from positions (k, 2)."""
        apart = np.asarray(sites, dtype=float) - (np.array(shape) - 1) / 2
        design = np.column_stack([apart, np.ones(len(apart))])
        rows, columns, middle = np.linalg.lstsq(design, np.asarray(positions_mm), rcond=None)[0]
        return cls(rows, columns, middle)

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> LatticeFrame:
        """The frame of a record made by `to_record`. Raises KeyError where a value is missing."""
        return cls(record["row_step_mm"], record["column_step_mm"], record["middle_mm"])

    def to_record(self) -> dict[str, list[float]]:
        """Plain values for a file."""
        return {
            "row_step_mm": self.row_step_mm.tolist(),
            "column_step_mm": self.column_step_mm.tolist(),
            "middle_mm": self.middle_mm.tolist(),
        }

    @property
    def steps_mm(self) -> Array:
        """Both steps as rows (2, 2)."""
        return np.array([self.row_step_mm, self.column_step_mm])

    @property
    def pitches_mm(self) -> tuple[float, float]:
        """Distances of neighbouring rows' and of neighbouring columns' dots."""
        row, column = np.hypot(*self.steps_mm.T)
        return float(row), float(column)

    @property
    def diagonals_mm(self) -> tuple[float, float]:
        """Distances of dots one row and one column apart, in the two directions."""
        a, b = self.row_step_mm, self.column_step_mm
        return float(np.hypot(*(a + b))), float(np.hypot(*(a - b)))

    def places_mm(self, sites: ArrayLike, shape: tuple[int, int]) -> Array:
        """Places (k, 2) of sites (k, 2) of a lattice with so many rows and columns."""
        apart = np.asarray(sites, dtype=float).reshape(-1, 2) - (np.array(shape) - 1) / 2
        places: Array = apart @ self.steps_mm + self.middle_mm
        return places
