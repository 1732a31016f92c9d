"""The overlay picture of the README: a push with shear, drawn, through the pipeline of a user.

python -m bench.force.force_overlay    # writes docs/images/force_overlay.png

Nothing is given but the pictures; the deviations hold the tolerances of the gel.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from PIL import Image

from bench.bench_data import ROOT
from bench.rigs.force_rig import FRAMES_LOOK, NORMAL_N, SHEAR_N, THICKNESS_MM, large_rig
from gelslim_force.outputs.arrow_scale import scale_of_run
from gelslim_force.outputs.overlay import Overlay
from gelslim_force.sensor import open_sensor
from gelslim_twin.render.image_sensor import Exposure

TARGET = ROOT / "docs" / "images" / "force_overlay.png"
STEPS, SHARE = 7, 0.35
"""Steps of the push, and its end as a share of the press of the rig: less than a tenth of the
thickness deep, where the gel of both is linear."""
MODULUS_SHARE, THICKNESS_SHARE, RATIO = 0.03, 0.015, 0.004
"""Standard deviations of a gel that was calibrated with a ball and a scale."""


def main() -> None:
    """Push in steps, draw the last, print what it says beside the truth."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    rig = large_rig()
    draw = rig.renderer(replace(FRAMES_LOOK, exposure=Exposure(gamma=1.8)))
    rest = draw.frame().image
    tolerances = {
        "youngs_modulus_mpa": MODULUS_SHARE * rig.bundle.material.youngs_modulus_mpa,
        "thickness_mm": THICKNESS_SHARE * THICKNESS_MM,
        "poissons_ratio": RATIO,
    }
    sensor = open_sensor(replace(rig.bundle, tolerances=tolerances), reference=rest)
    for k, share in enumerate(np.linspace(0, SHARE, STEPS), 1):
        image = draw.frame(rig.press.at(share), number=k).image
        result = sensor.process(image, time_s=k / 90)
    assert result.wrench is not None
    truth = SHARE * np.array([*SHEAR_N, -NORMAL_N])
    print("found", result.wrench.force_n.round(3), "N, truth", truth.round(3), "N")
    print("deviations", result.wrench.standard_deviation[:3].round(4), "N")
    print("depth", -rig.press.nodes_mm[:, 2].min() * SHARE / THICKNESS_MM, "of the thickness")
    print("coverage", result.coverage, result.problems)
    built = sensor.calibration
    overlay = Overlay(rest.shape[:2], built.camera.project, built.reference.positions_px)
    picture = overlay.draw(image, result, scale_of_run([result]))
    # 256 colours: the sensor's noise does not compress otherwise.
    Image.fromarray(picture).quantize(256).save(TARGET, optimize=True)


if __name__ == "__main__":
    main()
