"""A rigid body that touches the gel, and the side of it that faces the gel.

The contact knows a tool by the height of its lower surface. The lower surface of a body depends on
its rotation, so each rotation is split: a turn from a fixed grid of directions brings the side that
faces the gel to face straight down, and the tool is tilted by the rest, which is below 7°. The grid
contains the axes of the body and their halves (45°), where edges and corners of boxes point down.
"""

from __future__ import annotations

import math
import os
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.soft_layer import SoftLayer
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.stepping.body_shape import (
    BallShape,
    BoxShape,
    IndenterShape,
    MeshShape,
    Shape,
)
from gelslim_twin.stepping.closed_mesh import read_closed_mesh
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.tools.tool import Tool
from gelslim_twin.tools.undercut import Undercut

Array = NDArray[np.float64]
GRID_DEG = 9.0
"""Angle between neighbouring directions of the grid along each axis of a face of the cube."""
MOST_TILT_DEG = 45.0
"""Largest tilt of a body that is known from below only."""
MOST_SIDES = 64
"""Sides kept per body; the one not used for longest is forgotten."""
Direction = tuple[int, int, int, int]
"""Axis and sign of the face of the cube, and steps of the grid along its other two axes."""


@dataclass(frozen=True, eq=False)
class Side:
    """The side of a body that faces the gel.

    Attributes:
        tool: Its surface, as the contact takes it.
        frame: Rigid motion (4, 4) from the tool's frame to that of the body.
        smooth_mm: Distance over which the curvature of the surface has a meaning.
        undercut: What of the body is hidden behind a gap, in the tool's frame; None for nothing.
    """

    tool: Tool
    frame: Array
    smooth_mm: float
    undercut: Undercut | None = None


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body. Make one by `from_mesh`, `sphere`, `box` or `from_indenters`.

    Attributes:
        shape: Its shape about the origin that its poses place.
        name: Name in messages.
        layer: The soft layer around its rigid core; None for a rigid body.
    """

    shape: Shape
    name: str
    layer: SoftLayer | None = None
    _sides: OrderedDict[Direction, Side] = field(default_factory=OrderedDict, repr=False)

    @classmethod
    def from_mesh(
        cls,
        path: str | os.PathLike[str],
        *,
        scale: float = 1.0,
        resolution_mm: float = 0.05,
        name: str = "",
    ) -> Body:
        """A body from a closed mesh; its poses place the origin of the mesh.

        The gel sees the surface that faces it as a height map. A step that would bring the gel to
        an undercut is refused.

        Args:
            path: STL, OBJ or PLY file.
            scale: Millimetres per unit of the file; 1000 for a file in metres.
            resolution_mm: Cell size of the height map.
            name: Name in messages; the file's name by default.

        Raises:
            StepError: The file cannot be read, or its surface is not closed.
        """
        _require_positive("resolution_mm", resolution_mm)
        corners = read_closed_mesh(path, scale)
        return cls(MeshShape(corners, resolution_mm), name or Path(path).stem)

    @classmethod
    def sphere(cls, radius_mm: float, *, name: str = "sphere") -> Body:
        """A ball about the body's origin. Raises StepError for a radius not above 0."""
        _require_positive("radius_mm", radius_mm)
        return cls(BallShape(float(radius_mm)), name)

    @classmethod
    def box(cls, length_mm: float, width_mm: float, height_mm: float, *, name: str = "box") -> Body:
        """A box about the body's origin, its sides along x, y and z.

        Raises StepError for a side not above 0.
        """
        sides = {"length_mm": length_mm, "width_mm": width_mm, "height_mm": height_mm}
        for side, value in sides.items():
            _require_positive(side, value)
        return cls(BoxShape((float(length_mm), float(width_mm), float(height_mm))), name)

    @classmethod
    def from_indenters(
        cls,
        *indenters: Indenter,
        folder: str | os.PathLike[str] = ".",
        seed: int = 0,
        name: str = "tool",
    ) -> Body:
        """The tool of a scene; its origin is the lowest point, as in a scene.

        It is known from below only, so that its pose may be tilted by 45° at most.

        Args:
            indenters: Shapes of a scene file, one at least.
            folder: Folder that meshes are relative to.
            seed: Seed of random textures.
            name: Name in messages.

        Raises:
            StepError: There is no indenter.
        """
        if not indenters:
            raise StepError("a tool needs one indenter at least")
        return cls(IndenterShape(indenters, Path(folder), seed), name)

    def with_layer(
        self, youngs_modulus_mpa: float, thickness_mm: float, poissons_ratio: float = 0.45
    ) -> Body:
        """The same outer shape with a soft layer on a rigid core, as a cable has its sheath.

        The layer counts as flat and isotropic, with small strains, as wide as the gel and bonded
        to the core. It must be much thinner than the body's radius of curvature.

        Args:
            youngs_modulus_mpa: Young's modulus.
            thickness_mm: Thickness.
            poissons_ratio: Poisson's ratio, from 0 to below 0.5.

        Raises:
            StepError: A number is out of its range.
        """
        try:
            layer = SoftLayer(youngs_modulus_mpa, poissons_ratio, thickness_mm)
        except ValueError as error:
            raise StepError(f"body {self.name}: {error}") from None
        return replace(self, layer=layer)

    def side(self, turn: Array) -> Side:
        """The side that faces the gel under the rotation `turn` (3, 3) of the body.

        Raises StepError for a rotation or a shape that has none.
        """
        if not self.shape.turns:
            self._require_upright(turn)
        direction = _direction(-turn[2]) if self.shape.turns else (2, -1, 0, 0)
        if direction in self._sides:
            self._sides.move_to_end(direction)
            return self._sides[direction]
        made = self._made(direction)
        self._sides[direction] = made
        if len(self._sides) > MOST_SIDES:
            self._sides.popitem(last=False)
        return made

    def _made(self, direction: Direction) -> Side:
        turn = turn_down(direction)
        try:
            lower = self.shape.lower_side(turn)
        except (StepError, ValueError, OSError) as error:
            raise StepError(f"body {self.name}: {error}") from error
        frame = np.eye(4)
        frame[:3, :3] = turn.T
        frame[:3, 3] = turn.T @ lower.origin_mm
        return Side(Tool(lower.shapes), frame, lower.smooth_mm, lower.undercut)

    def _require_upright(self, turn: Array) -> None:
        tilt = math.degrees(math.acos(min(1.0, max(-1.0, turn[2, 2]))))
        if tilt > MOST_TILT_DEG:
            raise StepError(
                f"body {self.name} is tilted by {tilt:.3g}°, the limit is {MOST_TILT_DEG:g}° for "
                "indenters, which are known from below only; use a mesh"
            )


