"""The rigid tool at a pose: height of its lower surface over the gel, motion of its points."""

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
_ABOVE_MM = 1.0
"""Height above the gel up to which a tilted tool is searched; the gel bulges by less."""
_SAMPLES = 16
_STEPS = 40
_SETTLED_MM = 1e-10
_WALL_MM = 1e-6


@dataclass(frozen=True, eq=False)
class Tool:
    """Shapes on one tool: profile, position (x, y) and height of the lowest point of each."""

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
        """Height (n,) of the lower surface in the tool's frame; infinite outside its outline."""
        height = np.full(np.broadcast(x, y).shape, np.inf)
        for shape, (dx, dy), raised in self.shapes:
            height = np.minimum(height, shape(x - dx, y - dy) + raised)
        return height

    def height_mm(self, pose: Pose, x_mm: Array, y_mm: Array) -> Array:
        """Height (n,) of the lower surface over points of the sensor frame; infinite outside.

        The surface of a tilted tool is where the vertical line through a point first enters it. A
        line that enters through an upright wall, or more than 1 mm above the gel, is outside.
        """
        turn = rotation(pose)
        origin = np.array([pose.x_mm, pose.y_mm, -pose.depth_mm])
        dx, dy = np.asarray(x_mm) - origin[0], np.asarray(y_mm) - origin[1]
        if pose.tilt_x_deg == 0 and pose.tilt_y_deg == 0:
            place = np.stack([dx, dy]).T @ turn[:2, :2]
            return self.local(place[..., 0], place[..., 1]) + origin[2]
        # No point of the tool is below its base plane.
        base = -(dx * turn[0, 2] + dy * turn[1, 2]) / turn[2, 2] - 1e-9
        height = np.full(np.shape(base), np.inf)
        near = np.flatnonzero(base < _ABOVE_MM - origin[2])
        flat = np.stack([dx[near], dy[near], np.zeros(len(near))], axis=-1) @ turn
        height[near] = self._entered(flat, turn[2], base[near], _ABOVE_MM - origin[2])
        return height + origin[2]

    def _inside(self, flat: Array, line: Array, z: Array) -> Array:
        """Depth inside the tool of points at z (...,) on the lines over `flat` (..., 3)."""
        own = flat + z[..., None] * line
        return np.asarray(own[..., 2] - self.local(own[..., 0], own[..., 1]))

    def _entered(self, flat: Array, line: Array, low: Array, high: float) -> Array:
        """Lowest z (n,) between two heights at which lines enter the tool; infinite if none."""
        steps = low[:, None] + np.linspace(0.0, 1.0, _SAMPLES) * (high - low)[:, None]
        depth = self._inside(flat[:, None], line, steps)
        first = (depth >= 0).argmax(axis=1)
        hit = np.flatnonzero((depth >= 0).any(axis=1) & (first > 0))
        found = np.full(len(flat), np.inf)
        a, b = steps[hit, first[hit] - 1], steps[hit, first[hit]]
        fa, fb = depth[hit, first[hit] - 1], depth[hit, first[hit]]
        for turn in range(_STEPS):
            # False position alternates with bisection, because walls have no slope.
            with np.errstate(invalid="ignore"):
                guess = (a * fb - b * fa) / (fb - fa)
            middle = (a + b) / 2
            guess = np.where(np.isfinite(guess) & (turn % 2 == 0), guess, middle)
            f = self._inside(flat[hit], line, guess)
            # Exact but for rounding counts as inside, so that level faces end the search at once.
            into = f >= -_SETTLED_MM
            a, fa = np.where(into, a, guess), np.where(into, fa, f)
            b, fb = np.where(into, guess, b), np.where(into, f, fb)
            if np.all((b - a < _SETTLED_MM) | (np.abs(fb) < _SETTLED_MM)):
                break
        # Where the depth jumps, the line went through a wall.
        found[hit] = np.where(np.abs(fb) < _WALL_MM, b, np.inf)
        return found

    def carried(self, before: Pose, after: Pose, points_mm: Array) -> Array:
        """Positions at another pose of points (n, 3) that are fixed to the tool."""
        start = np.array([before.x_mm, before.y_mm, -before.depth_mm])
        end = np.array([after.x_mm, after.y_mm, -after.depth_mm])
        turn = rotation(after) @ rotation(before).T
        return np.asarray((points_mm - start) @ turn.T + end)


def rotation(pose: Pose) -> Array:
    """Rotation matrix (3, 3) of a pose: twist about z first, then tilt about x, then about y."""
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
