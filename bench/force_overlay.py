"""The overlay picture of the README: a push with shear, drawn, through the real pipeline.

python bench/force_overlay.py    # writes docs/images/force_overlay.png
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image
from rigs.force_rig import NORMAL_N, SHEAR_N, large_rig

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.outputs.arrow_scale import scale_of_run
from gelslim_force.outputs.overlay import Overlay
from gelslim_force.pipeline import ForcePipeline

TARGET = Path(__file__).parents[1] / "docs" / "images" / "force_overlay.png"
STEPS = 8


def main() -> None:
    """Push in steps, draw the last, print what it says beside the truth."""
    rig = large_rig()
    draw = rig.renderer()
    rest = draw.frame().image
    pipeline = ForcePipeline(rig.bundle, calibrate(rig.bundle, rest))
    for k, share in enumerate(np.linspace(0, 1, STEPS), 1):
        image = draw.frame(rig.press.at(share), number=k).image
        result = pipeline.process(image, time_s=k / 90, normal_mm=share * rig.press.nodes_mm[:, 2])
    assert result.wrench is not None
    print("found", result.wrench.force_n.round(3), "N, truth", [*SHEAR_N, -NORMAL_N], "N")
    print("coverage", result.coverage, result.problems)
    built = pipeline.calibration
    overlay = Overlay(rest.shape[:2], built.camera.project, built.reference.positions_px)
    picture = overlay.draw(image, result, scale_of_run([result]))
    # 256 colours: the sensor's noise does not compress otherwise.
    Image.fromarray(picture).quantize(256).save(TARGET, optimize=True)


if __name__ == "__main__":
    main()
