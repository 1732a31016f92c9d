"""Shading of the deformed gel: each source's light changes with the slope towards it.

The coat is a Lambertian reflector. Light in the direction d (unit vector) gives the irradiance d·n
on a surface with outward normal n, and none where d·n is negative (attached shadow). Traced light
has its directions at each place, with what the coat has scattered back; see `LightFans`. Shadows
that one part of the surface casts on another are those of `gelslim_optics.light.relief`. A further
ambient share does not depend on the shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light.light_fans import STEEPEST
from gelslim_optics.light.relief import LATTICE_MM, relief_of
from gelslim_twin.render.surroundings import Sight

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
ROUNDS, NEAR_MM = 8, 1e-3
"""Limits of the iteration for the intersection of a ray with the deformed surface."""


@dataclass(frozen=True)
class Shading:
    """Ambient share of the light, and spacing `pixel_step` of the lattice that is computed.

    Without `relief` the surface casts no shadows, and its height does not count.
    """

    ambient_share: float = 0.0
    pixel_step: int = 4
    relief: bool = True

    def gain(
        self, sight: Sight, state: SurfaceState, light: LightMap, rest_mm: Array | None = None
    ) -> NDArray[np.float32]:
        """Irradiance (rows, columns, k) over that of a level surface, on the lattice of `sight`.

        `rest_mm` is the height (ny, nx) of a crowned gel at rest at the nodes of `state`.
        """
        from gelslim_twin.render.surface_kernel import apply_relief, fan_light, seen_slopes

        rest = sight.rest_mm.reshape(-1, 2)
        slopes, met = np.zeros((len(rest), 2)), np.empty((len(rest), 2))
        seen_slopes(
            state.padded_mm, state.origin_mm, state.step_mm,
            rest, sight.slope.reshape(-1, 2), ROUNDS, NEAR_MM, slopes, met,
        )  # fmt: skip
        gain = np.empty((len(rest), light.sources), dtype=np.float32)
        fans = light.light_fans
        fan_light(
            slopes, rest, fans.tables, np.array(fans.lower_mm), np.array(fans.upper_mm), STEEPEST,
            0.0, gain,
        )  # fmt: skip
        if self.relief:
            apply_relief(met, *relief_on(light, state, rest_mm), gain)
        gain += np.float32(self.ambient_share) * (1 - gain)
        return gain.reshape(*sight.rest_mm.shape[:2], light.sources)


def relief_on(
    light: LightMap, state: SurfaceState, rest_mm: Array | None
) -> tuple[Array, Array, Array]:
    """Light on a surface over that of its slopes alone.

    Args:
        light: On the untouched gel.
        state: The surface.
        rest_mm: Its height (ny, nx) at rest at the nodes of `state`; None for a level one.

    Returns:
        The factor (m, n, k) on a lattice, the lattice's first node (2,) and its steps (2,) in mm.
    """
    height = state.displacement_mm[..., 2]
    if rest_mm is not None:
        height = height - rest_mm
    stride = max(1, round(LATTICE_MM / float(state.step_mm.min())))
    step = stride * state.step_mm
    height = np.ascontiguousarray(height[::stride, ::stride])
    return relief_of(light).on(height, state.origin_mm, step), state.origin_mm, step
