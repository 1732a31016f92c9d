"""Everything that a sensor's real frames show, at usual strength, from one seed."""

from __future__ import annotations

from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.dirt import Dirt
from gelslim_twin.render.exposure import Exposure
from gelslim_twin.render.look import Look
from gelslim_twin.render.motion_blur import MotionBlur
from gelslim_twin.render.print_faults import PrintFaults
from gelslim_twin.render.sensor_noise import SensorNoise
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.specular import Specular


def sensor_look(aperture_mm: float, focus_mm: float, seed: int = 0) -> Look:
    """A small Bayer camera (blur 0.7 px in focus, some 40 electrons per grey value), a used gel.

    The ink is as dark and the response as bent as on published frames. Compression is left out:
    it depends on how the frames travel. Each effect draws from its own stream of `seed`.
    """
    return Look(
        level_dn=80.0,
        contrast=0.85,
        shading=Shading(),
        defocus=Defocus(aperture_mm, focus_mm, still_px=0.7),
        motion_blur=MotionBlur(open_share=0.5),
        exposure=Exposure(gamma=1.8),
        noise=SensorNoise(1.5, 40.0, seed),
        print_faults=PrintFaults(0.02, 0.004, 0.01, seed),
        dirt=Dirt(12, 4, seed=seed),
        specular=Specular(6, seed=seed),
    )
