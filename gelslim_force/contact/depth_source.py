"""The normal motion of each frame from a depth map made elsewhere, one per frame."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.errors import GelslimError
from gelslim_force.contact.depth_map import motion_from_image
from gelslim_force.contact.indenter_source import NormalReading
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]


class DepthMapError(GelslimError, ValueError):
    """Depth maps that cannot be used."""


@dataclass(eq=False)
class DepthMapSource:
    """Heights (h, w) in mm registered to the picture, 0 at rest, negative where pressed.

    Maps are taken in the order of the frames.
    """

    camera: VirtualCamera
    points_mm: Array
    """(c, 3) surface nodes."""
    maps: Iterable[NDArray[np.floating]]
    sigma_mm: float = 0.0
    touched_below_mm: float | None = None
    """Height under which a node counts as touched; None claims no contact."""
    _left: Iterator[NDArray[np.floating]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._left = iter(self.maps)

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> NDArray[np.floating] | None:
        """Return the frame's map, None once they are used up."""
        return next(self._left, None)

    def motion(
        self, seen: NDArray[np.floating] | None, lateral_mm: Array | None = None
    ) -> NormalReading:
        """Heights at the nodes where the camera sees them; unknown ones are taken from beside."""
        count = len(self.points_mm)
        if seen is None:
            nan = np.full(count, np.nan)
            return NormalReading(nan, nan, None, problem="there is no depth map for this frame")
        found = motion_from_image(
            seen,
            self.camera,
            self.points_mm,
            sigma_mm=self.sigma_mm,
            touched_below_mm=self.touched_below_mm,
        )
        known = np.isfinite(found.w_mm)
        if not known.any():
            nan = np.full(count, np.nan)
            return NormalReading(nan, nan, None, problem="the depth map knows none of the nodes")
        _, beside = cKDTree(self.points_mm[known, :2]).query(self.points_mm[:, :2])
        w = found.w_mm[known][beside]
        touched = found.patch if self.touched_below_mm is not None else None
        problem = ""
        if known.mean() < 0.5:
            problem = f"the depth map knows {known.mean():.0%} of the nodes"
        sigma = np.where(known, found.sigma_mm, 0.0)
        return NormalReading(w, sigma, touched, problem=problem)


def read_depth_maps(path: str | os.PathLike[str]) -> NDArray[np.floating]:
    """Maps (frames, h, w) of a .npy file, memory-mapped; a single (h, w) counts as one.

    Raises DepthMapError for anything else.
    """
    try:
        maps = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise DepthMapError(f"{os.fspath(path)} is no array that can be read: {error}") from error
    if not isinstance(maps, np.ndarray) or maps.dtype.kind != "f" or maps.ndim not in (2, 3):
        raise DepthMapError(
            f"{os.fspath(path)}: depth maps must be floating-point (frames, h, w), heights in mm, "
            f"not {getattr(maps, 'dtype', type(maps).__name__)} {getattr(maps, 'shape', '')}"
        )
    return maps if maps.ndim == 3 else maps[None]
