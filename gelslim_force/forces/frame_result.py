"""What the pipeline knows after one frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as default
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import Wrench
from gelslim_force.tracking.tracks import Tracks

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ForceField:
    """Motion and forces at the c nodes of the pad's outer surface (`PadMesh.surface` order)."""

    points_mm: Array
    """(c, 3) at rest."""
    displacement_mm: Array
    """(c, 3); z is NaN where the normal motion is unknown."""
    force_n: Array
    """(c, 3) on the gel; z is NaN where the normal motion is unknown."""
    traction_mpa: Array
    """(c, 3) force over the node's share of the surface; pressure is its -z."""
    contact: NDArray[np.bool_]
    """(c,) nodes taken to be touched."""
    centre_of_pressure_mm: Array
    """(2,) NaN without a push."""
    slip_margin: float
    """1 - |tangential| / (friction |normal|) of the resultant; NaN where unknown."""
    misfit: float = 0.0
    """Share of the motion that the masked forces leave unexplained; 0 without a mask."""
    low_pass_mm: Array | None = None
    """(2,) standard deviation of the low-pass, tangential and normal; None for masked forces."""


@dataclass(frozen=True, eq=False)
class FrameResult:
    """One frame. `problems` says in words what was wrong; a frame that could not be read, or
    whose markers were not found, has no tracks, field and wrench."""

    index: int
    time_s: float
    tracks: Tracks | None = None
    marker_displacement_mm: Array | None = None
    """(m, 3) of the followed markers, in the order of the tracks; NaN where unknown."""
    field: ForceField | None = None
    wrench: Wrench | None = None
    normal_known: bool = False
    stage_ms: Mapping[str, float] = default(default_factory=dict)
    """Time per stage: detect, match, displace, normal, interpolate, force."""
    problems: tuple[str, ...] = ()
    extra: Mapping[str, Any] = default(default_factory=dict)
    """Findings of a normal model, such as the fitted contact patch."""

    @property
    def coverage(self) -> float:
        """Share of the markers seen and verified; 0 without tracks."""
        return 0.0 if self.tracks is None else self.tracks.coverage
