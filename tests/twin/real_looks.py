"""Real sensors as the fit of a look takes them, and their presses drawn again.

No design of these sensors is published, and no camera. Each is taken as a flat pad that fills the
view of a camera without perspective, lit evenly, and the dots have the places and ellipses at which
they are seen. What is compared is thus the look, and not the geometry.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "force" / "real_frames"))
sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from test_real_frames import PRESSES, picture
from test_real_unknown_shape import (
    ELEVATION_DEG,
    LIGHT_TRAVELS_DEG,
    THICKNESS_MM,
    RealSensor,
)

from gelslim_force.dot_tracking import dots_at_rest
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera
from gelslim_optics.light.light_map import LightMap
from gelslim_twin.appearance.calibrate_look import renderers
from gelslim_twin.appearance.comparison import compare_press, compare_rest
from gelslim_twin.appearance.fit_look import RestPicture, fit_look
from gelslim_twin.render.surface_state import NodeLattice
from gelslim_twin.render.surroundings import Pad

Picture = NDArray[np.uint8]
Pair = tuple[Picture, Picture]
RESTS = ("gelslim2/reference.png", "gelslim3/reference.jpg", "fots/press_0.png",
         "difftactile/reference.png")  # fmt: skip
"""Pictures at rest; that of fots has a light press in its middle."""
WIDTH_MM = 27.0
LINEAR_GAIN = 1.8
"""The presses are seen with the response of a linear camera, see `test_real_unknown_shape`."""
SPREAD_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)
RISE_DEG = (12.0, 25.0, 45.0)
"""Directions of the light of a lamp, of equal strength: light of one direction has hard shadows."""


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
    light = LightMap(
        x, y, np.ones((3, 3, 3)), LIGHT_TRAVELS_DEG, np.full(3, ELEVATION_DEG), colour, fans()
    )
    whole = np.flatnonzero((rest.dots.flags & 1) == 0)
    places = camera.backproject(rest.dots.centres_px, 0.0)
    grid = SimpleNamespace(positions_mm=places[:, :2], diameter_mm=np.full(len(places), 0.5))
    dots = rest.dots.take(whole)
    cut = np.setdiff1d(np.arange(len(places)), whole)
    found = RestPicture(
        image, camera, dict(camera.to_record()), whole, places[whole], dots.centres_px,
        dots.moments_px2, cut, rest.pitch_px, light, Pad(*size), "real",
    )  # fmt: skip
    return found, grid


def fans() -> NDArray[np.float64]:
    """Light of three lamps that comes from a range of directions, as in `LightFans.sums`."""
    turn, rise = np.deg2rad(np.array([(a, e) for a in SPREAD_DEG for e in RISE_DEG])).T
    sums = np.empty((3, 1, 1, len(turn), 3))
    for lamp, azimuth in enumerate(np.deg2rad(LIGHT_TRAVELS_DEG)):
        steep = 1 / np.tan(rise)
        way = (np.ones_like(turn), steep * np.cos(azimuth + turn), steep * np.sin(azimuth + turn))
        sums[lamp, 0, 0] = np.stack(way, axis=1) / len(turn)
    return sums


def rest_compared(name: str) -> tuple[dict[str, Any], Pair]:
    """The comparison of a picture at rest, and the real and the drawn one."""
    rest, grid = seen(name)
    fitted = fit_look(rest)
    noisy, plain = renderers(fitted.look, rest, grid)
    drawn = noisy.frame().image
    return compare_rest(fitted, rest, plain.frame().image, drawn), (rest.picture, drawn)


def presses_compared(sensor: RealSensor) -> tuple[list[dict[str, Any]], dict[str, Pair]]:
    """Eight presses of GelSlim 3.0 that the look is not fitted to, drawn again.

    The gel is as the force pipeline finds it in each picture.
    """
    rest, grid = seen("gelslim3/reference.jpg")
    gain = np.zeros((3, 6))
    gain[:, 0] = LINEAR_GAIN
    noisy, plain = renderers(fit_look(rest, shading_gain=gain).look, rest, grid)
    lattice, at_rest = NodeLattice.of(sensor.estimator.points_mm), plain.frame().image
    rows, pairs = [], {}
    for name in PRESSES:
        forces, _ = sensor.forces(name)
        assert forces is not None
        moved, real = lattice.state(forces.displacement_mm), picture(f"gelslim3/{name}.jpg")
        rows.append(compare_press(name, real, rest.picture, plain.frame(moved).image, at_rest))
        pairs[name] = real, noisy.frame(moved).image
    return rows, pairs
