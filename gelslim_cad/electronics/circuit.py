"""The circuit of one board: current, strings, resistor, power and temperatures.

Everything works on numbers and, for many designs at once, on arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.electronics.heat import board_k_per_w
from gelslim_cad.electronics.leds import NAMES as LED_NAMES
from gelslim_cad.electronics.leds import BoardLed, board_led
from gelslim_cad.electronics.resistors import derated, of_size, resistor_index
from gelslim_cad.electronics.strings import (
    RESISTOR_TOLERANCE,
    leds_in_series,
    next_e24_ohm,
    string_current_ma,
)
from gelslim_cad.geometry.led_strips import Side, has_tip_light
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name
from gelslim_cad.spec.led_library import LedVariant

DRIVER_DROPOUT_V = 1.0
"""Voltage that a constant-current driver keeps for itself, as usual linear ones do."""
LEAST_OHM = 1.0
"""Resistor where the LEDs leave no voltage for one; a rule then refuses the supply."""
NAMES: tuple[Name, ...] = (
    *LED_NAMES,
    "design.housing.side_wall_mm",
    "electronics.ambient_c",
    "electronics.current_ma",
    "electronics.driver",
    "electronics.supply_v",
    "led.board_length_mm",
    "led.board_width_mm",
    "led.count",
)
"""Names that the circuit of a side board uses."""
TIP_NAMES: tuple[Name, ...] = (
    *NAMES,
    "led.tip_board_length_mm",
    "led.tip_board_width_mm",
    "led.tip_count",
)
"""Names that the circuit of the board at the tip uses."""


@dataclass(frozen=True)
class Circuit:
    """The circuit of one board; each figure a number or an array over designs.

    Attributes:
        led: The LED.
        count: LEDs on the board.
        wanted_ma: Current that the spec asks for.
        series: LEDs of the longest string.
        strings: Strings side by side.
        resistance_ohm: Resistor of the longest strings, E24; 0 with a constant-current driver.
        current_ma: Current of an LED with typical voltages.
        least_ma: Current with LEDs of the greatest forward voltage, cold.
        greatest_ma: Current with LEDs of the least forward voltage, hot.
        forward_v: Typical forward voltage at that current.
        needed_v: Supply that the longest string needs at the least.
        supply_ma: Current of the board.
        resistor_mw: Power of a resistor at the greatest current.
        resistor: Its place in `RESISTORS`.
        heat_mw: Heat of the board: the supply's power less the light.
        flux_mw: Radiant flux of an LED.
        board_c: Temperature of the board.
        junction_c: Temperature of the junctions.
    """

    led: BoardLed
    count: Any
    wanted_ma: Any
    series: Any
    strings: Any
    resistance_ohm: Any
    current_ma: Any
    least_ma: Any
    greatest_ma: Any
    forward_v: Any
    needed_v: Any
    supply_ma: Any
    resistor_mw: Any
    resistor: Any
    heat_mw: Any
    flux_mw: Any
    board_c: Any
    junction_c: Any

    @property
    def known(self) -> Any:
        """Whether the LED is that of the spec, so that the figures hold."""
        return self.led.fits

    @property
    def allowed_mw(self) -> Any:
        """Power that the chosen resistor stands on this board."""
        return of_size(self.resistor, "rated_mw") * derated(self.board_c)

    @property
    def resistor_height_mm(self) -> Any:
        """Height of the chosen resistor; 0 with a driver."""
        return of_size(self.resistor, "height_mm") * (self.resistance_ohm > 0)

    @property
    def spread(self) -> Any:
        """How far the current may lie above the typical one, as a part of it."""
        return self.greatest_ma / self.current_ma - 1


Circuits = tuple[Circuit | None, ...]
"""Of the left and the right board and, where there is one, of that at the tip."""


def side_circuit(d: Lookup, side: Side) -> Circuit | None:
    """The circuit of a board; None where its LED is not known, or where there is no board.

    The board at the tip is counted as warm as one of its size beside a side wall: there is more
    plastic around it, which carries more heat away.

    Args:
        d: Spec fields and dimensions, those of `NAMES`, for the board at the tip of `TIP_NAMES`.
        side: `left`, `right` or `tip`.

    Returns:
        The circuit.
    """
    if side == "tip" and not has_tip_light(d):
        return None
    led = board_led(d, side)
    if led is None:
        return None
    count, length, width = d["led.count"], d["led.board_length_mm"], d["led.board_width_mm"]
    if side == "tip":
        count, length = d["led.tip_count"], d["led.tip_board_length_mm"]
        width = d["led.tip_board_width_mm"]
    given = d["electronics.current_ma"]
    wanted = led.current_for_ma(d["design.leds.radiant_flux_mw"])
    wanted = wanted if given is None else np.asarray(given, dtype=float)
    return circuit(
        led,
        count=count,
        wanted_ma=wanted,
        supply_v=d["electronics.supply_v"],
        driven=d["electronics.driver"] == "constant_current",
        ambient_c=d["electronics.ambient_c"],
        board_k=board_k_per_w(length, width, d["design.housing.side_wall_mm"]),
    )


def circuit(
    led: BoardLed,
    *,
    count: Any,
    wanted_ma: Any,
    supply_v: Any,
    driven: bool,
    ambient_c: Any,
    board_k: Any,
) -> Circuit:
    """Choose strings and resistors for a current and compute what follows.

    The light leaves the board, T_board = T_air + R_board (P - n Φ), and a junction is warmer by
    its own heat, T_j = T_board + R_JS (V I - Φ).

    Args:
        led: The LED.
        count: LEDs on the board.
        wanted_ma: Current wanted of each.
        supply_v: Supply in V.
        driven: Whether a constant-current driver at the supply takes the place of resistors.
        ambient_c: Temperature of the air in °C.
        board_k: Thermal resistance from board to air in K/W.

    Returns:
        The circuit.
    """
    variant = led.variant
    least_v, typical_v, _ = variant.forward_v
    if driven:
        chosen = _one_string(variant, count, wanted_ma, ambient_c)
    else:
        chosen = _resistor_strings(variant, count, wanted_ma, supply_v, ambient_c)
    current, greatest = chosen.current_ma, chosen.current_ma
    forward = variant.voltage_v(current, typical_v, ambient_c)
    flux = led.flux_at_mw(current)
    supply_ma = chosen.strings * current
    electrical_mw = count * forward * current if driven else supply_v * supply_ma
    heat = electrical_mw - count * flux
    board_c = ambient_c + board_k * heat / 1000
    junction_c = board_c + variant.thermal_k_per_w * (forward * current - flux) / 1000
    if not driven:
        low_ohm = chosen.ohm * (1 - RESISTOR_TOLERANCE)
        greatest = string_current_ma(supply_v, chosen.series, low_ohm, variant, least_v, junction_c)
    resistor_mw = chosen.ohm * greatest**2 / 1000
    return Circuit(
        led=led,
        count=count,
        wanted_ma=wanted_ma,
        series=chosen.series,
        strings=chosen.strings,
        resistance_ohm=chosen.ohm,
        current_ma=current,
        least_ma=chosen.least_ma,
        greatest_ma=greatest,
        forward_v=forward,
        needed_v=chosen.needed_v,
        supply_ma=supply_ma,
        resistor_mw=resistor_mw,
        resistor=resistor_index(resistor_mw, board_c),
        heat_mw=heat,
        flux_mw=flux,
        board_c=board_c,
        junction_c=junction_c,
    )


@dataclass(frozen=True)
class _Strings:
    """Strings of LEDs in series, with a resistor each or a driver, and their current."""

    series: Any
    strings: Any
    ohm: Any
    current_ma: Any
    least_ma: Any
    needed_v: Any


def _one_string(variant: LedVariant, count: Any, wanted_ma: Any, ambient_c: Any) -> _Strings:
    """All LEDs in series at a driver, which keeps the current that is wanted."""
    strings = np.ones_like(np.asarray(count, dtype=float))
    current = wanted_ma + 0.0 * strings
    needed = count * variant.voltage_v(wanted_ma, variant.forward_v[2], ambient_c)
    return _Strings(count, strings, 0.0 * strings, current, current, needed + DRIVER_DROPOUT_V)


def _resistor_strings(
    variant: LedVariant, count: Any, wanted_ma: Any, supply_v: Any, ambient_c: Any
) -> _Strings:
    """As many LEDs in series as the supply can feed, and the resistor next above the one wanted."""
    _, typical_v, greatest_v = variant.forward_v
    high_v = variant.voltage_v(wanted_ma, greatest_v, ambient_c)
    volts = variant.voltage_v(wanted_ma, typical_v, ambient_c)
    series = leds_in_series(supply_v, volts, high_v, count)
    wanted_ohm = 1000 * (supply_v - series * volts) / wanted_ma
    ohm = next_e24_ohm(np.maximum(wanted_ohm, LEAST_OHM))
    current = string_current_ma(supply_v, series, ohm, variant, typical_v, ambient_c)
    high = ohm * (1 + RESISTOR_TOLERANCE)
    least = string_current_ma(supply_v, series, high, variant, greatest_v, ambient_c)
    return _Strings(series, np.ceil(count / series), ohm, current, least, series * high_v)


def string_resistors_ohm(found: Circuit, supply_v: float, lengths: tuple[int, ...]) -> list[float]:
    """E24 resistor of each string of one board, for the current wanted.

    Args:
        found: The circuit of one design.
        supply_v: Supply in V.
        lengths: LEDs of each string.

    Returns:
        Resistances in Ω.
    """
    series = np.array(lengths, dtype=float)
    each_v = (supply_v - found.resistance_ohm * found.current_ma / 1000) / found.series
    wanted = 1000 * (supply_v - series * each_v) / found.current_ma
    return [float(v) for v in next_e24_ohm(np.maximum(wanted, LEAST_OHM))]
