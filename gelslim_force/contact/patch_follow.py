"""What carries a fitted patch from one fit, or frame, to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_shading import ShadingFit

Array = NDArray[np.float64]
STARTS = ((0.7, 0.5), (0.85, 1.5), (1.0, 4.0))
"""Sizes, over the outline's, and decays that the fit to the shading starts from."""
AFRESH, STEADY = 12, 0.08
"""Frames that a patch is followed for at most, and the change of its region, relative, up to
which it is, before it is sought afresh as well."""


@dataclass(frozen=True, eq=False)
class Region:
    """Where the light changed: its middle (2,), and the radius of a disc of its area."""

    middle_mm: Array
    reach_mm: float


@dataclass(frozen=True, eq=False)
class Followed:
    """What a frame hands on to the next; `age` frames ago the patch was sought afresh."""

    patch: ContactPatch
    fit: ShadingFit
    region: Region
    age: int


def settled(before: ContactPatch, after: ContactPatch) -> bool:
    """Whether the bins about the one patch serve for the other."""
    shift = float(np.linalg.norm(after.centre_mm - before.centre_mm)) / before.size_mm
    return shift < 0.3 and 0.7 < after.size_mm / before.size_mm < 1.15


def values_of(patch: ContactPatch, scale: float, decay: float) -> Array:
    """Start (4,) of the fit to the shading from a patch."""
    if patch.kind == "disc":
        return np.array([*patch.centre_mm, scale * patch.size_mm, decay])
    turn = np.deg2rad(patch.angle_deg)
    across = float(patch.centre_mm @ np.array([-np.sin(turn), np.cos(turn)]))
    return np.array([across, turn, scale * patch.size_mm, decay])
