"""Shading of the deformed gel: each source's light changes with the slope towards it.

The coat is a Lambertian reflector. Light in the direction d (unit vector) gives the irradiance d·n
on a surface with outward normal n, and none where d·n is negative (attached shadow). Traced light
has its directions at each place, with what the coat has scattered back; see `LightFans`. A further
ambient share does not depend on the slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light.light_fans import STEEPEST
from gelslim_twin.render.surroundings import Sight

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
_ROUNDS, _NEAR_MM = 8, 1e-3
"""Limits of the iteration for the intersection of a ray with the deformed surface."""


@dataclass(frozen=True)
class Shading:
    """Ambient share of the light, and spacing `pixel_step` of the lattice that is computed."""

    ambient_share: float = 0.0
    pixel_step: int = 4

    def gain(self, sight: Sight, state: SurfaceState, light: LightMap) -> NDArray[np.float32]:
        """Irradiance (rows, columns, k) over that of a level surface, on the lattice of `sight`."""
        from gelslim_twin.render.surface_kernel import fan_light, seen_slopes

        rest = sight.rest_mm.reshape(-1, 2)
        slopes = np.zeros((len(rest), 2))
        seen_slopes(
            state.padded_mm, state.origin_mm, state.step_mm,
            rest, sight.slope.reshape(-1, 2), _ROUNDS, _NEAR_MM, slopes,
        )  # fmt: skip
        gain = np.empty((len(rest), light.sources), dtype=np.float32)
        fans = light.light_fans
        fan_light(
            slopes, rest, fans.tables, np.array(fans.lower_mm), np.array(fans.upper_mm), STEEPEST,
            self.ambient_share, gain,
        )  # fmt: skip
        return gain.reshape(*sight.rest_mm.shape[:2], light.sources)
