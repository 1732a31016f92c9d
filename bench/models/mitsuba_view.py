"""What a camera sees of a lit coat: rays by Mitsuba 3 through window and gel, ink and grey values.

Every ray of the camera is refracted at each face and weighted by what the face lets through; light
that a face throws back is left out. Where it meets the coat, the texture coordinates name the
material point, so that ink moves and stretches with the gel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from bench.models.mitsuba_finger import film_camera
from bench.models.mitsuba_photons import coat_of
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
FACES = 6
"""Most faces between camera and coat."""
FINER = 2
"""Rays along each side of a pixel."""
INK = 0.12
"""Reflectance of ink over that of the coat."""


@dataclass(frozen=True, eq=False)
class Print:
    """Dots on the coat at rest: places (m, 2) and diameters (m,) in mm."""

    places_mm: Array
    diameter_mm: Array

    def reflectance(self, places_mm: Array) -> Array:
        """(n,) over that of the bare coat at material places (n, 2)."""
        away, nearest = cKDTree(self.places_mm).query(places_mm)
        return np.where(away < self.diameter_mm[nearest] / 2, INK, 1.0)


@dataclass(frozen=True)
class Response:
    """A camera of colour with sRGB values of eight bits.

    Attributes:
        exposure: Linear value of white over the light of a colour.
        mixing: (sources, 3) what each channel sees of the light of each source.
        blur_px: Standard deviation of the point spread.
        noise: Standard deviation of the grey values.
    """

    exposure: float
    mixing: tuple[tuple[float, ...], ...] = ((1.0, 0.07, 0.02), (0.04, 1.0, 0.06))
    blur_px: float = 0.7
    noise: float = 1.5

    def picture(self, light: Array, seed: int) -> Picture:
        """Grey values (h, w, 3) of the light (h, w, sources) in its pixels."""
        seen = gaussian_filter(light, (self.blur_px, self.blur_px, 0)) @ np.array(self.mixing)
        grey = 255 * srgb(np.clip(seen * self.exposure, 0, 1))
        noise = np.random.default_rng(seed).normal(0, self.noise, grey.shape)
        return np.clip(np.rint(grey + noise), 0, 255).astype(np.uint8)


def srgb(linear: Array) -> Array:
    """Values 0 to 1 of the transfer function of IEC 61966-2-1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def built_camera(camera: VirtualCamera, seed: int) -> VirtualCamera:
    """The camera as built: shifted by tenths of a mm, turned by tenths of a degree, focused."""
    rng = np.random.default_rng([51, seed])
    turn = np.radians(0.3) * rng.normal(size=3)
    skew = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    axes, _ = np.linalg.qr((np.eye(3) + skew) @ camera.axes.T)
    axes *= np.sign((axes * camera.axes.T).sum(axis=0))
    return replace(
        camera,
        position_mm=camera.position_mm + 0.1 * rng.normal(size=3),
        right=axes[:, 0], down=axes[:, 1], forward=axes[:, 2],
        focal_px=camera.focal_px * (1 + 0.003 * rng.normal()),
        principal_offset_px=tuple(2.0 * rng.normal(size=2)),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Sight:
    """Where rays of the camera meet the coat.

    Attributes:
        texture: (n, 2) texture coordinates along x and y, 0 to 1.
        passed: (n,) share of the light that all faces let through; 0 where no coat is met.
        shape: Height, width and rays along each side of a pixel.
    """

    texture: Array
    passed: Array
    shape: tuple[int, int, int]

    def light(self, irradiance: Array, printed: Print, size_mm: tuple[float, float]) -> Array:
        """Light (h, w, sources) in the pixels.

        Args:
            irradiance: (sources, cells, cells) by material place, rows along y.
            printed: The ink.
            size_mm: Of the pad along x and y.
        """
        met = np.flatnonzero(self.passed > 0)
        places = (self.texture[met] - 0.5) * size_mm
        at = self.texture[met, ::-1].T * (irradiance.shape[1] - 1)
        ink = printed.reflectance(places) * self.passed[met]
        height, width, finer = self.shape
        found = np.zeros((len(irradiance), len(self.passed)))
        for part, source in zip(found, irradiance, strict=True):
            part[met] = ink * map_coordinates(source, at, order=1, mode="nearest")
        rays = found.reshape(len(irradiance), height, finer, width, finer)
        return np.moveaxis(rays.mean(axis=(2, 4)), 0, 2)


def sight(mi: Any, full: Any, camera: VirtualCamera) -> Sight:
    """Follow the rays of a camera to the coat of a stage."""
    import drjit as dr

    height, width = camera.image_height_px, camera.image_width_px
    whole = slice(0, height), slice(0, width)
    sensor = mi.load_dict(film_camera(mi, camera, 1, whole))
    rows, columns = ((np.arange(FINER * size) + 0.5) / (FINER * size) for size in (height, width))
    y, x = (v.ravel() for v in np.meshgrid(rows, columns, indexing="ij"))
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
    coat, context = mi.ShapePtr(coat_of(full)), mi.BSDFContext()
    passed = dr.full(mi.Float, 1.0, len(x))
    active, met = dr.full(mi.Bool, True, len(x)), dr.full(mi.Bool, False, len(x))
    texture = dr.zeros(mi.Point2f, len(x))
    for _ in range(FACES):
        hit = full.ray_intersect(ray, active)
        active &= hit.is_valid()
        on_coat = active & (hit.shape == coat)
        texture = dr.select(on_coat, hit.uv, texture)
        met |= on_coat
        active &= ~on_coat
        # The largest sample chooses refraction, whose probability is what the face lets through.
        sample, value = hit.bsdf(ray).sample(context, hit, 1 - 1e-6, mi.Point2f(0.5), active)
        active &= (dr.max(value) > 0) & mi.has_flag(sample.sampled_type, mi.BSDFFlags.Transmission)
        passed = dr.select(active, passed * sample.pdf, passed)
        ray = dr.select(active, hit.spawn_ray(hit.to_world(sample.wo)), ray)
        dr.eval(ray, active, passed, texture, met)
    share = np.where(np.array(met), np.array(passed, dtype=float), 0.0)
    return Sight(np.array(texture, dtype=float).T, share, (height, width, FINER))
