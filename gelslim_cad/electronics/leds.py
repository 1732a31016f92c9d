"""Which LED stands on each board: one of the library, or one that the spec describes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.geometry.led_strips import (
    SIDES,
    WHITE,
    Side,
    is_white,
    shared_light,
    strip_wavelengths_nm,
)
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name
from gelslim_cad.spec.led_library import (
    NEAREST_NM,
    LedVariant,
    PadPlace,
    Pads,
    library_led,
)

SIZE_TOLERANCE_MM = 0.16
"""How far package and height of the spec may differ from those of the library's LED."""
OWN_SPREAD = 0.1
"""Spread of the forward voltage of an LED whose sheet is not known, as a part of it."""
NAMES: tuple[Name, ...] = (
    "design.leds.model",
    "design.leds.package_mm",
    "design.leds.height_mm",
    "design.leds.radiant_flux_mw",
    "design.leds.red_wavelength_nm",
    "design.leds.green_wavelength_nm",
    "design.leds.blue_wavelength_nm",
    "design.leds.white_wavelength_nm",
    "design.leds.light",
    "design.leds.tip",
    "design.leds.one_wavelength_nm",
    "electronics.own_forward_v",
    "electronics.own_test_current_ma",
    "electronics.own_max_current_ma",
    "electronics.own_thermal_k_per_w",
    "electronics.own_max_junction_c",
)
"""Names that the choice of the LED uses."""


@dataclass(frozen=True)
class BoardLed:
    """The LED of one board.

    Attributes:
        colour: Name of its light, the same on all boards for strips of one wavelength.
        manufacturer: Manufacturer; empty where the spec does not tell.
        variant: Electrical data.
        package_mm: Size along and across the polarity axis.
        height_mm: Height above the board.
        pads: The footprint.
        polarity: How to tell the cathode.
        flux_mw: Radiant flux at the test current.
        fits: Whether package, height and colour of the spec are those of this LED; an array where
            they differ between designs.
        assumed: Figures of the library that no sheet states, by name.
    """

    colour: str
    manufacturer: str
    variant: LedVariant
    package_mm: tuple[float, float]
    height_mm: float
    pads: Pads
    polarity: str
    flux_mw: Any
    fits: Any = True
    assumed: tuple[str, ...] = ()

    def current_for_ma(self, flux_mw: Any) -> Any:
        """Current that gives a radiant flux, I_t (Φ/Φ_t)^(1/m) with the sheet's slope m."""
        slope = self.variant.flux_exponent
        return self.variant.test_current_ma * (flux_mw / self.flux_mw) ** (1 / slope)

    def flux_at_mw(self, current_ma: Any) -> Any:
        """Radiant flux at a current, Φ_t (I/I_t)^m."""
        ratio = current_ma / self.variant.test_current_ma
        return self.flux_mw * ratio**self.variant.flux_exponent

    @property
    def reach_mm(self) -> tuple[float, float]:
        """How far package and pads reach from the centre, to the anode's and the cathode's side."""
        half, pads = self.package_mm[0] / 2, self.pads
        return (
            max(half, -pads.anode.at_mm[0] + pads.anode.size_mm[0] / 2),
            max(half, pads.cathode.at_mm[0] + pads.cathode.size_mm[0] / 2),
        )


def board_led(d: Lookup, side: Side) -> BoardLed | None:
    """The LED of a board.

    Args:
        d: Spec fields.
        side: `left`, the board at -y, `right`, or `tip` where there is one.

    Returns:
        The LED; None where its model is not in the library and the spec does not describe it, or
        where no LED of that model has the colour. `fits` tells whether its size is right too.
    """
    colour, wavelength = list(strip_wavelengths_nm(d).items())[SIDES.index(side)]
    led = library_led(d["design.leds.model"])
    if led is None:
        return _own(d, side, colour, wavelength) if d["electronics.own_forward_v"] else None
    white = is_white(d)
    variant = led.variants.get(WHITE) if white else led.variant(float(np.ravel(wavelength)[0]))
    if variant is None:
        return None
    fits = (
        (np.abs(d["design.leds.package_mm"] - max(led.package_mm)) <= SIZE_TOLERANCE_MM)
        & (np.abs(d["design.leds.height_mm"] - led.height_mm) <= SIZE_TOLERANCE_MM)
        & (white | (np.abs(wavelength - variant.wavelength_nm) <= NEAREST_NM))
    )
    name = next(n for n, v in led.variants.items() if v is variant)
    figures = [f for f in led.figures if "." not in f or f.startswith(f"{name}.")]
    assumed = tuple(f.removeprefix(f"{name}.") for f in figures if led.source(f).assumed)
    return BoardLed(
        name if shared_light(d) else colour,
        led.manufacturer,
        variant,
        led.package_mm,
        led.height_mm,
        led.pads,
        led.polarity,
        variant.radiant_flux_mw,
        fits,
        assumed,
    )


def _own(d: Lookup, side: Side, colour: str, wavelength: Any) -> BoardLed:
    """An LED that the spec describes, with the usual pads of a chip of its size.

    Of many designs with different packages all take the pads of the largest.
    """
    typical = d["electronics.own_forward_v"][SIDES.index(side)]
    size, height = (
        float(np.max(d[name])) for name in ("design.leds.package_mm", "design.leds.height_mm")
    )
    variant = LedVariant(
        part=d["design.leds.model"] or "LED",
        wavelength_nm=float(np.ravel(wavelength)[0]),
        test_current_ma=_given(d["electronics.own_test_current_ma"]),
        forward_v=((1 - OWN_SPREAD) * typical, typical, (1 + OWN_SPREAD) * typical),
        forward_at_c=25.0,
        forward_mv_per_k=-2.0,
        ideality=2.0,
        series_ohm=0.0,
        max_current_ma=_given(d["electronics.own_max_current_ma"]),
        radiant_flux_mw=float(np.max(d["design.leds.radiant_flux_mw"])),
        flux_exponent=1.0,
        thermal_k_per_w=_given(d["electronics.own_thermal_k_per_w"]),
        max_junction_c=_given(d["electronics.own_max_junction_c"]),
    )
    pad = (0.4 * size, 0.6 * size)
    pads = Pads(
        anode=PadPlace(at_mm=(-0.42 * size, 0.0), size_mm=pad),
        cathode=PadPlace(at_mm=(0.42 * size, 0.0), size_mm=pad),
    )
    assumed = ("pads", "forward_mv_per_k", "ideality", "series_ohm")
    colour = "LED" if shared_light(d) else colour
    flux = d["design.leds.radiant_flux_mw"]
    told = "see the LED's sheet"
    return BoardLed(colour, "", variant, (size, size), height, pads, told, flux, assumed=assumed)


def _given(value: float | None) -> float:
    """A figure that the spec gives with the others of its own LED, as its model demands."""
    assert value is not None
    return value
