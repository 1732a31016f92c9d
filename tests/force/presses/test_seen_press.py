"""What a view of presses takes from the calibration of the camera."""

from __future__ import annotations

import numpy as np
from camera_rig import off_centre_view
from pressed_samples import lit_bundle
from synthetic import Look, render

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.presses.seen_press import PressView
from ifem_export.markers.grid import build_marker_grid


def test_dots_have_the_size_of_the_print_and_not_of_its_design() -> None:
    """The design has dots of 0.45 mm, and ink spreads."""
    grid = build_marker_grid(19, 18, 1.1, 0.52, anchors="odd_sized")
    picture = render(grid, off_centre_view(), Look(noise=2.5, blur=1.0, seed=5)).image
    calibration = calibrate(lit_bundle(), picture)
    view = PressView(lit_bundle(), calibration, picture, 6.0)
    printed = grid.diameter_mm[calibration.reference.markers]
    off = view.diameter_mm / printed - 1
    assert abs(np.median(off)) < 0.02
    assert np.abs(off).max() < 0.08
