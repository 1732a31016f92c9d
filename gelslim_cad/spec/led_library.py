"""The library of LEDs: a data file each, every figure with its source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from gelslim_cad.spec.camera_library import Source
from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.document import Document
from gelslim_core.yaml.errors import FieldError
from gelslim_core.yaml.reader import read_model

LIBRARY = Path(__file__).with_name("leds")
"""Folder with a file per type of LED."""
COLOURS = ("red", "green", "blue", "white")
"""Variants whose wavelength a spec's LEDs have a field for."""
WHITE = "white"
NEAREST_NM = 30.0
"""Farthest wavelength from that of the spec for which an LED counts as one of that colour."""
ABSOLUTE_ZERO_C = -273.15
BOLTZMANN_V_PER_K = 8.617333262e-5
"""Boltzmann's constant over the charge of the electron."""
TABLES = ("emission_angle_deg", "emission_intensity")
"""Fields of a spec's LEDs that are lists."""
PACKAGE = ("manufacturer", "package_mm", "height_mm", "pads", "polarity", "viewing_angle_deg")


class PadPlace(Block):
    """A pad of the footprint, seen from above with the anode at -x and the cathode at +x."""

    at_mm: tuple[float, float] = Field(description="Centre from that of the package")
    size_mm: tuple[float, float] = Field(description="Along and across the polarity axis")


class Pads(Block):
    """The pads of an LED."""

    anode: PadPlace
    cathode: PadPlace
    thermal: PadPlace | None = Field(default=None, description="Isolated pad, for heat only")


class LedVariant(Block):
    """The LED in one colour. Voltages in V, currents in mA, thermal resistances in K/W."""

    part: str = Field(min_length=1, max_length=80, description="Order number of the manufacturer")
    wavelength_nm: float = between(
        380, 1100, "Dominant wavelength; peak for infrared, mean for white"
    )
    test_current_ma: float = above(0, 5000, "Current of forward voltage and flux")
    forward_v: tuple[float, float, float] = Field(
        description="Least, typical and greatest forward voltage at the test current"
    )
    forward_at_c: float = between(-40, 150, "Junction temperature of the forward voltage")
    forward_mv_per_k: float = between(-10, 0, "How the forward voltage changes when it warms")
    ideality: float = between(1, 5, "Factor n of the diode's characteristic")
    series_ohm: float = between(0, 100, "Series resistance of the diode's characteristic")
    max_current_ma: float = above(0, 5000, "Greatest continuous current")
    radiant_flux_mw: float = above(0, 10000, "Radiant flux at the test current")
    flux_exponent: float = between(
        0.5, 1.3, "Slope of flux against current, both logarithmic, below the test current"
    )
    thermal_k_per_w: float = above(0, 2000, "Thermal resistance from junction to solder point")
    max_junction_c: float = between(50, 200, "Greatest junction temperature")

    @model_validator(mode="after")
    def _ordered(self) -> LedVariant:
        least, typical, greatest = self.forward_v
        if not 0 < least <= typical <= greatest:
            raise FieldError("forward_v", "must rise from the least to the greatest")
        return self

    def voltage_v(self, current_ma: Any, at_test_v: float, junction_c: Any) -> Any:
        """Forward voltage at a current, for a diode with a given one at the test current.

        Shockley's equation with a series resistance, V = V_t + n (kT/q) ln(I/I_t) + R (I - I_t),
        shifted by the temperature coefficient of the sheet. Numbers or arrays; currents in mA,
        voltages in V, temperatures in °C.
        """
        import numpy as np

        ratio = np.maximum(np.asarray(current_ma, dtype=float), 1e-6) / self.test_current_ma
        thermal_v = BOLTZMANN_V_PER_K * (junction_c - ABSOLUTE_ZERO_C)
        drop_v = self.series_ohm * self.test_current_ma * (ratio - 1) / 1000
        warmer_v = self.forward_mv_per_k * (junction_c - self.forward_at_c) / 1000
        return at_test_v + self.ideality * thermal_v * np.log(ratio) + drop_v + warmer_v


