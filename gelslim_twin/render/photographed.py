"""The untouched gel of a built sensor as its camera saw it, in the place of a drawn one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_twin.render.printed_dots import PrintedDots


@dataclass(frozen=True, eq=False)
class PhotographedGel:
    """What a picture at rest shows of one sensor.

    Attributes:
        dots: The dots as printed.
        irradiance: (h, w, k) float32 light that each pixel receives from the coat, without dots;
            it changes with the slope of the surface.
        glare_dn: (h, w, 3) float32 grey values that neither slope nor ink changes: reflections, and
            what is seen beside the gel.
        ink_share: (3,) contrast of the ink in each channel over the contrast of the look.

    Raises:
        ValueError: The shapes contradict one another.
    """

    dots: PrintedDots
    irradiance: NDArray[np.float32]
    glare_dn: NDArray[np.float32]
    ink_share: NDArray[np.float64]

    def __post_init__(self) -> None:
        size = self.irradiance.shape[:2]
        if self.irradiance.ndim != 3 or self.glare_dn.shape != (*size, 3):
            raise ValueError(
                f"irradiance {self.irradiance.shape} and glare {self.glare_dn.shape}: must be "
                "(h, w, k) and (h, w, 3)"
            )
        if self.ink_share.shape != (3,):
            raise ValueError(f"ink_share {self.ink_share.shape}: must be (3,)")
