"""Pictures of balls pressed on sensors whose gel and light differ from their design.

Motions come from `pressed_disc`, pictures from `shaded_frames`: nothing of it is the pipeline's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from camera_rig import off_centre_view
from numpy.typing import NDArray
from pressed_disc import pressed_disc
from pressed_samples import calibration, lit_bundle, reference
from scipy.interpolate import CubicSpline
from sensor_samples import sensor_grid
from shaded_frames import PAD_MM, shaded, sight
from synthetic import moved_rims

from gelslim_force.calibration.sensor_calibration import Calibration
from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.material import Material

Array = NDArray[np.float64]
YOUNG_MPA, THICKNESS_MM = 0.147, 2.0
"""As designed, see `sensor_samples`."""


@dataclass(frozen=True)
class Built:
    """A built sensor: what its design does not know.

    Attributes:
        young: Young's modulus over that of the design.
        thickness: Thickness over that of the design.
        poissons_ratio: As designed too.
        ball_mm: Radius of the ball that presses.
        sticking: Whether the gel sticks to the ball.
        skin_n_per_mm: Membrane stiffness of what covers the gel.
        light: Gain of the light of each colour in the middle of the gel.
        light_tilt: Change of the gain from the middle to the far end, relative.
    """

    young: float = 1.0
    thickness: float = 1.0
    poissons_ratio: float = 0.48
    ball_mm: float = 6.0
    sticking: bool = False
    skin_n_per_mm: float = 0.0
    light: tuple[float, float, float] | None = None
    light_tilt: float = 0.0

    def light_gain(self, places_mm: Array) -> Array | None:
        """(n, 3) gain at places (n, 2); None for light as designed."""
        if self.light is None:
            return None
        along = 1 + self.light_tilt * places_mm[:, :1] / PAD_MM[0]
        return np.asarray(along * np.array(self.light))


@cache
def ball_bundle(poissons_ratio: float = 0.48) -> Bundle:
    """The sensor of the samples with another Poisson's ratio."""
    return lit_bundle().with_gel(Material(YOUNG_MPA, poissons_ratio, 1000.0))


def ball_calibration() -> Calibration:
    """Its calibration."""
    return calibration()


def rest_picture() -> NDArray[np.uint8]:
    """Its picture without contact."""
    return reference().image


def ball_picture(
    built: Built, load_n: float, place_mm: Array, seed: int, *, noise: float = 2.5
) -> NDArray[np.uint8]:
    """The picture of the ball under a load."""
    disc = pressed_disc(
        built.ball_mm, THICKNESS_MM * built.thickness, built.poissons_ratio, built.sticking,
        built.skin_n_per_mm / (YOUNG_MPA * built.young),
    )  # fmt: skip
    radius, outward, height = disc.at_force(load_n / (YOUNG_MPA * built.young))
    assert radius < disc.contact_mm[-1], "the load is beyond the states that were solved"
    # Where the surface is now: it moved outwards too.
    along = CubicSpline(disc.r_mm + outward, height)
    steep = along.derivative()
    rest, lean = sight()
    seen = np.zeros(len(rest))
    for _ in range(6):
        offset = rest + lean * seen[:, None] - place_mm
        away = np.minimum(np.hypot(*offset.T), disc.r_mm[-2])
        seen = along(away)
    slope = steep(away) / np.maximum(away, 1e-9)
    out, down = CubicSpline(disc.r_mm, outward), CubicSpline(disc.r_mm, height)

    def motion(places_mm: Array) -> Array:
        away = places_mm - place_mm
        r = np.hypot(*away.T)
        return np.column_stack([away * (out(r) / np.maximum(r, 1e-9))[:, None], down(r)])

    frame = shaded(
        (slope * offset[:, 0], slope * offset[:, 1]),
        noise=noise, seed=seed, moved_mm=moved_rims(motion, sensor_grid()),
        camera=off_centre_view(), light_gain=built.light_gain(rest),
    )  # fmt: skip
    return frame.image
