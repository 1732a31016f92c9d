"""Circuits of the LED boards: currents, resistors, heat and temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.electronics.circuit import NAMES, Circuit, side_circuit

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


def _figure(circuit: Circuit | None, name: str) -> Real:
    """A figure of a circuit; 0 where the LED is not known."""
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


@dimension("electronics.left_series", formula="⌊0.8 supply / V⌋, made equal", source=SOURCE)
def electronics_left_series(electronics_left_circuit: Circuit | None) -> Real:
    """LEDs in series on the left board."""
    return _figure(electronics_left_circuit, "series")


@dimension("electronics.right_series", formula="⌊0.8 supply / V⌋, made equal", source=SOURCE)
def electronics_right_series(electronics_right_circuit: Circuit | None) -> Real:
    """LEDs in series on the right board."""
    return _figure(electronics_right_circuit, "series")


@dimension("electronics.left_resistor_ohm", formula="(supply - n V) / I, up in E24", source=SOURCE)
def electronics_left_resistor_ohm(electronics_left_circuit: Circuit | None) -> Real:
    """Resistor of the longest strings on the left board; 0 with a driver."""
    return _figure(electronics_left_circuit, "resistance_ohm")


@dimension("electronics.right_resistor_ohm", formula="(supply - n V) / I, up in E24", source=SOURCE)
def electronics_right_resistor_ohm(electronics_right_circuit: Circuit | None) -> Real:
    """Resistor of the longest strings on the right board; 0 with a driver."""
    return _figure(electronics_right_circuit, "resistance_ohm")


@dimension("electronics.left_supply_ma", formula="strings · current", source=SOURCE)
def electronics_left_supply_ma(electronics_left_circuit: Circuit | None) -> Real:
    """Current of the left board."""
    return _figure(electronics_left_circuit, "supply_ma")


@dimension("electronics.right_supply_ma", formula="strings · current", source=SOURCE)
def electronics_right_supply_ma(electronics_right_circuit: Circuit | None) -> Real:
    """Current of the right board."""
    return _figure(electronics_right_circuit, "supply_ma")


@dimension("electronics.left_board_c", formula="air + R (power - light)", source=SOURCE)
def electronics_left_board_c(electronics_left_circuit: Circuit | None) -> Real:
    """Temperature of the left board."""
    return _figure(electronics_left_circuit, "board_c")


@dimension("electronics.right_board_c", formula="air + R (power - light)", source=SOURCE)
def electronics_right_board_c(electronics_right_circuit: Circuit | None) -> Real:
    """Temperature of the right board."""
    return _figure(electronics_right_circuit, "board_c")


@dimension("electronics.left_junction_c", formula="board + R_JS (V I - light)", source=SOURCE)
def electronics_left_junction_c(electronics_left_circuit: Circuit | None) -> Real:
    """Junction temperature of the left LEDs."""
    return _figure(electronics_left_circuit, "junction_c")


@dimension("electronics.right_junction_c", formula="board + R_JS (V I - light)", source=SOURCE)
def electronics_right_junction_c(electronics_right_circuit: Circuit | None) -> Real:
    """Junction temperature of the right LEDs."""
    return _figure(electronics_right_circuit, "junction_c")
