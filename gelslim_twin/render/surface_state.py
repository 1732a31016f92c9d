"""Displacement of the gel's outer surface at one instant, and its crown at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from gelslim_twin.render.surroundings import Sight


Array = NDArray[np.float64]
_ROUNDS = 12
_NEAR_MM = 1e-5


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """Displacement `displacement_mm` (ny, nx, 3) at material points on uniform axes (nx,), (ny,).

    It is interpolated by cubic convolution (Keys 1981), which has continuous slopes and is exact
    for linear fields and at the nodes. Raises ValueError for other shapes and values
    that are not finite.
    """

    x_mm: Array
    y_mm: Array
    displacement_mm: Array

    def __post_init__(self) -> None:
        for name in ("x_mm", "y_mm", "displacement_mm"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        shape = (len(self.y_mm), len(self.x_mm), 3)
        if self.displacement_mm.shape != shape:
            raise ValueError(f"displacement_mm is {self.displacement_mm.shape}: must be {shape}")
        if not np.isfinite(self.displacement_mm).all():
            raise ValueError("displacement_mm must be finite: fill the nodes beyond the outline")

    @classmethod
    def from_nodes(cls, nodes_mm: ArrayLike, displacement_mm: ArrayLike) -> SurfaceState:
        """State from surface nodes (n, 2 or 3) of a regular mesh, displaced by (n, 3).

        Places of the lattice without a node (beyond a rounded corner) take the nearest node's
        displacement. Raises ValueError for nodes that are no even lattice.
        """
        return NodeLattice.of(nodes_mm).state(displacement_mm)

    @classmethod
    def at_rest(cls, length_mm: float, width_mm: float) -> SurfaceState:
        """The undeformed pad."""
        x, y = np.linspace(-1, 1, 3) * length_mm / 2, np.linspace(-1, 1, 3) * width_mm / 2
        return cls(x, y, np.zeros((3, 3, 3)))

    @property
    def origin_mm(self) -> Array:
        """The first node (2,)."""
        return np.array([self.x_mm[0], self.y_mm[0]])

    @property
    def step_mm(self) -> Array:
        """Distance between nodes (2,) along x and y."""
        return np.array([np.ptp(a) / (len(a) - 1) for a in (self.x_mm, self.y_mm)])

    @cached_property
    def padded_mm(self) -> Array:
        """Displacement with a ring of ghost nodes by linear extrapolation."""
        u = np.pad(self.displacement_mm, ((1, 1), (1, 1), (0, 0)))
        u[0], u[-1] = 2 * u[1] - u[2], 2 * u[-2] - u[-3]
        u[:, 0], u[:, -1] = 2 * u[:, 1] - u[:, 2], 2 * u[:, -2] - u[:, -3]
        return u

    @cached_property
    def moves(self) -> bool:
        """Whether anything is displaced at all."""
        return bool(np.any(self.displacement_mm))

    def at(self, points_mm: Array) -> Array:
        """Displacement (n, 3) at material points (n, 2); outside the pad that of its edge."""
        from gelslim_twin.render.surface_kernel import displacement

        points = np.ascontiguousarray(points_mm, dtype=float)
        out = np.zeros((len(points), 3))
        if self.moves:
            displacement(self.padded_mm, self.origin_mm, self.step_mm, points, out)
        return out


@dataclass(frozen=True, eq=False)
class NodeLattice:
    """The even lattice of surface nodes: axes (nx,), (ny,), and the node (ny nx,) at each place.

    Places without a node (beyond a rounded corner) have the nearest one.
    """

    x_mm: Array
    y_mm: Array
    nearest: NDArray[np.intp]

    @classmethod
    def of(cls, nodes_mm: ArrayLike) -> NodeLattice:
        """The lattice of surface nodes (n, 2 or 3) of a regular mesh."""
        from scipy.spatial import cKDTree

        places = np.asarray(nodes_mm, dtype=float)[:, :2]
        x, y = (np.unique(np.round(places[:, k], 9)) for k in (0, 1))
        sites = np.column_stack([a.ravel() for a in np.meshgrid(x, y)])
        return cls(x, y, cKDTree(places).query(sites)[1])

    def state(self, displacement_mm: ArrayLike) -> SurfaceState:
        """The state of nodes displaced by (n, 3). Raises ValueError for another shape."""
        moved = np.asarray(displacement_mm, dtype=float)
        count = int(self.nearest.max()) + 1
        if moved.shape != (count, 3):
            raise ValueError(f"displacement of nodes {moved.shape}: must be ({count}, 3)")
        shape = (len(self.y_mm), len(self.x_mm), 3)
        return SurfaceState(self.x_mm, self.y_mm, moved[self.nearest].reshape(shape))


@dataclass(frozen=True, eq=False)
class DomedTop:
    """A crowned surface at rest: its heights as a displacement `rest` without lateral part.

    The heights are relative to the plane z = 0 at its apex. A displacement of the crowned surface
    is treated as one of that plane that includes the heights. Dots, intersections of rays and
    slopes then follow by the same formulas as on a flat gel.
    """

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
        raised[..., 2] += self.nodes_mm(motion)
        return replace(motion, displacement_mm=raised)

    def nodes_mm(self, state: SurfaceState) -> Array:
        """Heights (ny, nx) at the nodes of a state."""
        grid = np.stack(np.meshgrid(state.x_mm, state.y_mm), axis=2)
        return self.height_mm(grid.reshape(-1, 2)).reshape(grid.shape[:2])

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
