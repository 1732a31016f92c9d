"""Rules on the circuits of the LED boards and on what a board house can make of them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.electronics.circuit import Circuit, Circuits
from gelslim_cad.electronics.finger import UNKNOWN_LED
from gelslim_cad.electronics.heat import SOFT_C
from gelslim_cad.electronics.layout import resistor_size_mm, row_slack_mm
from gelslim_cad.electronics.slots import Spacing
from gelslim_cad.geometry.led_strips import TIP_LIP_MM

MOST_SPREAD_PERCENT = 50.0
"""Beyond it a bin of the forward voltage must be ordered, or one LED outshines the next."""
FLUX_PERCENT = 25.0
THINNEST_FR4_MM = 0.4
THICKEST_FOIL_MM = 0.3


def _known(circuits: Circuits) -> Any:
    """Whether the LEDs of all boards are known."""
    return functools.reduce(np.logical_and, (c is not None and c.known for c in circuits))


def _figures(circuits: Circuits, name: str) -> list[Any]:
    """A figure of all circuits, by its dotted name; 0 where there is none."""
    return [0.0 if c is None else _of(c, name) for c in circuits]


def _finding(
    circuits: Circuits, value: Any, limit: Any, *, least: bool = False, **how: Any
) -> Finding:
    """A finding without a limit where an LED is not known: `electronics.led` then says so."""
    known, none = _known(circuits), -np.inf if least else np.inf
    return Finding(np.where(known, value, 0.0), np.where(known, limit, none), least=least, **how)


def _worst(circuits: Circuits, name: str, limit: str) -> Finding:
    """The board with the least room below its limit, both by names of attributes."""
    if any(circuit is None for circuit in circuits):
        return _finding(circuits, 0.0, 0.0)
    pairs = zip(_figures(circuits, name), _figures(circuits, limit), strict=True)
    return _finding(circuits, *_tightest(list(pairs)))


def _tightest(pairs: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """The value and the limit with the least room between them, design by design."""
    value, limit = (np.asarray(v, dtype=float) for v in pairs[0])
    for other, its_limit in pairs[1:]:
        first = limit - value <= its_limit - other
        value, limit = np.where(first, value, other), np.where(first, limit, its_limit)
    return value, limit


def _of(circuit: Circuit, name: str) -> Any:
    value: Any = circuit
    for part in name.split("."):
        value = getattr(value, part)
    return value


def _greatest(values: list[Any]) -> Any:
    """The greatest of the values of all boards; 0 where there are none."""
    return functools.reduce(np.maximum, values) if values else 0.0


@rule(
    "electronics.led",
    title="LED is known, so that its board can be made",
    parameter="design.leds.model",
    why="current, heat and footprint of the LED boards come from the LED's data",
    advice=f"{UNKNOWN_LED}; without boards the finger is built all the same",
    unit="",
)
def known_led(
    electronics_circuits: Circuits,
) -> Finding:
    """Value 1 where an LED is not known."""
    known = _known(electronics_circuits)
    return Finding(np.where(known, 0.0, 1.0), 0.0, advisory=True)


@rule(
    "electronics.led_ma",
    title="Current of the LEDs within their limit",
    parameter="electronics.current_ma",
    why="more current than the sheet allows shortens the life of the LED; counted for LEDs of the "
    "least forward voltage, warm",
    advice="ask for less current or radiant flux, or choose a larger LED",
)
def led_current(
    electronics_circuits: Circuits,
) -> Finding:
    """Greatest current against the LED's limit."""
    return _worst(electronics_circuits, "greatest_ma", "led.variant.max_current_ma")


@rule(
    "electronics.spread_percent",
    title="LEDs of one type shine alike",
    parameter="electronics.supply_v",
    why="forward voltages differ between LEDs, and the less the resistor takes the more the "
    "currents differ",
    advice="order LEDs of one bin of forward voltage, raise the supply, or use a constant-current "
    "driver",
)
def current_spread(
    electronics_circuits: Circuits,
) -> Finding:
    """How far the current may lie above the typical one."""
    spread = 100 * _greatest(_figures(electronics_circuits, "spread"))
    return _finding(electronics_circuits, spread, MOST_SPREAD_PERCENT, advisory=True)


