"""Undercuts: parts of a mesh that face the gel behind a gap, hidden by parts below them.

The contact knows a mesh by the height of its lower surface, so that the gel cannot enter such a
gap. A mesh is refused where the gel would. Along each vertical of a grid, the passes through the
facets are counted from below: an undercut is where the vertical enters the mesh once more.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.indenter import MeshFile
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.tools.profile import facets_down, lowest_middle

Array = NDArray[np.float64]
POINTS = 256
"""Verticals along the longer side of the mesh."""
OFF_GRID = 0.381966
"""Place of the first vertical in its cell; irrational, so that verticals miss corners and edges."""
NARROWEST_MM = 1e-3
"""Gap that counts as none, such as that between parts that touch."""
SHOWN = 3


@dataclass(frozen=True, eq=False)
class Undercut:
    """Points of a mesh that are hidden behind a gap, the lowest first.

    Attributes:
        facets: Numbers (n,) of their facets in the file, from 0.
        places_mm: The points (n, 3) in the frame of the tool.
    """

    facets: NDArray[np.intp]
    places_mm: Array

    def below(self, pose: Pose, pad_mm: tuple[float, float], top_mm: float) -> Undercut | None:
        """The part of it that the undeformed gel meets.

        Args:
            pose: Pose of the tool.
            pad_mm: Length and width of the pad.
            top_mm: Height of its highest point.

        Returns:
            Those points; None where there are none.
        """
        turn = rotation(pose)
        lowest = turn[2, 2] * self.places_mm[0, 2] - np.hypot(*turn[2, :2]) * self._reach_mm
        if lowest - pose.depth_mm >= top_mm:
            return None
        places = self.places_mm @ turn.T + [pose.x_mm, pose.y_mm, -pose.depth_mm]
        half = np.asarray(pad_mm) / 2
        met = (places[:, 2] < top_mm) & (np.abs(places[:, :2]) <= half).all(axis=1)
        return Undercut(self.facets[met], self.places_mm[met]) if met.any() else None

    @cached_property
    def _reach_mm(self) -> float:
        """Largest distance from the tool's axis."""
        return float(np.hypot(*self.places_mm[:, :2].T).max())

    def __str__(self) -> str:
        """The facets by number, and where the lowest is."""
        facets = list(dict.fromkeys(self.facets.tolist()))
        names = ", ".join(str(k) for k in facets[:SHOWN])
        more = f" and {len(facets) - SHOWN} more" if len(facets) > SHOWN else ""
        many = "facets" if len(facets) > 1 else "facet"
        x, y, z = self.places_mm[0]
        return (
            f"{many} {names}{more} (numbered from 0; the lowest {z:.3g} mm above the lowest point "
            f"of the mesh, at {x:.3g}, {y:.3g} mm from its middle)"
        )


def undercut_of(corners: Array) -> Undercut | None:
    """Find the undercuts of closed bodies seen from below.

    Args:
        corners: Facets (n, 3, 3) in mm about the middle of their extents, with the lowest point
            at height 0; z points up.

    Returns:
        The hidden points; None where there are none.
    """
    low, high = (f(corners.reshape(-1, 3), axis=0)[:2] for f in (np.min, np.max))
    step = float((high - low).max()) / POINTS
    if step <= 0:
        return None
    x, y = (np.arange(a + OFF_GRID * step, b, step) for a, b in zip(low, high, strict=True))
    place, height, facet, side = _passes(corners, x, y)
    order = np.lexsort((height, place))
    place, height, facet, side = place[order], height[order], facet[order], side[order]
    first = np.flatnonzero(np.diff(place, prepend=-1))
    # How many bodies the vertical is in below each pass: a running sum that begins anew.
    inside = np.cumsum(side) - side
    inside -= np.repeat(inside[first], np.diff(first, append=len(place)))
    gap = np.diff(height, prepend=-np.inf)
    again = (side > 0) & (inside == 0) & (gap > NARROWEST_MM)
    again[first] = False
    hidden = np.flatnonzero(again)
    hidden = hidden[np.argsort(height[hidden], kind="stable")]
    if len(hidden) == 0:
        return None
    over = place[hidden]
    points = np.column_stack([x[over // len(y)], y[over % len(y)], height[hidden]])
    return Undercut(facet[hidden], points)


def undercut_of_file(shape: MeshFile, folder: Path) -> Undercut | None:
    """The undercuts of an indenter, in the frame of the tool that carries it.

    Raises ValueError for a file that is no mesh, OSError for one that cannot be read.
    """
    state = os.stat(folder / shape.file)
    return _undercut_of_file(shape, folder, state.st_mtime_ns, state.st_size)


# The samples of a data set have the same meshes.
@lru_cache(maxsize=64)
def _undercut_of_file(shape: MeshFile, folder: Path, changed_ns: int, size: int) -> Undercut | None:
    """Of a file, which is read again when its time or size has changed."""
    corners = facets_down(shape, folder)
    hidden = undercut_of(corners - lowest_middle(corners))
    if hidden is None:
        return None
    at = np.array([shape.x_mm, shape.y_mm, shape.raised_mm])
    return replace(hidden, places_mm=hidden.places_mm + at)


def _passes(
    corners: Array, x: Array, y: Array
) -> tuple[NDArray[np.intp], Array, NDArray[np.intp], NDArray[np.intp]]:
    from gelslim_twin.tools.height_map_kernel import vertical_passes

    facets, room = np.ascontiguousarray(corners), 0
    while True:
        place, facet, side = (np.empty(room, dtype=np.intp) for _ in range(3))
        height = np.empty(room)
        count = vertical_passes(facets, x, y, place, height, facet, side)
        if count <= room:
            return place[:count], height[:count], facet[:count], side[:count]
        room = count
