"""The bolts between flange and jaw: those of the gripper's file, unless the spec has its own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.geometry.fasteners import SCREWS, ScrewSize
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.spec.gripper_library import LibraryGripper, library_gripper

FLANGE_EDGE_MM = 2.0
"""Flange between the head of a bolt and the flange's edge."""
LATERAL_DEPTH_MM = 30.0
"""Length of the plate on a lateral jaw whose depth is not known."""


@dataclass(frozen=True)
class JawBolts:
    """The bolts of one flange.

    The first axis y runs across the finger. The second, u, runs towards the object on an axial
    face and along the finger on a lateral one (`gelslim_cad.spec.gripper_library`).

    Attributes:
        gripper: The gripper.
        bolt: Name of the bolt, such as `M4`.
        spacing_mm: Distance of the two bolts where the spec gives it: a number, or an array (n,)
            over n designs.
    """

    gripper: LibraryGripper
    bolt: str
    spacing_mm: Any = None

    @classmethod
    def of(cls, gripper: str, bolt: str, spacing_mm: Any) -> JawBolts:
        """The bolts of a gripper of the library with what a spec gives of its own."""
        found = library_gripper(gripper)
        return cls(found, found.jaw.bolt if bolt == "gripper" else bolt, spacing_mm)

    @classmethod
    def of_design(cls, d: Lookup) -> JawBolts:
        """The bolts of a design."""
        return cls.of(
            d["design.mount.gripper"],
            d["design.mount.flange_bolt"],
            d["design.mount.flange_bolt_spacing_mm"],
        )

    @property
    def size(self) -> ScrewSize:
        """Sizes of the bolt."""
        return SCREWS[self.bolt]

    @property
    def lateral(self) -> bool:
        """Whether the jaw's face looks at the object."""
        return self.gripper.jaw.face == "lateral"

    @property
    def count(self) -> int:
        """Number of bolts."""
        return len(self.gripper.jaw.holes_mm) if self.spacing_mm is None else 2

    @property
    def places_mm(self) -> tuple[tuple[Any, Any], ...]:
        """Places (y, u) of the bolts.

        Two bolts of a given spacing lie on the line from the first to the last of the gripper's,
        or across the finger where it has a single one, about their middle.
        """
        holes = self.gripper.jaw.holes_mm
        if self.spacing_mm is None:
            return holes
        (ay, au), (by, bu) = holes[0], holes[-1]
        apart, middle = math.hypot(by - ay, bu - au), ((ay + by) / 2, (au + bu) / 2)
        along = ((by - ay) / apart, (bu - au) / apart) if apart else (1.0, 0.0)
        y, u = along[0] / 2 * self.spacing_mm, along[1] / 2 * self.spacing_mm
        return ((middle[0] - y, middle[1] - u), (middle[0] + y, middle[1] + u))

    @property
    def plate_width_mm(self) -> Any:
        """Width of the plate on a lateral jaw: the jaw's, or more where the bolts need it."""
        least = 2 * (self.reach_y_mm + FLANGE_EDGE_MM) + self.size.cap_head_mm
        return np.maximum(least, self.gripper.jaw.width_mm or 0.0)

    @property
    def plate_depth_mm(self) -> float:
        """Length of the plate on a lateral jaw, along the finger."""
        return self.gripper.jaw.depth_mm or LATERAL_DEPTH_MM

    @property
    def reach_y_mm(self) -> Any:
        """Largest distance of a bolt or pin from the mid-plane of the finger."""
        return self._reach(0)

    @property
    def reach_u_mm(self) -> Any:
        """Largest distance of a bolt or pin from the middle along u."""
        return self._reach(1)

    def _reach(self, axis: int) -> Any:
        points = [*self.places_mm, *self.gripper.jaw.pins_mm]
        distances = [np.abs(point[axis]) for point in points]
        return max(map(float, distances)) if all(map(_single, distances)) else _most(distances)

    @property
    def apart_mm(self) -> Any:
        """Least distance between two bolts; infinite for a single one."""
        places = self.places_mm
        pairs = [(a, b) for i, a in enumerate(places) for b in places[:i]]
        return np.min(
            np.broadcast_arrays(np.inf, *(np.hypot(a[0] - b[0], a[1] - b[1]) for a, b in pairs)),
            axis=0,
        )


def _single(value: Any) -> bool:
    return np.ndim(value) == 0


def _most(distances: list[Any]) -> Any:
    return np.max(np.broadcast_arrays(*distances), axis=0)
