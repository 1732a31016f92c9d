"""A thin lens of finite aperture, built as BUILD.md says, traced from the sensor to the gel.

It shares no formula with the product: the lens maps a point of the sensor to its conjugate point
(1/f = 1/s + 1/v), the mirror and the layers act on single rays by the vector laws of reflection and
refraction. A lens that distorts draws a point nearer to the axis or farther from it than a perfect
one would; a table of radii tells where that was. The camera and the mirror stand where the parts
put them, and the lens is turned until the target of the build guide is sharp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from gelslim_cad.dimensions import Dimensions

Array = NDArray[np.float64]
GOLDEN = 2.399963229728653
IDEAL = (np.array([0.0, 1.0]), np.array([0.0, 1.0]))
WIDEST = 3.0
"""Tangent of the ray farthest from the axis."""


@dataclass(frozen=True)
class ThinLens:
    """Lens, sensor, mirror and layers of a finger; mm, sensor frame."""

    centre: Array
    forward: Array
    right: Array
    down: Array
    focal_mm: float
    sensor_mm: float
    """Distance of the sensor behind the lens."""
    aperture_mm: float
    pitch_mm: float
    size_px: tuple[int, int]
    mirror_point: Array
    mirror_normal: Array
    layers: tuple[tuple[float, float], ...]
    """Lower face and refractive index of each layer, the one next to the camera first."""
    radii: tuple[Array, Array] = IDEAL
    """Distance from the axis of the point that is drawn, and of the perfect one; 0 and larger, in
    units of the distance of the sensor."""

    @classmethod
    def as_built(cls, d: Dimensions, extension_mm: float | None = None) -> ThinLens:
        """The lens of a finger, focused on the target of the build guide, or moved out so far.

        The guide prints the target's distance from the front of the lens to 0.01 mm.
        """
        f = d["camera.focal_length_mm"]
        if extension_mm is None:
            front_mm = d["camera_pose.lens_front_mm"]
            target_mm = round(d["view.focus_mm"] - front_mm, 2) + front_mm
            extension_mm = f * target_mm / (target_mm - f) - f
        pitch, angle = (np.radians(d[n]) for n in ("camera_pose.pitch_deg", "mirror.angle_deg"))
        gel = d["stack.gel_total_mm"]
        acrylic = d["design.light_guide.thickness_mm"]
        return cls(
            centre=np.array([d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]]),
            forward=np.array([np.cos(pitch), 0.0, -np.sin(pitch)]),
            right=np.array([0.0, 1.0, 0.0]),
            down=np.array([np.sin(pitch), 0.0, np.cos(pitch)]),
            focal_mm=f,
            sensor_mm=f + extension_mm,
            aperture_mm=f / d["camera.f_number"],
            pitch_mm=d["camera.sensor_width_mm"] / d["camera.image_width_px"],
            size_px=(d["camera.image_width_px"], d["camera.image_height_px"]),
            mirror_point=np.array([d["mirror.lower_x_mm"], 0.0, d["mirror.lower_z_mm"]]),
            mirror_normal=np.array([-np.sin(angle), 0.0, np.cos(angle)]),
            layers=(
                (-(acrylic + gel), d["material.acrylic.refractive_index"]),
                (-gel, d["material.gel.refractive_index"]),
            ),
            radii=_radii(d),
        )

    def on_gel(
        self, pixels: ArrayLike, in_pupil: ArrayLike, height_mm: Array | float = 0.0
    ) -> Array:
        """Where (x, y) rays (n, 2) from pixels, through points of the unit pupil, meet the gel.

        The rays are followed to the gel's outer surface, or to other heights, scalar or (n,).
        """
        start, ray = self._reflected(
            *self.leaving(np.asarray(pixels, float), np.asarray(in_pupil, float))
        )
        before = 1.0
        for lower_z, index in self.layers:
            start = start + ray * ((lower_z - start[:, 2]) / ray[:, 2])[:, None]
            ray = _refracted(ray, before / index)
            before = index
        end = start + ray * ((height_mm - start[:, 2]) / ray[:, 2])[:, None]
        return np.asarray(end[:, :2])

    def image_of(self, points_mm: ArrayLike) -> Array:
        """Pixels (n, 2) of points (n, 3) in the air before the bare camera: right, down, forward.

        Rays through the middle of the lens are straight.
        """
        x, y, z = np.asarray(points_mm, float).T
        perfect = np.column_stack([x / z, y / z])
        radius = np.maximum(np.hypot(*perfect.T), 1e-12)
        drawn = radius if self.radii is IDEAL else np.interp(radius, *self.radii[::-1])
        middle = (np.asarray(self.size_px) - 1) / 2
        at_mm = perfect * (drawn / radius)[:, None] * self.sensor_mm
        return np.asarray(middle + at_mm / self.pitch_mm)

    def leaving(self, uv: Array, pupil: Array) -> tuple[Array, Array]:
        """Points (n, 3) of the lens and unit rays (n, 3) that leave it towards the mirror."""
        middle = (np.asarray(self.size_px) - 1) / 2
        drawn = (uv - middle) * self.pitch_mm
        radius = np.maximum(np.hypot(*drawn.T) / self.sensor_mm, 1e-12)
        perfect = drawn * (self._perfect(radius) / radius)[:, None]
        across, along = perfect.T[:, :, None]
        chief = self.forward * self.sensor_mm + self.right * across + self.down * along
        distance = self.focal_mm * self.sensor_mm / (self.sensor_mm - self.focal_mm)
        shift = (self.right * pupil[:, :1] + self.down * pupil[:, 1:]) * self.aperture_mm / 2
        start = self.centre + shift
        ray = chief * (distance / self.sensor_mm) - shift
        return start, ray / np.linalg.norm(ray, axis=1)[:, None]

    def _perfect(self, drawn: Array) -> Array:
        """The radius without distortion of a radius that is drawn."""
        if self.radii is IDEAL:
            return drawn
        return np.asarray(np.interp(drawn, *self.radii))

    def _reflected(self, start: Array, ray: Array) -> tuple[Array, Array]:
        away = (self.mirror_point - start) @ self.mirror_normal / (ray @ self.mirror_normal)
        met = start + ray * away[:, None]
        return met, ray - 2 * np.outer(ray @ self.mirror_normal, self.mirror_normal)

    def picture(
        self,
        dots_mm: ArrayLike,
        diameter_mm: ArrayLike,
        samples: int = 32,
        moved_mm: ArrayLike | None = None,
    ) -> Array:
        """Picture (h, w) from 0 to 1 of dark dots (k, 2), diameters (k,), on a bright gel.

        Of each pixel an even number of `samples` is traced. Dots that have moved (k, 2) stay
        nearer to their own place than to the next one's.
        """
        at = np.asarray(dots_mm, float)
        moved = np.zeros_like(at) if moved_mm is None else np.asarray(moved_mm, float)
        dots = _Dots(at, np.asarray(diameter_mm, float), moved)
        width, height = self.size_px
        u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
        pixels = np.column_stack([u.ravel(), v.ravel()])
        total = np.zeros(len(pixels))
        for k in range(samples // 2):
            radius, turn = np.sqrt((k + 0.5) / (samples // 2)), GOLDEN * k
            in_pupil = radius * np.array([np.cos(turn), np.sin(turn)])
            in_pixel = np.array([(0.5 + 0.7548776662 * k) % 1, (0.5 + 0.5698402910 * k) % 1]) - 0.5
            # In opposite pairs, so that the mean ray goes through the middle of lens and pixel.
            for sign in (1.0, -1.0):
                pupil = np.broadcast_to(sign * in_pupil, pixels.shape)
                total += dots.covers(self.on_gel(pixels + sign * in_pixel, pupil))
        return np.asarray(1 - total.reshape(height, width) / samples)


def _radii(d: Dimensions) -> tuple[Array, Array]:
    """Radii that the lens of the spec draws and would draw without distortion, in even steps."""
    k = [d[f"camera.distortion.k{n}"] for n in (1, 2, 3, 4)]
    wide, tv = d["camera.distortion.model"] == "kannala_brandt", d["camera.distortion.tv_percent"]
    if tv is not None:
        k[0] = _brown_of_tv(d, tv)
    if not (wide or any(k)):
        return IDEAL
    assert d["camera.distortion.p1"] == d["camera.distortion.p2"] == 0
    perfect = np.linspace(0, WIDEST, 200_001)
    bent = np.arctan(perfect) if wide else perfect
    drawn = bent + sum(c * bent ** (2 * n + 3) for n, c in enumerate(k))
    rising = np.append(True, np.cumsum(np.diff(drawn) <= 0) == 0)
    return drawn[rising], perfect[rising]


def _brown_of_tv(d: Dimensions, tv_percent: float) -> float:
    """The coefficient by which a rectangle's sides are so much longer or shorter than its middle.

    Its picture without distortion fills the sensor, the lens focused where the sheet's field of
    view holds.
    """
    f, at = d["camera.focal_length_mm"], d["camera.field_of_view_at_mm"]
    image_mm = f if at is None else 1 / (1 / f - 1 / at)
    x, y = d["camera.sensor_width_mm"] / 2 / image_mm, d["camera.sensor_height_mm"] / 2 / image_mm

    def too_large(k1: float) -> float:
        side, middle = (y * (1 + k1 * (u * u + y * y)) for u in (x, 0.0))
        return 100 * (side - middle) / middle - tv_percent

    return float(brentq(too_large, -0.9 / y**2, 10.0, xtol=1e-14))


def _refracted(ray: Array, ratio: float) -> Array:
    """Rays (n, 3) after a horizontal face, the ratio of the indices before and after it."""
    bent = ray * ratio
    bent[:, 2] = np.sqrt(1 - bent[:, 0] ** 2 - bent[:, 1] ** 2)
    return bent


class _Dots:
    """Dots on a regular lattice, some of its sites empty."""

    def __init__(self, dots_mm: Array, diameter_mm: Array, moved_mm: Array) -> None:
        self.first = dots_mm.min(axis=0)
        self.pitch = np.diff(np.unique(np.round(dots_mm[:, 0], 6))).min()
        sites = np.round((dots_mm - self.first) / self.pitch).astype(int) + 1
        self.radius = np.full(sites.max(axis=0) + 2, -1.0)
        self.radius[sites[:, 0], sites[:, 1]] = diameter_mm / 2
        self.moved = np.zeros((*self.radius.shape, 2))
        self.moved[sites[:, 0], sites[:, 1]] = moved_mm

    def covers(self, points: Array) -> NDArray[np.bool_]:
        site = np.round((points - self.first) / self.pitch)
        x, y = np.clip(site.astype(int) + 1, 0, np.array(self.radius.shape) - 1).T
        off = points - self.first - site * self.pitch - self.moved[x, y]
        return np.asarray(np.hypot(*off.T) <= self.radius[x, y])
