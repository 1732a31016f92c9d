"""Looks of real sensors, judged by their own frames; skipped where these are absent.

No design of these sensors is published, and no camera. Each is taken as a flat pad that fills the
view of a camera without perspective, lit evenly, and the dots have the places and ellipses at which
they are seen. What is tested is thus the look, and not the geometry.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "force" / "real_frames"))
sys.path.insert(0, str(Path(__file__).parents[2] / "force"))
from test_real_frames import PRESSES, picture
from test_real_unknown_shape import (  # noqa: F401 (sensor is a fixture)
    ELEVATION_DEG,
    LIGHT_TRAVELS_DEG,
    THICKNESS_MM,
    RealSensor,
    sensor,
)

from gelslim_force.dot_tracking import dots_at_rest
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera
from gelslim_optics.light.light_map import LightMap
from gelslim_twin.appearance.calibrate_look import renderers
from gelslim_twin.appearance.comparison import compare_press, compare_rest
from gelslim_twin.appearance.fit_look import RestPicture, fit_look
from gelslim_twin.render.surface_state import NodeLattice
from gelslim_twin.render.surroundings import Pad

pytestmark = pytest.mark.slow

WIDTH_MM = 27.0
LINEAR_GAIN = 1.8
"""Presses were seen with the response of a linear camera, see `test_real_unknown_shape`."""


def seen(name: str) -> tuple[RestPicture, Any]:
    """The picture with its dots, and a print that has them where they are."""
    image = picture(name)
    rest = dots_at_rest(image)
    height, width = image.shape[:2]
    per_mm = width / WIDTH_MM
    camera = VirtualCamera(
        position_mm=np.array([0.0, 0.0, -1000.0]),
        right=np.array([1.0, 0.0, 0.0]),
        down=np.array([0.0, 1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        focal_px=1000.0 * per_mm,
        image_width_px=width,
        image_height_px=height,
        window_bottom_z_mm=-THICKNESS_MM,
        layers=(Layer(THICKNESS_MM, 1.41),),
    )
    size = (width / per_mm, height / per_mm)
    x, y = (np.linspace(-side / 2, side / 2, 3) for side in size)
    colour = 0.8 * np.eye(3) + 0.1
    light = LightMap(x, y, np.ones((3, 3, 3)), LIGHT_TRAVELS_DEG, np.full(3, ELEVATION_DEG), colour)
    whole = np.flatnonzero((rest.dots.flags & 1) == 0)
    places = camera.backproject(rest.dots.centres_px, 0.0)
    grid = SimpleNamespace(positions_mm=places[:, :2], diameter_mm=np.full(len(places), 0.5))
    dots = rest.dots.take(whole)
    found = RestPicture(
        image, camera, dict(camera.to_record()), whole, places[whole], dots.centres_px,
        dots.moments_px2, np.zeros(0, dtype=np.int64), rest.pitch_px, light, Pad(*size), "real",
    )  # fmt: skip
    return found, grid


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("gelslim2/reference.png", 0.90),
        ("gelslim3/reference.jpg", 0.93),
        ("fots/press_0.png", 0.95),
        ("difftactile/reference.png", 0.98),
    ],
)
def test_a_drawn_picture_at_rest_looks_like_the_real_one(name: str, least: float) -> None:
    rest, grid = seen(name)
    fitted = fit_look(rest)
    noisy, plain = renderers(fitted.look, rest, grid)
    found = compare_rest(fitted, rest, plain.frame().image, noisy.frame().image)
    assert found["similarity"] >= least
    assert found["similarity_with_noise"] >= least - 0.09
    real, drawn = found["real"], found["drawn"]
    assert drawn["dot_contrast"] == pytest.approx(real["dot_contrast"], abs=0.07)
    assert drawn["edge_percent"] == pytest.approx(real["edge_percent"], rel=0.12)
    assert drawn["noise_dn"] == pytest.approx(real["noise_dn"], rel=0.25)
    for apart in range(3):
        assert drawn["noise_correlation"][apart] == pytest.approx(
            real["noise_correlation"][apart], abs=0.15
        )
    assert max(found["profile_error_dn"]) < 4.0


def test_presses_that_the_look_was_not_fitted_to(sensor: RealSensor) -> None:  # noqa: F811
    """The gel as the force pipeline finds it in eight presses of GelSlim 3.0, drawn again."""
    rest, grid = seen("gelslim3/reference.jpg")
    gain = np.zeros((3, 6))
    gain[:, 0] = LINEAR_GAIN
    fitted = fit_look(rest, shading_gain=gain)
    _, plain = renderers(fitted.look, rest, grid)
    lattice, at_rest = NodeLattice.of(sensor.estimator.points_mm), plain.frame().image
    rows = []
    for name in PRESSES:
        forces, _ = sensor.forces(name)
        assert forces is not None
        drawn = plain.frame(lattice.state(forces.displacement_mm)).image
        real = picture(f"gelslim3/{name}.jpg")
        rows.append(compare_press(name, real, rest.picture, drawn, at_rest))
    changed, of_rest, whole = (
        np.array([row[key] for row in rows])
        for key in ("similarity_changed", "similarity_changed_of_rest", "similarity")
    )
    assert whole.mean() > 0.885
    assert (changed > of_rest + 0.01).all()
    assert (changed - of_rest).mean() > 0.025
