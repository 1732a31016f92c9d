"""What a configuration of LeRobot says of a finger."""

from __future__ import annotations

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from gelslim_force.calibration.file import read_calibration


@CameraConfig.register_subclass("gelslim")
@dataclass(kw_only=True)
class GelslimCameraConfig(CameraConfig):
    """A finger with its camera.

    Robots of LeRobot describe their pictures by `width` and `height` of this configuration, so
    these are taken from the calibration where they are not given.

    Attributes:
        bundle: Folder of the bundle.
        calibration: File of `gelslim calibrate`.
        source: Where pictures come from, as for `gelslim force`: `camera:0`, the address of a
            stream, or a recording.
        indenter: Shape of the object where it is known, such as `sphere:10`; empty otherwise.
        gel_calibration, light_calibration: Files of `gelslim calibrate-gel` and
            `gelslim calibrate-light`; empty without.
        grid: Rows and columns of the grid of forces.
    """

    bundle: str
    calibration: str
    source: str = "camera:0"
    indenter: str = ""
    gel_calibration: str = ""
    light_calibration: str = ""
    grid: tuple[int, int] = (12, 12)

    def __post_init__(self) -> None:
        """Take the size of the picture from the calibration.

        Raises:
            CalibrationError: The calibration cannot be read.
            ValueError: Another size is asked for; pictures are not scaled, because markers are
                measured in them.
        """
        camera = read_calibration(self.calibration).camera
        size = (camera.image_width_px, camera.image_height_px)
        asked = (self.width or size[0], self.height or size[1])
        if asked != size:
            raise ValueError(
                f"width, height = {asked[0]}, {asked[1]}: the sensor was calibrated with pictures "
                f"of {size[0]} x {size[1]} px, and they are not scaled; leave width and height out"
            )
        self.width, self.height = size
