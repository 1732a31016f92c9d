"""A-priori bounds of the centre error against what the detector finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from render_rig import CAMERA, dent, detected_error, renderer, rms

from gelslim_twin.render.compression import Compression
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.exposure import a_priori_bound_px as rounding_bound_px
from gelslim_twin.render.look import Look
from gelslim_twin.render.print_faults import PrintFaults
from gelslim_twin.render.sensor_noise import SensorNoise
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.shading import a_priori_bound_px as shading_bound_px

CONTRAST_DN = 0.8 * 3 * 40
"""Sum over channels of what a dot lacks where the light is weakest."""


SOFT = Look(defocus=Defocus(0.0, 30.0, 0.75))


@pytest.fixture(scope="module")
def plain():
    """A soft frame with none of the effects, and what the detector errs by in it."""
    frame = renderer(SOFT).frame()
    return frame, detected_error(frame)


@pytest.mark.parametrize("name", ["noise", "compression", "print_faults"])
def test_detected_centres_move_less_than_the_bound_says(name, plain):
    without, error = plain
    size = float(without.diameter_px.min())
    scale = float(np.sqrt(abs(np.linalg.det(CAMERA.jacobian([[-10.0, 0, 0]])[0]))))
    effect = {
        "noise": SensorNoise(3.0, 30.0),
        "compression": Compression(70),
        "print_faults": PrintFaults(0.01),
    }[name]
    bound = {
        "noise": lambda: effect.a_priori_bound_px(size, CONTRAST_DN / 3, 130.0),
        "compression": lambda: effect.a_priori_bound_px(size, CONTRAST_DN / 3),
        "print_faults": lambda: effect.a_priori_bound_px(scale),
    }[name]()
    frame = renderer(replace(SOFT, **{name: effect})).frame()
    shift = detected_error(frame) + frame.centres_px - error - without.centres_px
    assert rms(shift) < bound
    assert rms(shift) > bound / 60
    assert np.percentile(np.abs(shift), 99) < 1.3 * bound


def test_shading_moves_centres_less_than_its_bound():
    state, look = dent(0.5), Look(defocus=Defocus(0.0, 30.0, 0.75), contrast=0.8)
    shaded = detected_error(
        renderer(replace(look, shading=Shading(ambient_share=0.0))).frame(state)
    )
    plain = renderer(look).frame(state)
    size = float(plain.diameter_px.max())
    # Largest curvature of the dent: 2 d / w² at its middle, per px of 1/16 mm and less.
    bend = 2 * 0.5 / 3.0**2 / 16
    bound = shading_bound_px(size, 0.3, bend, 25.0)
    moved_px = np.abs(shaded - detected_error(plain)).max()
    assert moved_px < bound + 0.02
    assert shading_bound_px(size, 0.0, bend, 25.0) == 0


def test_rounding_bound_is_far_below_a_hundredth_of_a_pixel():
    assert 0 < rounding_bound_px(7.0, 80.0) < 0.005
