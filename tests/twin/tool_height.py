"""Height of a tool's lower surface over points of the sensor frame, also where it is tilted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.tools.tool import Tool

Array = NDArray[np.float64]
_ABOVE_MM = 1.0
"""Height above the gel up to which a tilted tool is searched; the gel bulges by less."""
_SAMPLES = 16
_STEPS = 40
_SETTLED_MM = 1e-10
_WALL_MM = 1e-6


def tool_height_mm(tool: Tool, pose: Pose, x_mm: Array, y_mm: Array) -> Array:
    """Height (n,) of the lower surface over points of the sensor frame; infinite outside.

    The surface of a tilted tool is where the vertical line through a point first enters it. A
    line that enters through an upright wall, or more than 1 mm above the gel, is outside.
    """
    turn = rotation(pose)
    origin = np.array([pose.x_mm, pose.y_mm, -pose.depth_mm])
    dx, dy = np.asarray(x_mm) - origin[0], np.asarray(y_mm) - origin[1]
    if pose.tilt_x_deg == 0 and pose.tilt_y_deg == 0:
        place = np.stack([dx, dy]).T @ turn[:2, :2]
        return tool.local(place[..., 0], place[..., 1]) + origin[2]
    # No point of the tool is below its base plane.
    base = -(dx * turn[0, 2] + dy * turn[1, 2]) / turn[2, 2] - 1e-9
    height = np.full(np.shape(base), np.inf)
    near = np.flatnonzero(base < _ABOVE_MM - origin[2])
    flat = np.stack([dx[near], dy[near], np.zeros(len(near))], axis=-1) @ turn
    height[near] = _entered(tool, flat, turn[2], base[near], _ABOVE_MM - origin[2])
    return height + origin[2]


def _inside(tool: Tool, flat: Array, line: Array, z: Array) -> Array:
    """Depth inside the tool of points at z (...,) on the lines over `flat` (..., 3)."""
    own = flat + z[..., None] * line
    return np.asarray(own[..., 2] - tool.local(own[..., 0], own[..., 1]))


def _entered(tool: Tool, flat: Array, line: Array, low: Array, high: float) -> Array:
    """Lowest z (n,) between two heights at which lines enter the tool; infinite if none."""
    steps = low[:, None] + np.linspace(0.0, 1.0, _SAMPLES) * (high - low)[:, None]
    depth = _inside(tool, flat[:, None], line, steps)
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
        f = _inside(tool, flat[hit], line, guess)
        # Exact but for rounding counts as inside, so that level faces end the search at once.
        into = f >= -_SETTLED_MM
        a, fa = np.where(into, a, guess), np.where(into, fa, f)
        b, fb = np.where(into, guess, b), np.where(into, f, fb)
        if np.all((b - a < _SETTLED_MM) | (np.abs(fb) < _SETTLED_MM)):
            break
    # Where the depth jumps, the line went through a wall.
    found[hit] = np.where(np.abs(fb) < _WALL_MM, b, np.inf)
    return found