@rule(
    "electronics.supply_v",
    title="Supply is high enough for the strings",
    parameter="electronics.supply_v",
    why="LEDs of the greatest forward voltage must light too, and a driver needs 1 V for itself",
    advice="raise the supply, or use resistors, which need shorter strings",
)
def supply(
    electronics_circuits: Circuits,
    electronics_supply_v: Real,
) -> Finding:
    """Supply that the strings need against the given one."""
    return _finding(
        electronics_circuits,
        _greatest(_figures(electronics_circuits, "needed_v")),
        electronics_supply_v,
    )


@rule(
    "electronics.resistor_mw",
    title="Resistors stand their power",
    parameter="electronics.supply_v",
    why="on the warm board a resistor stands less than its rating",
    advice="lower the supply or the current",
)
def resistor_power(
    electronics_circuits: Circuits,
) -> Finding:
    """Greatest power of a resistor against its rating at the temperature of the board."""
    return _worst(electronics_circuits, "resistor_mw", "allowed_mw")


@rule(
    "electronics.junction_c",
    title="Junction temperature of the LEDs",
    parameter="design.leds.radiant_flux_mw",
    why="a hotter junction ages quickly and loses light",
    advice="lower the radiant flux or the supply; the exposure gets longer in proportion",
)
def junction(
    electronics_circuits: Circuits,
) -> Finding:
    """Expected junction temperature against the limit of the sheet."""
    return _worst(electronics_circuits, "junction_c", "led.variant.max_junction_c")


@rule(
    "electronics.board_c",
    title="Board stays below the softening of the plastic",
    parameter="design.leds.radiant_flux_mw",
    why="with the light always on, the board warms the channel that holds it",
    advice="lower the radiant flux (the exposure gets longer), switch the light on for exposures "
    "only, lower the supply, or print in a material that stands the heat",
)
def board_temperature(
    electronics_circuits: Circuits,
    manufacturing_print_process: str,
) -> Finding:
    """Temperature of the warmest board in still air."""
    warmer = _greatest(_figures(electronics_circuits, "board_c"))
    return _finding(
        electronics_circuits, warmer, SOFT_C[manufacturing_print_process], advisory=True
    )


@rule(
    "electronics.flux_percent",
    title="Current gives the radiant flux of the traced light",
    parameter="electronics.current_ma",
    why="exposure and brightness are computed from design.leds.radiant_flux_mw",
    advice="leave current_ma out, or give the flux that the LED has at this current",
)
def flux(
    electronics_circuits: Circuits,
    leds_radiant_flux_mw: Real,
) -> Finding:
    """Greatest difference of a board's flux from the given one."""
    apart = [
        np.abs(f / leds_radiant_flux_mw - 1) for f in _figures(electronics_circuits, "flux_mw")
    ]
    return _finding(electronics_circuits, 100 * _greatest(apart), FLUX_PERCENT, advisory=True)


@rule(
    "electronics.width_mm",
    title="Board is wide enough for pads, vias and tracks",
    parameter="design.light_guide.thickness_mm",
    why="the board is as wide as the leg of the guide, that at the tip narrower than the window is "
    "thick",
    advice="use a narrower LED, smaller holes, spaces and edges of the board house, or a thicker "
    "guide; no board files are written",
)
def board_width(
    electronics_circuits: Circuits,
    led_board_width_mm: Real,
    led_tip_board_width_mm: Real,
    electronics_edge_mm: Real,
    electronics_min_space_mm: Real,
    electronics_min_trace_mm: Real,
    electronics_min_drill_mm: Real,
    electronics_min_ring_mm: Real,
) -> Finding:
    """Width that the parts of the tightest board need against its own."""
    spacing = Spacing(
        electronics_edge_mm,
        electronics_min_space_mm,
        electronics_min_trace_mm,
        electronics_min_drill_mm + 2 * electronics_min_ring_mm,
        electronics_min_drill_mm,
    )
    widths = (led_board_width_mm, led_board_width_mm, led_tip_board_width_mm)
    needed = [
        (
            spacing.least_width_mm(
                max(c.led.pads.anode.size_mm[1], c.led.pads.cathode.size_mm[1]),
                resistor_size_mm(c)[1],
                c.strings > 1,
            ),
            width,
        )
        for c, width in zip(electronics_circuits, widths, strict=False)
        if c is not None
    ]
    value, limit = _tightest(needed) if needed else (0.0, led_board_width_mm)
    return _finding(electronics_circuits, value, limit, advisory=True)


