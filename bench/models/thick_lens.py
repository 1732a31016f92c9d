"""A thick lens with distortion, traced from the sensor to the gel, and where it shows a point.

It stands for a real camera and shares no formula with the product's: the lens has two principal
planes, its entrance pupil lies before the first of them, and its distortion is a law of angles, no
polynomial. Mirror and layers act on single rays, see `thin_lens`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bench.models.thin_lens import GOLDEN, ThinLens
from gelslim_cad.dimensions import Dimensions

Array = NDArray[np.float64]
SEPARATION, PUPIL, DISTORTION = 0.10, 0.05, -0.015
"""Of an assumed board lens: principal planes apart, and pupil before them, in focal lengths; change
of the image's radius at the corner of the picture."""
SHARP_PX = 1e-10


@dataclass(frozen=True)
class ThickLens(ThinLens):
    """`centre` is the front principal point; the sensor is `sensor_mm` behind the rear one."""

    pupil_mm: float = 0.0
    """How far the entrance pupil is before the front principal plane."""
    bend: float = 1.0
    """A ray at the angle θ behind the lens is imaged at the radius v tan(bend θ) / bend."""

    @classmethod
    def of(
        cls,
        d: Dimensions,
        separation: float = SEPARATION,
        pupil: float = PUPIL,
        distortion: float = DISTORTION,
    ) -> ThickLens:
        """The lens of a finger: its sensor and the target of the build guide are in their places.

        The lens is screwed until the target is sharp, s + v = L for the distance L between the two
        less that of the principal planes, and 1/f = 1/s + 1/v.

        Args:
            d: Dimensions of the finger.
            separation: Distance of the principal planes in focal lengths.
            pupil: How far the entrance pupil is before the front one, in focal lengths.
            distortion: Share by which the radius of the image changes at the picture's corner.
        """
        thin = ThinLens.as_built(d)
        f, apart_mm = thin.focal_mm, separation * thin.focal_mm
        sensor = thin.centre - thin.sensor_mm * thin.forward
        target_mm = f * thin.sensor_mm / (thin.sensor_mm - f)
        length_mm = thin.sensor_mm + target_mm - apart_mm
        v = length_mm / 2 - np.sqrt(length_mm**2 / 4 - f * length_mm)
        corner = np.arctan(np.hypot(*thin.size_px) / 2 * thin.pitch_mm / v)

        def change(bend: float) -> float:
            return float(np.tan(bend * corner) / (bend * np.tan(corner)) - 1 - distortion)

        own = {field.name: getattr(thin, field.name) for field in fields(thin)}
        own |= {"centre": sensor + (v + apart_mm) * thin.forward, "sensor_mm": float(v)}
        bend = float(brentq(change, 0.2, 1.3, xtol=1e-14))
        return cls(**own, pupil_mm=pupil * f, bend=bend)

    @property
    def conjugate_mm(self) -> float:
        """Distance before the front principal plane of the plane that is sharp."""
        return self.focal_mm * self.sensor_mm / (self.sensor_mm - self.focal_mm)

    def leaving(self, uv: Array, pupil: Array) -> tuple[Array, Array]:
        """Points (n, 3) of the entrance pupil and unit rays (n, 3) to the pixels' conjugates."""
        seen = (uv - (np.asarray(self.size_px) - 1) / 2) * self.pitch_mm
        radius = np.maximum(np.hypot(*seen.T), 1e-12)
        ideal = np.tan(np.arctan(self.bend * radius / self.sensor_mm) / self.bend) / radius
        axes = np.array([self.right, self.down])
        start = self.centre + self.pupil_mm * self.forward + pupil @ axes * self.aperture_mm / 2
        sharp = self.forward + (seen * ideal[:, None]) @ axes
        ray = self.centre + self.conjugate_mm * sharp - start
        return start, ray / np.linalg.norm(ray, axis=1)[:, None]


def pupil_points(count: int) -> Array:
    """Points (count, 2) spread evenly over the unit pupil, in opposite pairs."""
    k = np.arange(count // 2)
    radius, turn = np.sqrt((k + 0.5) / len(k)), GOLDEN * k
    half = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.concatenate([half, -half])


def centroids_px(lens: ThinLens, points_mm: Array, guess_px: Array, rays: int = 64) -> Array:
    """Centroids (n, 2) of the images of points (n, 3), each by a bundle of rays.

    Each ray's pixel is found by Newton's method, with the slopes of the ray through the middle of
    the pupil. Raises ArithmeticError where it does not converge.
    """
    pupil = pupil_points(rays)
    step = np.array([[0.5, 0.0], [0.0, 0.5]])
    middle, z = np.zeros_like(guess_px), points_mm[:, 2]
    columns = [
        lens.on_gel(guess_px + s, middle, z) - lens.on_gel(guess_px - s, middle, z) for s in step
    ]
    px_per_mm = np.repeat(np.linalg.inv(np.stack(columns, axis=-1)), rays, axis=0)
    many, through = np.repeat(points_mm, rays, axis=0), np.tile(pupil, (len(points_mm), 1))
    pixels = np.repeat(guess_px, rays, axis=0)
    for _ in range(60):
        off = lens.on_gel(pixels, through, many[:, 2]) - many[:, :2]
        move = np.einsum("nij,nj->ni", px_per_mm, off)
        pixels = pixels - move
        if np.abs(move).max() < SHARP_PX:
            return np.asarray(pixels.reshape(len(points_mm), rays, 2).mean(axis=1))
    raise ArithmeticError(f"the pixels of a bundle still move by {np.abs(move).max():.1e} px")
