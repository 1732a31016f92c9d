"""What a fit of contact forces starts from: the data of a frame, and the last estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light_view import SeenLight
from gelslim_force.joint.linearised import Linearised
from gelslim_force.joint.marker_rows import MarkerRows
from gelslim_force.joint.normal_equations import NormalEquations
from gelslim_force.motion.marker_motion import MarkerRays

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrameData:
    """Data of a frame.

    Attributes:
        seen: Its light; None where the markers alone are used.
        markers: Rays of the followed markers.
        noise_px: Standard deviation of their positions.
    """

    seen: SeenLight | None
    markers: MarkerRays
    noise_px: float


@dataclass(frozen=True, eq=False)
class FitState:
    """An estimate.

    Attributes:
        force_n: (c, 3) on the surface nodes.
        displacement_mm: (c, 3) of the surface nodes.
        gain: Of the light.
        linear_mm: (c, 3) motion of a linear gel under the forces; None where it is not known.
        equations: That it solves; None for a start.
        markers: Data of the markers that it explains; None for a start.
        unexplained: Share of the change of light that is left.
        data: Linear data that it solves; None for a start.
        wider_n: (c, 3) forces before the last nodes were removed; None where none were.
    """

    force_n: Array
    displacement_mm: Array
    gain: float
    linear_mm: Array | None = None
    equations: NormalEquations | None = None
    markers: MarkerRows | None = None
    unexplained: float = 0.0
    data: Linearised | None = None
    wider_n: Array | None = None

    def near(self, other: FitState, share: float) -> bool:
        """Whether the resultant differs from another one by less than a share of it."""
        force, change = self.force_n.sum(axis=0), (self.force_n - other.force_n).sum(axis=0)
        return bool(np.linalg.norm(change) < share * np.linalg.norm(force))
