"""Light on the gel's face: a map of irradiance and a direction for each source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.light.light_fans import LightFans

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LightMap:
    """Irradiance and direction of the light of k sources on the gel's face.

    Outside its axes the map continues with the values at its edge.

    Attributes:
        x_mm: Increasing coordinates (nx,) along the finger.
        y_mm: Increasing coordinates (ny,) across the finger.
        irradiance: (ny, nx, k) relative to the mean.
        azimuth_deg: Mean direction (k,) in the plane; 0 is towards +x, 90 towards +y.
        elevation_deg: Mean elevation (k,) at which light rises to the face, within the gel.
        colour: Response (k, 3) of the camera's red, green and blue.
        fans: Directions of the light as in `LightFans.sums`; None for one direction per source.

    Raises:
        ValueError: A shape does not fit, or a value is out of range.
    """

    x_mm: Array
    y_mm: Array
    irradiance: Array
    azimuth_deg: Array
    elevation_deg: Array
    colour: Array
    fans: Array | None = None

    def __post_init__(self) -> None:
        for name in ("x_mm", "y_mm", "irradiance", "azimuth_deg", "elevation_deg", "colour"):
            value = np.array(getattr(self, name), dtype=float)
            if not np.isfinite(value).all():
                raise ValueError(f"{name} of the light must be finite")
            object.__setattr__(self, name, value)
        count = self.irradiance.shape[-1]
        expected = {
            "irradiance": (len(self.y_mm), len(self.x_mm), count),
            "azimuth_deg": (count,),
            "elevation_deg": (count,),
            "colour": (count, 3),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(
                    f"{name} {getattr(self, name).shape} of the light: must be {shape}"
                )
        for name in ("x_mm", "y_mm"):
            if len(getattr(self, name)) < 2 or np.any(np.diff(getattr(self, name)) <= 0):
                raise ValueError(f"{name} of the light must be two or more increasing values")
        if self.irradiance.min() < 0 or self.colour.min() < 0:
            raise ValueError("irradiance and colour of the light must not be negative")
        if self.fans is not None and self.light_fans.sums.shape[0] != count:
            raise ValueError(f"fans of {len(self.fans)} sources of light: must be {count}")
        if np.any((self.elevation_deg <= 0) | (self.elevation_deg > 90)):
            raise ValueError("elevation_deg of the light must be above 0 and at most 90")

    @classmethod
    def from_bins(
        cls,
        bins: Array,
        length_mm: float,
        width_mm: float,
        *,
        azimuth_deg: Array,
        elevation_deg: Array,
        colour: Array,
        smooth_mm: float = 0.0,
        fans: Array | None = None,
    ) -> LightMap:
        """Light from the maps (k, nx, ny) of a tracer for one pad, relative to their common mean.

        `smooth_mm` is the standard deviation of a Gaussian filter against the noise of the tracer,
        `fans` are its tallies of direction, of which a coarse part is kept.
        Raises ValueError for maps without light.
        """
        maps = np.asarray(bins, dtype=float)
        if maps.ndim != 3 or not maps.mean() > 0:
            raise ValueError(
                f"irradiance bins {maps.shape} must have the shape (k, nx, ny) and contain light"
            )
        steps = length_mm / maps.shape[1], width_mm / maps.shape[2]
        if smooth_mm > 0:
            from scipy.ndimage import gaussian_filter

            spread = (0.0, smooth_mm / steps[0], smooth_mm / steps[1])
            maps = gaussian_filter(maps, spread, mode="nearest")
        x, y = (
            (np.arange(count) + 0.5) * step - count * step / 2
            for count, step in zip(maps.shape[1:], steps, strict=True)
        )
        irradiance = np.transpose(maps, (2, 1, 0)) / maps.mean()
        if fans is not None:
            fans = LightFans.of_trace(fans, (length_mm, width_mm)).sums
        return cls(x, y, irradiance, azimuth_deg, elevation_deg, colour, fans)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike]) -> LightMap:
        """Light from the arrays that a bundle stores; see `light_arrays`."""
        kept = (*LIGHT_FIELDS, "fans") if "fans" in arrays else LIGHT_FIELDS
        return cls(**{name: np.asarray(arrays[name], dtype=float) for name in kept})

    @property
    def sources(self) -> int:
        """Number of sources."""
        return len(self.elevation_deg)

    @property
    def directions(self) -> Array:
        """Unit vectors (k, 3) along which the light travels."""
        a, e = np.deg2rad(self.azimuth_deg), np.deg2rad(self.elevation_deg)
        return np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

    @cached_property
    def light_fans(self) -> LightFans:
        """Directions of the light at places; those of one direction each without `fans`."""
        lower, upper = ((axis[0], axis[-1]) for axis in (self.x_mm, self.y_mm))
        half = [(axis[1] - axis[0]) / 2 for axis in (self.x_mm, self.y_mm)]
        corners = (lower[0] - half[0], upper[0] - half[1]), (lower[1] + half[0], upper[1] + half[1])
        if self.fans is not None:
            return LightFans(self.fans, *corners)
        tangent = self.directions[:, :2] / self.directions[:, 2:]
        sums = np.column_stack([np.ones(len(tangent)), tangent])
        return LightFans(sums[:, None, None, None, :], *corners)

    def at(self, x_mm: Array, y_mm: Array) -> Array:
        """Irradiance (..., k) at points of any shape, bilinear."""
        i, u = _cell(self.x_mm, x_mm)
        j, v = _cell(self.y_mm, y_mm)
        e = self.irradiance
        low = e[j, i] * (1 - u) + e[j, i + 1] * u
        high = e[j + 1, i] * (1 - u) + e[j + 1, i + 1] * u
        found: Array = low * (1 - v) + high * v
        return found


LIGHT_FIELDS = ("x_mm", "y_mm", "irradiance", "azimuth_deg", "elevation_deg", "colour")


def light_arrays(light: LightMap) -> dict[str, Array]:
    """Return the arrays of a light map by name, as a bundle stores them."""
    found = {name: np.asarray(getattr(light, name)) for name in LIGHT_FIELDS}
    if light.fans is not None:
        found["fans"] = light.fans.astype(np.float32)
    return found


def red_green_sides(
    length_mm: float,
    width_mm: float,
    *,
    decay_mm: float,
    elevation_deg: float = 25.0,
    red: float = 1.0,
    green: float = 1.0,
) -> LightMap:
    """Red light from -y and green light from +y, each decaying exponentially across the pad.

    For a sensor whose light was not traced. `decay_mm` is the decay length; the means of the two
    maps over the pad are `red` and `green`.
    """
    x = np.linspace(-length_mm / 2, length_mm / 2, 17)
    y = np.linspace(-width_mm / 2, width_mm / 2, 65)
    fall = np.exp(-(y + width_mm / 2) / decay_mm)
    fall /= np.trapezoid(fall, y) / width_mm
    maps = np.stack([red * fall, green * fall[::-1]], axis=1)
    return LightMap(
        x_mm=x,
        y_mm=y,
        irradiance=np.repeat(maps[:, None, :], len(x), axis=1),
        azimuth_deg=np.array([90.0, -90.0]),
        elevation_deg=np.array([elevation_deg, elevation_deg]),
        colour=LED_COLOURS,
    )


LED_COLOURS = np.array([[1.0, 0.05, 0.01], [0.02, 1.0, 0.04]])
"""A red (625 nm) and a green (525 nm) LED in the colours of a camera with a colour matrix."""


def _cell(axis: Array, at: Array) -> tuple[NDArray[np.intp], Array]:
    limited = np.clip(at, axis[0], axis[-1])
    number = np.clip(np.searchsorted(axis, limited, side="right") - 1, 0, len(axis) - 2)
    return number, ((limited - axis[number]) / (axis[number + 1] - axis[number]))[..., None]
