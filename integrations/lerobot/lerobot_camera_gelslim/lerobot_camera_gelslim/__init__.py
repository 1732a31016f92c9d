"""Tactile fingers made with gelslim-cad as cameras of LeRobot, and their forces as observations.

LeRobot imports this package because its name begins with `lerobot_camera_`. That registers the
camera type `gelslim` and the processor step `gelslim_forces`.
"""

from lerobot_camera_gelslim.camera import GelslimCamera
from lerobot_camera_gelslim.config_gelslim import GelslimCameraConfig
from lerobot_camera_gelslim.forces_step import GelslimForcesStep

__all__ = ["GelslimCamera", "GelslimCameraConfig", "GelslimForcesStep"]