@rule(
    "electronics.room_mm",
    title="Resistors, vias and wires find room along the board",
    parameter="design.leds.max_pitch_mm",
    why="the resistors stand between the LEDs, and the wires' pads at the gripper's end",
    advice="allow a larger LED pitch, a smaller LED or less current, longer strings by a higher "
    "supply, or support the guide further at its ends; no board files are written",
)
def board_room(
    electronics_circuits: Circuits,
    led_board_width_mm: Real,
    led_board_length_mm: Real,
    led_pitch_mm: Real,
    led_count: Real,
    led_tip_board_width_mm: Real,
    led_tip_board_length_mm: Real,
    led_tip_pitch_mm: Real,
    led_tip_count: Real,
    guide_proximal_end_x_mm: Real,
    guide_distal_end_x_mm: Real,
    electronics_edge_mm: Real,
    electronics_min_space_mm: Real,
    electronics_min_trace_mm: Real,
    electronics_min_drill_mm: Real,
    electronics_min_ring_mm: Real,
) -> Finding:
    """Room to spare in the tightest slot of all boards."""
    spacing = Spacing(
        electronics_edge_mm,
        electronics_min_space_mm,
        electronics_min_trace_mm,
        electronics_min_drill_mm + 2 * electronics_min_ring_mm,
        electronics_min_drill_mm,
    )
    middle = (guide_proximal_end_x_mm + guide_distal_end_x_mm) / 2
    outer = (led_count - 1) / 2 * led_pitch_mm
    half = led_board_length_mm / 2
    ends = half - middle - outer, half + middle - outer
    side = (led_board_width_mm, led_pitch_mm, ends)
    tip_end = led_tip_board_length_mm / 2 - TIP_LIP_MM - (led_tip_count - 1) / 2 * led_tip_pitch_mm
    tip = (led_tip_board_width_mm, led_tip_pitch_mm, (tip_end, tip_end))
    rooms = [
        row_slack_mm(spacing, c, *row)
        for c, row in zip(electronics_circuits, (side, side, tip), strict=False)
        if c is not None
    ]
    room = -_greatest([-r for r in rooms])
    return _finding(electronics_circuits, room, 0.0, least=True, advisory=True, tolerance=1e-9)


@rule(
    "electronics.part_height_mm",
    title="Resistors stay below the leg of the guide",
    parameter="design.leds.height_mm",
    why="the foot of the leg, and at the tip the window's end, stands the fit clearance before the "
    "LEDs",
    advice="use taller LEDs, or less power, so that a smaller resistor does",
)
def part_height(
    electronics_circuits: Circuits,
    leds_height_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Finding:
    """Height of the taller resistor against that of the leg above the board."""
    tallest = _greatest(_figures(electronics_circuits, "resistor_height_mm"))
    room = leds_height_mm + housing_fit_clearance_mm
    return _finding(electronics_circuits, tallest, room, advisory=True)


@rule(
    "electronics.thickness_mm",
    title="Board comes in this thickness",
    parameter="design.leds.board_thickness_mm",
    why="rigid boards are 0.4 mm or thicker, flexible ones at most 0.3 mm",
    advice="choose electronics.board to suit, or another thickness",
)
def board_thickness(leds_board_thickness_mm: Real, electronics_board: str) -> Finding:
    """Thickness against that of its kind."""
    if electronics_board == "flexible":
        return Finding(leds_board_thickness_mm, THICKEST_FOIL_MM, advisory=True)
    return Finding(leds_board_thickness_mm, THINNEST_FR4_MM, least=True, advisory=True)
