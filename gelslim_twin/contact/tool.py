"""The rigid tool at a pose: how high its lower surface stands over the gel, how its points move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.profile import Profile, profile
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
_STEPS = 12
_SETTLED_MM = 1e-9


@dataclass(frozen=True, eq=False)
class Tool:
    """Shapes carried together: profile, place (x, y) and height of its lowest point on the tool."""

    shapes: tuple[tuple[Profile, tuple[float, float], float], ...]

    @classmethod
    def of(cls, indenters: Sequence[Indenter], folder: Path, seed: int = 0) -> Tool:
        """The tool of a scene. Raises ValueError or OSError for an STL that cannot be read."""
        return cls(
            tuple(
                (profile(one, folder, seed), (one.x_mm, one.y_mm), one.raised_mm)
                for one in indenters
            )
        )

    def local(self, x: Array, y: Array) -> Array:
        """Height (n,) of the lower surface in the tool's own frame; infinite beside it."""
        height = np.full(np.broadcast(x, y).shape, np.inf)
        for shape, (dx, dy), raised in self.shapes:
            height = np.minimum(height, shape(x - dx, y - dy) + raised)
        return height

    def height_mm(self, pose: Pose, x_mm: Array, y_mm: Array) -> Array:
        """Height (n,) of the lower surface over points of the sensor frame; infinite beside it.

        A tilted tool's surface is found along the vertical by fixed-point steps, exact where
        they settle; its undercuts are not seen.
        """
        turn = rotation(pose)
        origin = np.array([pose.x_mm, pose.y_mm, -pose.depth_mm])
        dx, dy = np.asarray(x_mm) - origin[0], np.asarray(y_mm) - origin[1]
        if pose.tilt_x_deg == 0 and pose.tilt_y_deg == 0:
            place = np.stack([dx, dy]).T @ turn[:2, :2]
            return self.local(place[..., 0], place[..., 1]) + origin[2]
        z = np.zeros(np.broadcast(dx, dy).shape)
        for _ in range(_STEPS):
            own = np.stack([dx, dy, z], axis=-1) @ turn
            wanted = self.local(own[..., 0], own[..., 1])
            step = np.where(np.isfinite(wanted), (wanted - own[..., 2]) / turn[2, 2], np.inf)
            beside = ~np.isfinite(step)
            z = np.where(beside, z, z + np.where(beside, 0.0, step))
            if not np.any(np.abs(step[~beside]) > _SETTLED_MM):
                break
        return np.where(beside, np.inf, z + origin[2])

    def carried(self, before: Pose, after: Pose, points_mm: Array) -> Array:
        """Where points (n, 3) fixed to the tool at one pose are at another."""
        start = np.array([before.x_mm, before.y_mm, -before.depth_mm])
        end = np.array([after.x_mm, after.y_mm, -after.depth_mm])
        turn = rotation(after) @ rotation(before).T
        return np.asarray((points_mm - start) @ turn.T + end)


def rotation(pose: Pose) -> Array:
    """(3, 3) of a pose: twist about z first, then tilt about x, then about y."""
    cz, sz = _cos_sin(pose.twist_deg)
    cx, sx = _cos_sin(pose.tilt_x_deg)
    cy, sy = _cos_sin(pose.tilt_y_deg)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return np.asarray(about_y @ about_x @ about_z)


def _cos_sin(angle_deg: float) -> tuple[float, float]:
    angle = np.radians(angle_deg)
    return float(np.cos(angle)), float(np.sin(angle))
