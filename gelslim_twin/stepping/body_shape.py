"""Shapes of rigid bodies: what of them faces down when they are turned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.indenter import Indenter, MeshFile, Sphere
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.tools.profile import ConvexProfile, Profile, mesh_profile, profile
from gelslim_twin.tools.undercut import Undercut, undercut_of

Array = NDArray[np.float64]
EXACT_MM = 1e-3
"""Step of the differences by which the curvature of an exact shape is taken."""


@dataclass(frozen=True, eq=False)
class LowerSide:
    """Lower surface of a turned shape.

    Attributes:
        shapes: Profile, position (x, y) and height of the lowest point of each part, about the
            origin of the side.
        origin_mm: That origin (3,) in the turned frame of the body.
        smooth_mm: Distance over which the curvature of the surface has a meaning.
        undercut: What of the shape is hidden behind a gap; None where nothing is.
    """

    shapes: tuple[tuple[Profile, tuple[float, float], float], ...]
    origin_mm: Array
    smooth_mm: float = EXACT_MM
    undercut: Undercut | None = None


class Shape(Protocol):
    """A rigid shape about the origin of its body."""

    @property
    def radius_mm(self) -> float:
        """Largest distance of a point from the body's origin."""

    @property
    def turns(self) -> bool:
        """Whether the shape is known from every side; else from below only."""

    def lower_side(self, turn: Array) -> LowerSide:
        """The lower surface after the rotation `turn` (3, 3). Raises StepError."""


@dataclass(frozen=True)
class BallShape:
    """A ball about the body's origin."""

    radius_mm: float
    turns = True

    def lower_side(self, turn: Array) -> LowerSide:
        """The lower half, which is the same from every side."""
        ball = profile(Sphere(shape="sphere", radius_mm=self.radius_mm), Path())
        return LowerSide(((ball, (0.0, 0.0), 0.0),), np.array([0.0, 0.0, -self.radius_mm]))


@dataclass(frozen=True)
class BoxShape:
    """A box with its middle at the body's origin and its edges along the axes."""

    sides_mm: tuple[float, float, float]
    turns = True

    @property
    def radius_mm(self) -> float:
        """Half of its diagonal."""
        return float(np.linalg.norm(self.sides_mm)) / 2

    def lower_side(self, turn: Array) -> LowerSide:
        """The faces that point down, which is exact for every rotation."""
        half = np.asarray(self.sides_mm) / 2
        lowest = -float(np.abs(turn[2]) @ half)
        normals = np.concatenate([turn.T, -turn.T])
        reach = np.concatenate([half, half]) - normals[:, 2] * lowest
        surface = ConvexProfile(np.ascontiguousarray(normals), reach)
        return LowerSide(((surface, (0.0, 0.0), 0.0),), np.array([0.0, 0.0, lowest]))


@dataclass(frozen=True, eq=False)
class MeshShape:
    """Facets (n, 3, 3) in mm about the body's origin."""

    corners_mm: Array
    resolution_mm: float
    turns = True

    @property
    def radius_mm(self) -> float:
        """Distance of the farthest corner."""
        return float(np.linalg.norm(self.corners_mm, axis=2).max())

    def lower_side(self, turn: Array) -> LowerSide:
        """A height map of the turned mesh. Raises StepError for one of too many cells."""
        turned = self.corners_mm @ turn.T
        try:
            surface, origin = mesh_profile(turned, self.resolution_mm)
        except ValueError as error:
            raise StepError(f"the mesh has no height map: {error}") from None
        shapes = ((surface, (0.0, 0.0), 0.0),)
        return LowerSide(shapes, origin, 2 * self.resolution_mm, undercut_of(turned - origin))


@dataclass(frozen=True, eq=False)
class IndenterShape:
    """Indenters of a scene on one tool, known from below only."""

    indenters: tuple[Indenter, ...]
    folder: Path
    seed: int = 0
    turns = False
    radius_mm = np.inf

    def lower_side(self, turn: Array) -> LowerSide:
        """The indenters as they are; `turn` is the identity."""
        return LowerSide(
            tuple(
                (profile(one, self.folder, self.seed), (one.x_mm, one.y_mm), one.raised_mm)
                for one in self.indenters
            ),
            np.zeros(3),
            max(
                (2 * one.resolution_mm for one in self.indenters if isinstance(one, MeshFile)),
                default=EXACT_MM,
            ),
        )
