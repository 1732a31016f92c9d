"""Circuits of the LED boards: currents, resistors, heat and temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.electronics.circuit import NAMES, TIP_NAMES, Circuit, Circuits, side_circuit
from gelslim_cad.geometry.led_strips import NO_TIP

SOURCE = "docs/electronics.md"


@dimension(
    "electronics.left_circuit",
    formula="strings and resistors for the current",
    internal=True,
    inputs=NAMES,
)
def electronics_left_circuit(values: Mapping[str, Any]) -> Circuit | None:
    """Circuit of the left board; None where its LED is not known."""
    return side_circuit(values, "left")


@dimension(
    "electronics.right_circuit",
    formula="strings and resistors for the current",
    internal=True,
    inputs=NAMES,
)
def electronics_right_circuit(values: Mapping[str, Any]) -> Circuit | None:
    """Circuit of the right board; None where its LED is not known."""
    return side_circuit(values, "right")


@dimension(
    "electronics.tip_circuit",
    formula="strings and resistors for the current",
    internal=True,
    inputs=TIP_NAMES,
)
def electronics_tip_circuit(values: Mapping[str, Any]) -> Circuit | None:
    """Circuit of the board at the tip; None where there is none or its LED is not known."""
    return side_circuit(values, "tip")


@dimension("electronics.circuits", formula="those of the boards of the finger", internal=True)
def electronics_circuits(
    electronics_left_circuit: Circuit | None,
    electronics_right_circuit: Circuit | None,
    electronics_tip_circuit: Circuit | None,
    leds_tip: str,
) -> Circuits:
    """Circuits of the left and the right board and, where there is one, of that at the tip."""
    sides = electronics_left_circuit, electronics_right_circuit
    return sides if leds_tip == NO_TIP else (*sides, electronics_tip_circuit)


def _figure(circuit: Circuit | None, name: str) -> Real:
    """A figure of a circuit; 0 where the LED is not known or there is no board."""
    if circuit is None:
        return 0.0
    return np.where(circuit.known, np.asarray(getattr(circuit, name), dtype=float), 0.0)


@dimension("electronics.left_led_ma", formula="string's current, typical LEDs", source=SOURCE)
def electronics_left_led_ma(electronics_left_circuit: Circuit | None) -> Real:
    """Current of an LED on the left board."""
    return _figure(electronics_left_circuit, "current_ma")


@dimension("electronics.right_led_ma", formula="string's current, typical LEDs", source=SOURCE)
def electronics_right_led_ma(electronics_right_circuit: Circuit | None) -> Real:
    """Current of an LED on the right board."""
    return _figure(electronics_right_circuit, "current_ma")


@dimension("electronics.tip_led_ma", formula="string's current, typical LEDs", source=SOURCE)
def electronics_tip_led_ma(electronics_tip_circuit: Circuit | None) -> Real:
    """Current of an LED on the board at the tip; 0 without."""
    return _figure(electronics_tip_circuit, "current_ma")


@dimension("electronics.left_series", formula="⌊0.8 supply / V⌋, made equal", source=SOURCE)
def electronics_left_series(electronics_left_circuit: Circuit | None) -> Real:
    """LEDs in series on the left board."""
    return _figure(electronics_left_circuit, "series")


@dimension("electronics.right_series", formula="⌊0.8 supply / V⌋, made equal", source=SOURCE)
def electronics_right_series(electronics_right_circuit: Circuit | None) -> Real:
    """LEDs in series on the right board."""
    return _figure(electronics_right_circuit, "series")


@dimension("electronics.tip_series", formula="⌊0.8 supply / V⌋, made equal", source=SOURCE)
def electronics_tip_series(electronics_tip_circuit: Circuit | None) -> Real:
    """LEDs in series on the board at the tip; 0 without."""
    return _figure(electronics_tip_circuit, "series")


@dimension("electronics.left_resistor_ohm", formula="(supply - n V) / I, up in E24", source=SOURCE)
def electronics_left_resistor_ohm(electronics_left_circuit: Circuit | None) -> Real:
    """Resistor of the longest strings on the left board; 0 with a driver."""
    return _figure(electronics_left_circuit, "resistance_ohm")


@dimension("electronics.right_resistor_ohm", formula="(supply - n V) / I, up in E24", source=SOURCE)
def electronics_right_resistor_ohm(electronics_right_circuit: Circuit | None) -> Real:
    """Resistor of the longest strings on the right board; 0 with a driver."""
    return _figure(electronics_right_circuit, "resistance_ohm")


@dimension("electronics.tip_resistor_ohm", formula="(supply - n V) / I, up in E24", source=SOURCE)
def electronics_tip_resistor_ohm(electronics_tip_circuit: Circuit | None) -> Real:
    """Resistor of the longest strings on the board at the tip; 0 without or with a driver."""
    return _figure(electronics_tip_circuit, "resistance_ohm")


@dimension("electronics.left_supply_ma", formula="strings · current", source=SOURCE)
def electronics_left_supply_ma(electronics_left_circuit: Circuit | None) -> Real:
    """Current of the left board."""
    return _figure(electronics_left_circuit, "supply_ma")


@dimension("electronics.right_supply_ma", formula="strings · current", source=SOURCE)
def electronics_right_supply_ma(electronics_right_circuit: Circuit | None) -> Real:
    """Current of the right board."""
    return _figure(electronics_right_circuit, "supply_ma")


@dimension("electronics.tip_supply_ma", formula="strings · current", source=SOURCE)
def electronics_tip_supply_ma(electronics_tip_circuit: Circuit | None) -> Real:
    """Current of the board at the tip; 0 without."""
    return _figure(electronics_tip_circuit, "supply_ma")


@dimension("electronics.left_board_c", formula="air + R (power - light)", source=SOURCE)
def electronics_left_board_c(electronics_left_circuit: Circuit | None) -> Real:
    """Temperature of the left board."""
    return _figure(electronics_left_circuit, "board_c")


@dimension("electronics.right_board_c", formula="air + R (power - light)", source=SOURCE)
def electronics_right_board_c(electronics_right_circuit: Circuit | None) -> Real:
    """Temperature of the right board."""
    return _figure(electronics_right_circuit, "board_c")


@dimension("electronics.tip_board_c", formula="air + R (power - light)", source=SOURCE)
def electronics_tip_board_c(electronics_tip_circuit: Circuit | None) -> Real:
    """Temperature of the board at the tip; 0 without."""
    return _figure(electronics_tip_circuit, "board_c")


@dimension("electronics.left_junction_c", formula="board + R_JS (V I - light)", source=SOURCE)
def electronics_left_junction_c(electronics_left_circuit: Circuit | None) -> Real:
    """Junction temperature of the left LEDs."""
    return _figure(electronics_left_circuit, "junction_c")


@dimension("electronics.right_junction_c", formula="board + R_JS (V I - light)", source=SOURCE)
def electronics_right_junction_c(electronics_right_circuit: Circuit | None) -> Real:
    """Junction temperature of the right LEDs."""
    return _figure(electronics_right_circuit, "junction_c")


@dimension("electronics.tip_junction_c", formula="board + R_JS (V I - light)", source=SOURCE)
def electronics_tip_junction_c(electronics_tip_circuit: Circuit | None) -> Real:
    """Junction temperature of the LEDs at the tip; 0 without."""
    return _figure(electronics_tip_circuit, "junction_c")
