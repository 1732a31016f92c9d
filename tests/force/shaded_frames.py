"""Marker frames with the shading of a pressed gel, for the tests of the contact patch.

Red light comes from -y and green from +y, both with Lambert's law at 40 degrees' elevation over a
third of ambient light; the height field is a solved contact on an elastic layer, seen where the
line of sight meets the sunken surface.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from bonded_layer import LayerContact, layer_contact
from camera_rig import off_centre_view
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from synthetic import Frame, Look, grid_of_dots, render

from gelslim_optics.camera.virtual_camera import VirtualCamera

Vector = NDArray[np.float64]
ELEVATION, AMBIENT = np.deg2rad(40.0), 0.33
GRID = grid_of_dots()
CAMERA = off_centre_view()
PAD_MM = (11.0, 10.5)


@cache
def contact(radius_mm: float, ball_mm: float, nu: float = 0.48) -> LayerContact:
    def profile(r):
        return ball_mm - np.sqrt(ball_mm**2 - r * r)

    return layer_contact(profile, radius_mm, 2.0, 0.147, nu)


@cache
def sight() -> tuple[Vector, Vector]:
    """Lines of sight of CAMERA, see `lines_of_sight`."""
    return lines_of_sight(CAMERA)


def lines_of_sight(camera: VirtualCamera) -> tuple[Vector, Vector]:
    """Where pixels meet the rest surface (n, 2), and the motion (n, 2) per mm of height."""
    y, x = np.mgrid[:480, :640]
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    rest = camera.backproject(pixels, 0.0)[:, :2]
    below = camera.backproject(pixels, -0.3)[:, :2]
    return rest, (rest - below) / 0.3


@cache
def _profile(radius_mm: float, ball_mm: float, nu: float) -> tuple[Vector, Vector, Vector]:
    r = np.linspace(0, 20, 1001)
    truth = contact(radius_mm, ball_mm, nu)
    z = ball_mm - np.sqrt(np.maximum(ball_mm**2 - r * r, 0)) - truth.depth_mm
    outside = r > radius_mm
    z[outside] = -truth.exact_sinking(r[outside])
    return r, z, np.gradient(z, r)


def pressed_heights(
    centre_mm,
    radius_mm: float,
    ball_mm: float,
    nu: float = 0.48,
    camera: VirtualCamera = CAMERA,
) -> tuple[Vector, Vector, Vector]:
    """Slopes (n,) along x and y, and height, of the surface that each pixel sees."""
    rest, lean = sight() if camera is CAMERA else lines_of_sight(camera)
    r, z, slope = _profile(radius_mm, ball_mm, nu)
    height = np.zeros(len(rest))
    for _ in range(6):
        away = rest + lean * height[:, None] - np.asarray(centre_mm)
        height = np.interp(np.hypot(*away.T), r, z)
    apart = np.hypot(*away.T)
    steep = np.interp(apart, r, slope) / np.maximum(apart, 1e-9)
    return steep * away[:, 0], steep * away[:, 1], height


def lit(slope_x: Vector, slope_y: Vector) -> Vector:
    """Brightness (n, 3) over that of a level surface."""
    size = np.sqrt(1 + slope_x**2 + slope_y**2)
    side, up = np.cos(ELEVATION), np.sin(ELEVATION)
    red = np.maximum((up - side * slope_y) / size, 0) / up
    green = np.maximum((up + side * slope_y) / size, 0) / up
    blue = np.maximum((up + 0.4 * side * slope_x) / size, 0) / up
    return AMBIENT + (1 - AMBIENT) * np.column_stack([red, green, blue])


SHARP = Look(blur=0.0, noise=0.0, seed=7)


@cache
def _level() -> Frame:
    return render(GRID, CAMERA, SHARP)


def shaded(
    slopes: tuple[Vector, Vector] | None = None,
    *,
    noise: float = 3.0,
    blur: float = 1.0,
    seed: int = 1,
    moved_mm: Vector | None = None,
    brightness: float = 1.0,
    dark_sides: float = 0.0,
    camera: VirtualCamera = CAMERA,
    light_gain: Vector | None = None,
    change: Vector | None = None,
) -> Frame:
    """A 480 x 640 frame; without slopes, of a level surface.

    `change` (480 x 640, 3) is the light over that of a level surface, in the place of slopes.

    With `dark_sides` each colour falls off as exp(-dark_sides · share of the way) across the gel,
    and blue is all but missing. `light_gain` (480 x 640, 3) is the exponent of the change of light
    that the slopes cause.
    """
    usual = camera is CAMERA and moved_mm is None
    frame = _level() if usual else render(GRID, camera, SHARP, moved_mm)
    image = frame.image.astype(float) * brightness
    if slopes is not None:
        change = lit(*slopes)
    if change is not None:
        if light_gain is not None:
            change = change**light_gain
        image *= change.reshape(480, 640, 3)
    if dark_sides:
        across = np.linspace(0, 1, 640)[None, :]
        image[:, :, 0] *= np.exp(-dark_sides * across)
        image[:, :, 1] *= np.exp(-dark_sides * (1 - across))
        image[:, :, 2] *= 0.08
    image = gaussian_filter(image, (blur, blur, 0))
    image += np.random.default_rng(seed).normal(0, noise, image.shape)
    picture = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return Frame(picture, frame.centres_px, frame.diameter_px, frame.drawn)
