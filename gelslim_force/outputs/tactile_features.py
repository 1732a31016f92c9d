"""Results of the force pipeline as arrays of fixed shapes, as learning takes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.wrench_csv import AXES

Array = NDArray[np.float64]
Features = Mapping[str, NDArray[np.float32]]
SCALARS: Mapping[str, tuple[str, ...]] = {
    "wrench": AXES,
    "wrench_sigma": tuple(f"sigma_{axis}" for axis in AXES),
    "known": ("tangential_known", "normal_known"),
    "contact": ("contact",),
}
"""Features that are few numbers, with the name of each."""


@dataclass(frozen=True, eq=False)
class ForceGrid:
    """A coarse grid that carries the forces of the surface nodes.

    Each node shares its force among the four grid points around it, in bilinear parts. Sum and
    first moments of the forces are kept: the grid has the same resultant and, for a flat pad, the
    same torque.

    Attributes:
        shape: Rows, from the lowest y, and columns, from the lowest x.
        points_mm: (rows, columns, 2) grid points, which span the nodes.
    """

    shape: tuple[int, int]
    points_mm: Array
    _cells: NDArray[np.int64]
    _shares: Array

    @classmethod
    def of(cls, nodes_mm: Array, shape: tuple[int, int]) -> ForceGrid:
        """A grid over nodes (c, 2 or 3). Raises ValueError for less than 2 rows or columns."""
        rows, columns = shape
        if min(shape) < 2:
            raise ValueError(f"grid = {rows}, {columns}: must have at least 2 rows and 2 columns")
        x, y = nodes_mm[:, 0], nodes_mm[:, 1]
        axes = np.linspace(x.min(), x.max(), columns), np.linspace(y.min(), y.max(), rows)
        i, u = _place(x, axes[0])
        j, v = _place(y, axes[1])
        cells = np.stack([(j + dj) * columns + i + di for dj in (0, 1) for di in (0, 1)])
        shares = np.stack([b * a for b in (1 - v, v) for a in (1 - u, u)])
        return cls(shape, np.stack(np.meshgrid(*axes), axis=-1), cells, shares)

    def carried(self, force_n: Array) -> Array:
        """(rows, columns, 3) forces in N for those of the nodes (c, 3); NaN stays unknown."""
        count = self.shape[0] * self.shape[1]
        parts: list[Array] = []
        for k in range(3):
            shares = (self._shares * force_n[:, k]).ravel()
            parts.append(np.bincount(self._cells.ravel(), shares, count).astype(np.float64))
        return np.stack(parts, axis=-1).reshape(*self.shape, 3)


def _place(at: Array, axis: Array) -> tuple[NDArray[np.int64], Array]:
    """The grid line below each coordinate, and how far it is to the next one, from 0 to 1."""
    position = (at - axis[0]) / (axis[1] - axis[0])
    below = np.clip(position.astype(np.int64), 0, len(axis) - 2)
    return below, position - below


@dataclass(frozen=True, eq=False)
class TactileFeatures:
    """The features of one sensor.

    Attributes:
        grid: Where forces are given.
        markers: Number of its markers.
    """

    grid: ForceGrid
    markers: int

    @property
    def description(self) -> dict[str, dict[str, object]]:
        """Type, shape and names of every feature, as data sets of LeRobot describe columns."""
        shapes: dict[str, tuple[tuple[int, ...], list[str] | None]] = {
            **{name: ((len(parts),), list(parts)) for name, parts in SCALARS.items()},
            "marker_motion_px": ((self.markers, 2), None),
            "force_grid_n": ((*self.grid.shape, 3), None),
        }
        return {
            name: {"dtype": "float32", "shape": shape, "names": names}
            for name, (shape, names) in shapes.items()
        }

    def of(self, result: FrameResult) -> dict[str, NDArray[np.float32]]:
        """The features of a frame; NaN where the picture does not show a value."""
        wrench, field, tracks = result.wrench, result.field, result.tracks
        vector = np.full(6, np.nan) if wrench is None else wrench.vector
        sigma = np.full(6, np.nan) if wrench is None else wrench.standard_deviation
        known = [bool(np.isfinite(vector[axes]).all()) for axes in ([0, 1, 5], [2, 3, 4])]
        contact = np.nan if field is None else float(field.contact.any())
        motion = np.full((self.markers, 2), np.nan)
        forces = np.full((*self.grid.shape, 3), np.nan)
        if tracks is not None:
            motion = np.where(tracks.tracked[:, None], tracks.displacement_px, np.nan)
        if field is not None:
            forces = self.grid.carried(field.force_n)
        found = {
            "wrench": vector, "wrench_sigma": sigma, "known": known, "contact": [contact],
            "marker_motion_px": motion, "force_grid_n": forces,
        }  # fmt: skip
        return {name: np.asarray(value, dtype=np.float32) for name, value in found.items()}


def scalars(features: Features, names: tuple[str, ...]) -> dict[str, float]:
    """Single numbers for a policy, which takes no NaN: what is not known is 0.

    `tangential_known` and `normal_known` tell such a 0 from a measured one.
    """
    found = {}
    for name in names:
        for part, value in zip(SCALARS[name], features[name], strict=True):
            found[part] = float(value) if np.isfinite(value) else 0.0
    return found
