"""Rigid indenters of known shape."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_core.errors import GelslimError

Array = NDArray[np.float64]
PatchKind = Literal["disc", "strip", "outline"]
LARGEST_MM = 1000.0
_FORMS = (
    "sphere:RADIUS, cylinder:RADIUS, cylinder:RADIUS@ANGLE, flat:RADIUS or flat:WIDTHxLENGTH "
    "(mm, degrees), such as sphere:10"
)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


class IndenterError(GelslimError, ValueError):
    """An impossible indenter; the message says what is possible."""


@dataclass(frozen=True)
class Sphere:
    """Sphere of `radius_mm`. Raises IndenterError for an impossible radius."""

    radius_mm: float

    def __post_init__(self) -> None:
        _check_length("the sphere's radius", self.radius_mm)

    @property
    def patch_kind(self) -> PatchKind:
        """Shape of its contact patch."""
        return "disc"

    def profile(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Height (n,) of the surface above its lowest point at offsets (n,) from it.

        Infinite beyond the equator.
        """
        return _arc(self.radius_mm, np.hypot(x_mm, y_mm))


@dataclass(frozen=True)
class Cylinder:
    """Cylinder of `radius_mm` lying on the gel, longer than the pad.

    `axis_deg` is the direction of its axis, from x towards y, if it is known in advance; by
    default it is found from the contact patch. Raises IndenterError for an impossible radius or
    angle.
    """

    radius_mm: float
    axis_deg: float | None = None

    def __post_init__(self) -> None:
        _check_length("the cylinder's radius", self.radius_mm)
        if self.axis_deg is not None and not math.isfinite(self.axis_deg):
            raise IndenterError(f"the cylinder's axis at {self.axis_deg} deg: must be finite")

    @property
    def patch_kind(self) -> PatchKind:
        """Shape of its contact patch."""
        return "strip"

    def profile(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Height (n,) above its lowest line at offsets (n,); x along the axis, y across it."""
        _, y = np.broadcast_arrays(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float))
        return _arc(self.radius_mm, y)


@dataclass(frozen=True)
class Flat:
    """Flat punch: a disc of `radius_mm`, or a rectangle of half-sizes (mm) along x and y.

    Exactly one of the two must be given. Raises IndenterError otherwise, and for impossible sizes.
    """

    radius_mm: float | None = None
    half_sizes_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if (self.radius_mm is None) == (self.half_sizes_mm is None):
            raise IndenterError("a flat punch has either a radius or two half-sizes")
        if self.radius_mm is not None:
            _check_length("the flat punch's radius", self.radius_mm)
        for half in self.half_sizes_mm or ():
            _check_length("the flat punch's half-size", half)

    @property
    def patch_kind(self) -> PatchKind:
        """Shape of its contact patch."""
        return "disc" if self.half_sizes_mm is None else "outline"

    def profile(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """0 (n,) under the punch and infinite outside it, at offsets (n,) from its middle."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        if self.radius_mm is not None:
            outside = np.hypot(x, y) > self.radius_mm * (1 + 1e-12)
        else:
            assert self.half_sizes_mm is not None
            a, b = self.half_sizes_mm
            outside = (np.abs(x) > a * (1 + 1e-12)) | (np.abs(y) > b * (1 + 1e-12))
        return np.where(outside, np.inf, 0.0)


Indenter = Sphere | Cylinder | Flat


def parse_indenter(text: str) -> Indenter:
    """Indenter of a command-line word, such as `sphere:10`, `cylinder:6@90` or `flat:4x8`.

    Lengths in mm: radii of sphere, cylinder and round punch, full width (along x) and length
    (along y) of a rectangular one; the angle of a cylinder's axis in degrees.
    Raises IndenterError, with the forms that are possible.
    """
    kind, _, sizes = text.strip().lower().partition(":")
    try:
        if kind == "sphere":
            return Sphere(*_numbers(sizes, rf"({_NUMBER})"))
        if kind == "cylinder":
            if "@" in sizes:
                return Cylinder(*_numbers(sizes, rf"({_NUMBER})@({_NUMBER})"))
            return Cylinder(*_numbers(sizes, rf"({_NUMBER})"))
        if kind == "flat":
            if "x" in sizes:
                width, length = _numbers(sizes, rf"({_NUMBER})x({_NUMBER})")
                return Flat(half_sizes_mm=(width / 2, length / 2))
            return Flat(radius_mm=_numbers(sizes, rf"({_NUMBER})")[0])
    except IndenterError as error:
        raise IndenterError(f"indenter {text!r}: {error}; write {_FORMS}") from None
    raise IndenterError(f"indenter {text!r}: unknown shape {kind!r}; write {_FORMS}")


def _numbers(text: str, pattern: str) -> list[float]:
    found = re.fullmatch(pattern, text.replace(" ", ""))
    if found is None:
        raise IndenterError(f"the size {text!r} cannot be read")
    return [float(part) for part in found.groups()]


def _check_length(name: str, value: float) -> None:
    if not (math.isfinite(value) and 0 < value <= LARGEST_MM):
        raise IndenterError(f"{name} of {value:g} mm: must be above 0, at most {LARGEST_MM:g} mm")


def _arc(radius_mm: float, offset_mm: ArrayLike) -> Array:
    """R - √(R² - r²), without cancellation; infinite for r > R."""
    r = np.asarray(offset_mm, dtype=float)
    root = np.sqrt(np.maximum(radius_mm**2 - r * r, 0.0))
    return np.where(np.abs(r) <= radius_mm, r * r / (radius_mm + root), np.inf)