def _require_positive(name: str, value: float) -> None:
    if isinstance(value, bool) or not (np.isfinite(value) and value > 0):
        raise StepError(f"{name} = {value}: must be a number above 0")


def _direction(down: Array) -> Direction:
    """The direction of the grid that is nearest to a unit vector (3,) of the body's frame."""
    axis = int(np.abs(down).argmax())
    sign = 1 if down[axis] > 0 else -1
    along = [
        round(math.degrees(math.atan2(down[(axis + k) % 3], sign * down[axis])) / GRID_DEG)
        for k in (1, 2)
    ]
    return axis, sign, along[0], along[1]


def turn_down(direction: Direction) -> Array:
    """The rotation (3, 3) of the body that brings a direction of the grid to -z."""
    axis, sign, first, second = direction
    # A cyclic change of the axes, with half a turn about the first where +axis is to point down.
    face = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3, axis]]
    if sign > 0:
        face = np.diag([1.0, -1.0, -1.0]) @ face
    if first == second == 0:
        return face
    down = np.empty(3)
    down[axis] = sign
    down[(axis + 1) % 3] = math.tan(math.radians(GRID_DEG * first))
    down[(axis + 2) % 3] = math.tan(math.radians(GRID_DEG * second))
    return np.asarray(_shortest_to_down(face @ (down / np.linalg.norm(down))) @ face)


def _shortest_to_down(one: Array) -> Array:
    """The rotation by the smallest angle that takes a unit vector near -z to -z (Rodrigues)."""
    x, y = one[0], one[1]
    share = 1.0 / (1.0 - one[2])
    return np.array(
        [
            [1 - x * x * share, -x * y * share, x],
            [-x * y * share, 1 - y * y * share, y],
            [-x, -y, -one[2]],
        ]
    )