class LibraryLed(Block):
    """A type of LED in its colours. Each figure has one source, or is marked as assumed."""

    format: Literal["gelslim-led/1"]
    name: str = Field(min_length=1, max_length=80, description="Name, for `design.leds.model`")
    manufacturer: str
    summary: str
    package_mm: tuple[float, float] = Field(description="Along and across the polarity axis")
    height_mm: float = between(0.1, 10, "Height above the board")
    pads: Pads
    polarity: str = Field(description="How to tell the cathode")
    viewing_angle_deg: float = between(5, 180, "Full angle at half of the intensity")
    variants: dict[str, LedVariant] = Field(min_length=1)
    sources: tuple[Source, ...]

    @property
    def figures(self) -> tuple[str, ...]:
        """Every figure that the file gives, by its dotted path."""
        colours = (f"{c}.{n}" for c in self.variants for n in LedVariant.model_fields)
        return (*PACKAGE, *colours)

    def source(self, figure: str) -> Source:
        """The source of one of `figures`. Raises KeyError for another name."""
        for source in self.sources:
            if figure in source.gives:
                return source
        raise KeyError(figure)

    def variant(self, wavelength_nm: float) -> LedVariant | None:
        """The LED of a colour; None where none is within 30 nm. White has no wavelength."""
        coloured = [v for name, v in self.variants.items() if name != WHITE]
        nearest = min(coloured, key=lambda v: abs(v.wavelength_nm - wavelength_nm))
        return nearest if abs(nearest.wavelength_nm - wavelength_nm) <= NEAREST_NM else None

    def fields(self) -> dict[str, Any]:
        """Fields of a spec's LEDs that this type gives."""
        given: dict[str, Any] = {"package_mm": max(self.package_mm), "height_mm": self.height_mm}
        waves = {name: variant.wavelength_nm for name, variant in self.variants.items()}
        given |= {f"{n}_wavelength_nm": waves[n] for n in COLOURS if n in waves}
        if "infrared" in waves:
            given["one_wavelength_nm"] = waves["infrared"]
        return given

    @model_validator(mode="after")
    def _whole(self) -> LibraryLed:
        stated = [figure for source in self.sources for figure in source.gives]
        if sorted(stated) != sorted(self.figures):
            wrong = sorted(set(stated) ^ set(self.figures)) or "a figure is named twice"
            raise FieldError("sources", f"must name each figure once: {wrong}")
        apart = self.pads.cathode.at_mm[0] - self.pads.anode.at_mm[0]
        wide = (self.pads.cathode.size_mm[0] + self.pads.anode.size_mm[0]) / 2
        if not (apart > wide and math.isfinite(apart)):
            raise FieldError("pads", "anode and cathode must not touch, the anode at -x")
        return self


@cache
def library_leds() -> Mapping[str, LibraryLed]:
    """The types of LED by the name that a spec gives as `design.leds.model`."""
    return {led.name: led for led in map(_read, sorted(LIBRARY.glob("*.yaml")))}


@cache
def library_led(name: str) -> LibraryLed | None:
    """The type of LED of this name, None if there is none; no other file is parsed."""
    for path in sorted(LIBRARY.glob("*.yaml")):
        if name in path.read_text(encoding="utf-8") and _read(path).name == name:
            return _read(path)
    return None


@cache
def _read(path: Path) -> LibraryLed:
    return read_model(path, LibraryLed).model


def completed_leds(given: Any) -> Any:
    """The fields of a spec's LEDs, with those of the library that it leaves out.

    Anything but a mapping is returned as it is. Lists of JSON become tuples, as strict models want
    them of Python.
    """
    if not isinstance(given, Mapping):
        return given
    own = {n: tuple(v) if n in TABLES and isinstance(v, list) else v for n, v in given.items()}
    model = given.get("model")
    led = library_led(model) if isinstance(model, str) else None
    return own if led is None else {**led.fields(), **own}


def lend_led_fields(document: Document) -> None:
    """Give the LEDs of a spec's document the fields that the library lends them."""
    design = document.data.get("design")
    leds = design.get("leds") if isinstance(design, Mapping) else None
    if not isinstance(leds, Mapping):
        return
    for name, value in completed_leds(leds).items():
        if name not in leds:
            origin = f"the library's LED {leds['model']}"
            document.lend(("design", "leds", name), value, origin, ("design", "leds", "model"))
