"""A scene of light: an extruded profile with its media, surfaces and sources."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.light.source import Source

AIR = "air"
GEL = "gel"
PMMA_SELLMEIER = (1.1819, 0.011313)


@dataclass(frozen=True)
class Medium:
    """A transparent medium.

    Attributes:
        index: Refractive index, between 1 and 4.
        absorption_per_mm: Absorption coefficient (Beer-Lambert law).
        red_index: Refractive index for red sources without a wavelength; None for `index`.
        green_index: Refractive index for green sources without a wavelength; None for `index`.
        blue_index: Refractive index for blue sources without a wavelength; None for `index`.
        sellmeier: (B, C) of n² = 1 + B λ² / (λ² - C), λ in µm, for sources with a wavelength.

    Raises:
        ValueError: An index or the absorption is out of range.
    """

    index: float
    absorption_per_mm: float = 0.0
    red_index: float | None = None
    green_index: float | None = None
    blue_index: float | None = None
    sellmeier: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for value in (self.index, self.red_index, self.green_index, self.blue_index):
            if value is not None and not (math.isfinite(value) and 1 <= value <= 4):
                raise ValueError(f"refractive index = {value!r}: must be between 1 and 4")
        if not (math.isfinite(self.absorption_per_mm) and self.absorption_per_mm >= 0):
            raise ValueError(f"absorption_per_mm = {self.absorption_per_mm!r}: must be >= 0")

    def index_for(self, colour: str, wavelength_um: float | None = None) -> float:
        """Refractive index for light of a colour and, if given, a wavelength."""
        if self.sellmeier is not None and wavelength_um is not None:
            b, c = self.sellmeier
            square = wavelength_um**2
            return math.sqrt(1 + b * square / (square - c))
        by_name = {"red": self.red_index, "green": self.green_index, "blue": self.blue_index}
        named = by_name.get(colour)
        return self.index if named is None else named


@dataclass(frozen=True)
class Surface:
    """An opaque surface, which absorbs what it does not reflect.

    Attributes:
        reflectance: Reflected share of the flux, 0 to 1.
        diffuse: Whether it reflects diffusely (Lambertian) rather than like a mirror.

    Raises:
        ValueError: The reflectance is out of range.
    """

    reflectance: float = 0.0
    diffuse: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.reflectance <= 1:
            raise ValueError(f"reflectance = {self.reflectance!r}: must be between 0 and 1")


def default_media() -> dict[str, Medium]:
    """Air, PMMA (the window and separate legs; index at 590 nm) and silicone gel."""
    pmma = Medium(1.4906, absorption_per_mm=0.001, sellmeier=PMMA_SELLMEIER)
    return {AIR: Medium(1.0), "acrylic": pmma, "leg": pmma, GEL: Medium(1.41)}


def default_surfaces() -> dict[str, Surface]:
    """A black coat of paint and an aluminium mirror."""
    return {"paint": Surface(), "mirror": Surface(0.9)}


@dataclass(frozen=True)
class LightScene:
    """A profile extruded along x, with light sources.

    Light that crosses an edge of `feet` into the air ends at the LED board and is counted as
    returned. Light that leaves elsewhere continues in the air: it may meet a mirror, enter again
    or reach the sides of the gel. When it meets nothing more, the back of a coat, or a foot from
    outside, it has leaked through the edge by which it last left a solid.

    Attributes:
        profile: The cross-section.
        x_mm: First and last x of the guide.
        gel_x_mm: First and last x of the gel, within `x_mm`. Elsewhere the bonded face meets air
            and the other faces of the gel are absent.
        sources: The light sources.
        media: Transparent media by name; air must be among them.
        surfaces: Opaque surfaces by name.
        ends: What the end faces of the guide meet: air, or the name of a surface.
        feet: Names of the edges at which the LEDs are.
        face: Name of the edge whose arriving light is mapped and counted as delivered.

    Raises:
        ValueError: An extent is out of order, or an edge meets a medium without properties.
    """

    profile: GuideProfile
    x_mm: tuple[float, float]
    gel_x_mm: tuple[float, float]
    sources: tuple[Source, ...]
    media: Mapping[str, Medium] = field(default_factory=default_media)
    surfaces: Mapping[str, Surface] = field(default_factory=default_surfaces)
    ends: str = AIR
    feet: tuple[str, ...] = ("foot_left", "foot_right")
    face: str = "gel_face"

    def __post_init__(self) -> None:
        (x0, x1), (g0, g1) = self.x_mm, self.gel_x_mm
        if not (math.isfinite(x0) and math.isfinite(x1) and x0 < x1):
            raise ValueError(f"x_mm = {self.x_mm}: must be two finite lengths in order")
        if not x0 <= g0 < g1 <= x1:
            raise ValueError(f"gel_x_mm = {self.gel_x_mm}: must be in order and within {self.x_mm}")
        if AIR not in self.media:
            raise ValueError("media must contain air")
        if self.ends != AIR and self.ends not in self.surfaces:
            raise ValueError(f"ends = {self.ends!r}: must be air or one of {sorted(self.surfaces)}")
        known = set(self.media) | set(self.surfaces)
        for edge in self.profile.edges:
            for medium in (edge.left, edge.right):
                if medium not in known:
                    raise ValueError(f"edge {edge.name} meets {medium!r}, which has no properties")
        if not self.sources:
            raise ValueError("the scene has no light source")
