"""Which effects a sensor's frames show, and how strongly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_twin.render.compression import Compression
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.dirt import Dirt
    from gelslim_twin.render.exposure import Exposure
    from gelslim_twin.render.motion_blur import MotionBlur
    from gelslim_twin.render.print_faults import PrintFaults
    from gelslim_twin.render.sensor_noise import SensorNoise
    from gelslim_twin.render.shading import Shading
    from gelslim_twin.render.specular import Specular


@dataclass(frozen=True)
class Look:
    """Effects by their parameters; None leaves one out, and its module unloaded.

    `level_dn` is the grey value that unit irradiance gives in a lamp's own colour; where a place
    gets three times the mean light, the usual one just saturates, and saturation moves dots'
    centres. `contrast` is the share of light that ink takes. `samples` 0 fills dots by exact area,
    n > 0 by n x n samples per pixel. Raises ValueError for values out of range.
    """

    level_dn: float = 80.0
    contrast: float = 0.8
    samples: int = 0
    shading: Shading | None = None
    defocus: Defocus | None = None
    motion_blur: MotionBlur | None = None
    exposure: Exposure | None = None
    noise: SensorNoise | None = None
    print_faults: PrintFaults | None = None
    dirt: Dirt | None = None
    specular: Specular | None = None
    compression: Compression | None = None

    def __post_init__(self) -> None:
        if not 0 < self.level_dn <= 1e4:
            raise ValueError(f"level_dn = {self.level_dn}: must be in 0 ... 10000")
        if not 0 <= self.contrast <= 1:
            raise ValueError(f"the ink's contrast = {self.contrast}: must be in 0 ... 1")
        if self.samples < 0:
            raise ValueError(f"samples = {self.samples}: 0 for exact areas, or a count per pixel")
