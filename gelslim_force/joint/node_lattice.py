"""The lattice of the surface nodes: values and slopes between them, and regions of nodes.

Slopes come from cubic convolution (Keys, IEEE Trans. ASSP 29, 1981), which has continuous slopes
and is exact for quadratic heights; at the edge of the lattice the outermost values are repeated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from gelslim_force.joint.morphology import filled
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_TAPS = 4
_LEAST_AREA = 0.3
"""Of a deformed surface over that at rest; a smaller one is an error of the estimate."""


@dataclass(frozen=True, eq=False)
class SlopeTaps:
    """Slopes at n points as sums over the heights of 16 nodes each.

    Attributes:
        nodes: (n, 16).
        along: (n, 16) weights of the slope along x.
        across: (n, 16) of the slope along y.
    """

    nodes: Nodes
    along: Array
    across: Array

    def slopes(self, height_mm: Array) -> Array:
        """(n, 2) slopes of a surface with nodes of the given heights (c,)."""
        from gelslim_force.joint.kernels.place_kernel import sums_of_taps

        found = np.empty((len(self.nodes), 2))
        sums_of_taps(self.nodes, self.along, self.across, height_mm, found)
        return found

    def on_deformed(self, lateral_mm: Array) -> SlopeTaps:
        """The slopes of the deformed surface, whose nodes have moved by (c, 2) in its plane."""
        return self.turned(self.turn(lateral_mm))

    def turned(self, turn: Array) -> SlopeTaps:
        """The slopes times matrices (n, 2, 2)."""
        from gelslim_force.joint.kernels.place_kernel import turn_slopes

        along, across = np.empty_like(self.along), np.empty_like(self.across)
        turn_slopes(self.along, self.across, turn, along, across)
        return SlopeTaps(self.nodes, along, across)

    def turn(self, lateral_mm: Array) -> Array:
        """(n, 2, 2) F⁻ᵀ, which leads from slopes by the places at rest to those when deformed.

        F = I + ∂u/∂x is the deformation gradient of the plane, whose nodes have moved by (c, 2). It
        is taken with a determinant of at least 0.3.
        """
        from gelslim_force.joint.kernels.place_kernel import plane_turns

        found = np.empty((len(self.nodes), 2, 2))
        plane_turns(self.nodes, self.along, self.across, lateral_mm, _LEAST_AREA, found)
        return found


def _cubic_weights(part: Array) -> Array:
    """Weights (..., 4) of cubic convolution at fractions (...) of a cell."""
    t = part[..., None]
    return np.concatenate(
        [
            -0.5 * t + t**2 - 0.5 * t**3,
            1 - 2.5 * t**2 + 1.5 * t**3,
            0.5 * t + 2 * t**2 - 1.5 * t**3,
            -0.5 * t**2 + 0.5 * t**3,
        ],
        axis=-1,
    )


@dataclass(frozen=True, eq=False)
class NodeLattice:
    """Nodes (c,) on a regular lattice, of which some places may be empty.

    Attributes:
        origin_mm: (2,) the first place.
        step_mm: (2,) spacing along x and y.
        place: (c, 2) index of each node along x and y.
        number: (nx, ny) number of the node at each place; -1 where there is none.
    """

    origin_mm: Array
    step_mm: Array
    place: NDArray[np.intp]
    number: NDArray[np.intp]

    @classmethod
    def of(cls, points_mm: Array, step_mm: Array) -> NodeLattice:
        """The lattice of nodes (c, 2 or 3) with the given spacing (2,)."""
        step = np.asarray(step_mm, dtype=float)
        origin = points_mm[:, :2].min(axis=0)
        place = np.rint((points_mm[:, :2] - origin) / step).astype(np.intp)
        number = np.full(place.max(axis=0) + 1, -1, dtype=np.intp)
        number[place[:, 0], place[:, 1]] = np.arange(len(place))
        return cls(origin, step, place, number)

    def on(self, points_mm: Array) -> Mask:
        """Whether (n,) points (n, 2) lie in cells that have nodes at all corners."""
        cell = np.floor((points_mm - self.origin_mm) / self.step_mm)
        last = np.array(self.number.shape) - 2
        inside = ((cell >= 0) & (cell <= last)).all(axis=1)
        i, j = np.clip(np.nan_to_num(cell), 0, last).astype(np.intp).T
        corners = [self.number[i + di, j + dj] >= 0 for di in (0, 1) for dj in (0, 1)]
        return np.asarray(inside & np.all(corners, axis=0))

    def nearest_node(self, points_mm: Array) -> Nodes:
        """(n,) the node whose place on the lattice is nearest to each point (n, 2).

        Points beyond the lattice, and places without a node, give a node nearby.
        """
        held = np.argwhere(self.number >= 0)
        at = np.nan_to_num((points_mm - self.origin_mm) / self.step_mm)
        found = cKDTree(held).query(np.clip(at, -1e6, 1e6))[1]
        return np.asarray(self.number[tuple(held[found].T)])

    def values_at(self, values: Array, points_mm: Array) -> Array:
        """Bilinear interpolation (n, ...) of nodal values (c, ...) at points (n, 2)."""
        from gelslim_force.joint.kernels.taps_kernel import bilinear

        at = np.ascontiguousarray((points_mm - self.origin_mm) / self.step_mm)
        columns = np.ascontiguousarray(values, dtype=float).reshape(len(values), -1)
        found = np.empty((len(at), columns.shape[1]))
        bilinear(at, self.number, columns, found)
        return found.reshape(len(at), *values.shape[1:])

    def adjacent(self, nodes: Nodes) -> Array:
        """(p, p) with 1 where two of the nodes (p,) are one step along x or y apart."""
        from gelslim_force.joint.kernels.place_kernel import mark_adjacent

        found = np.zeros((len(nodes), len(nodes)))
        mark_adjacent(self.place[nodes], found)
        return found

    def slopes_at(self, points_mm: Array, blur_mm: float = 0.0) -> SlopeTaps:
        """Slopes along x and along y at (n, 2), by the heights of the nodes.

        They are means over a blur whose standard deviation `blur_mm` is small next to the spacing.
        """
        from gelslim_force.joint.kernels.taps_kernel import cubic_taps

        at = np.ascontiguousarray((points_mm - self.origin_mm) / self.step_mm)
        nodes = np.empty((len(at), _TAPS * _TAPS), dtype=np.intp)
        along, across = np.empty(nodes.shape), np.empty(nodes.shape)
        cubic_taps(at, self.step_mm, self._blur(blur_mm), self.number, nodes, along, across)
        return SlopeTaps(nodes, along, across)

    def slopes_about(self, points_mm: Array, close: Mask, blur_mm: float = 0.0) -> SlopeTaps:
        """Slopes at (n, 2) by the heights of every other place, and of all where it matters.

        Args:
            points_mm: (n, 2).
            close: (mx, my) places of the lattice of every other place, about which all are used.
            blur_mm: As in `slopes_at`.
        """
        from gelslim_force.joint.kernels.taps_kernel import taps_of_two_pitches

        at = np.ascontiguousarray((points_mm - self.origin_mm) / self.step_mm)
        nodes = np.empty((len(at), _TAPS * _TAPS), dtype=np.intp)
        along, across = np.empty(nodes.shape), np.empty(nodes.shape)
        blur = self._blur(blur_mm)
        taps_of_two_pitches(at, self.step_mm, blur, self.number, close, nodes, along, across)
        return SlopeTaps(nodes, along, across)

    def _blur(self, blur_mm: float) -> Array:
        """(2,) half the variance of a blur in squared steps."""
        return np.asarray((blur_mm / self.step_mm) ** 2 / 2)

    def interpolation(self, points_mm: Array) -> sparse.csr_array:
        """(n, c) matrix that gives the values at points (n, 2 or 3) by those of the nodes.

        It is cubic convolution where all 16 nodes are there, and linear at the edge of the lattice.
        """
        at = (points_mm[:, :2] - self.origin_mm) / self.step_mm
        first = np.floor(at).astype(np.intp) - 1
        offsets = np.arange(_TAPS)
        rows, columns = (first[:, axis, None] + offsets for axis in (0, 1))
        last = np.array(self.number.shape) - 1
        nodes = self.number[
            np.clip(rows, 0, last[0])[:, :, None], np.clip(columns, 0, last[1])[:, None, :]
        ].reshape(len(at), -1)
        inside = (first >= 0).all(axis=1) & (first + _TAPS - 1 <= last).all(axis=1)
        inside &= (nodes >= 0).all(axis=1)
        by_x, by_y = _cubic_weights(at - np.floor(at)).swapaxes(0, 1)
        weights = (by_x[:, :, None] * by_y[:, None, :]).reshape(len(at), -1)
        weights[~inside] = 0.0
        row = np.repeat(np.arange(len(at)), _TAPS**2)
        size = (len(at), len(self.place))
        cubic = sparse.csr_array((weights.ravel(), (row, np.maximum(nodes, 0).ravel())), shape=size)
        places = self.origin_mm + self.place * self.step_mm
        linear = marker_to_node(places, points_mm)
        return sparse.csr_array(cubic + sparse.diags_array((~inside).astype(float)) @ linear)

    def picture(self, nodes: Mask) -> Mask:
        """(nx, ny) places of nodes (c,)."""
        places = np.zeros(self.number.shape, dtype=bool)
        places[self.place[:, 0], self.place[:, 1]] = nodes
        return places

    def widened(self, nodes: Mask, rings: int) -> Mask:
        """(c,) the nodes and those up to `rings` steps along the lattice away."""
        if rings < 1:
            return nodes
        from gelslim_force.joint.kernels.region_kernel import widen_nodes

        found = np.empty(len(nodes), dtype=bool)
        distance = np.empty(self.number.shape, dtype=np.int64)
        widen_nodes(nodes, self.place, rings, distance, found)
        return found

    def place_number(self, points_mm: Array) -> Nodes:
        """(n,) number, row by row, of the place nearest to each point (n, 2); -1 beyond them."""
        at = np.nan_to_num((points_mm - self.origin_mm) / self.step_mm, nan=-1.0)
        at = np.clip(np.rint(at), -1, self.number.shape).astype(np.intp)
        inside = ((at >= 0) & (at < self.number.shape)).all(axis=1)
        return np.where(inside, at[:, 0] * self.number.shape[1] + at[:, 1], -1)

    def nearest(self, places: Nodes) -> Mask:
        """(c,) nodes at places by number (n,), see `place_number`, and those they enclose."""
        # The last one is for what lies beyond.
        marked = np.zeros(self.number.size + 1, dtype=bool)
        marked[places] = True
        whole = filled(marked[:-1].reshape(self.number.shape))
        return np.asarray(whole[self.place[:, 0], self.place[:, 1]])
