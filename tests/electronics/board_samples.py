"""Fingers whose boards the tests lay out: shipped ones, and narrow, flexible and driven ones."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import shipped_fingers

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.electronics.finger import FingerBoard, FingerBoards, finger_boards
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

DESIGNS = Path(__file__).parents[2] / "designs"
NARROW = {
    "design.light_guide.thickness_mm": 1.0,
    "design.leds.model": "OptoSupply 0402",
    "design.leds.package_mm": 1.0,
    "design.leds.height_mm": 0.4,
    "design.leds.radiant_flux_mw": 1.0,
}
SMALL = {
    "design.light_guide.thickness_mm": 2.0,
    "design.leds.model": "OSRAM 0603",
    "design.leds.package_mm": 1.6,
    "design.leds.height_mm": 0.6,
    "design.leds.radiant_flux_mw": 0.4,
    "electronics.min_drill_mm": 0.2,
}
INFRARED = {
    "camera.picture": "mono",
    "design.leds.model": "VSMY1850",
    "design.leds.height_mm": 0.85,
    "design.leds.one_wavelength_nm": 850.0,
}
FINE = {
    "electronics.min_drill_mm": 0.15,
    "electronics.min_ring_mm": 0.1,
    "electronics.min_space_mm": 0.1,
    "electronics.min_trace_mm": 0.1,
    "electronics.edge_mm": 0.15,
}
FLEXIBLE = {"electronics.board": "flexible", "design.leds.board_thickness_mm": 0.2}
DRIVEN = {"electronics.driver": "constant_current", "electronics.supply_v": 24.0}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "gelslim2": ("gelslim2", {}),
    "mini20": ("mini20", {}),
    "long50": ("long50", {}),
    "twelve_volts": (
        "gelslim2",
        {"electronics.supply_v": 12.0, "design.leds.radiant_flux_mw": 8.0},
    ),
    "unequal_strings": (
        "gelslim2",
        {
            "design.leds.max_pitch_mm": 4.1,
            "electronics.supply_v": 9.0,
            "design.leds.radiant_flux_mw": 8.0,
        },
    ),
    "driven": ("gelslim2", DRIVEN),
    "small": ("mini20", SMALL),
    "infrared": ("mini20", INFRARED),
    "narrow": ("mini20", {**NARROW, **FINE}),
    "narrow_flexible": ("mini20", {**NARROW, **FINE, **FLEXIBLE}),
    "narrow_driven": ("mini20", {**NARROW, **DRIVEN, "electronics.min_drill_mm": 0.2}),
    "tip": ("gelslim2", {"design.leds.tip": "blue"}),
    "white_tip": ("mini20", {"design.leds.light": "white", "design.leds.tip": "white"}),
    "own_led": (
        "mini20",
        {
            "design.leds.model": "my own",
            "electronics.own_forward_v": (2.0, 3.0),
            "electronics.own_test_current_ma": 20.0,
            "electronics.own_max_current_ma": 50.0,
            "electronics.own_thermal_k_per_w": 100.0,
            "electronics.own_max_junction_c": 120.0,
        },
    ),
}


def varied(design: str, changes: dict[str, Any]) -> Spec:
    """A shipped spec with fields replaced by their dotted paths."""
    return shipped_fingers.varied(read_spec(DESIGNS / f"{design}.yaml").spec, changes)


@cache
def derived(case: str) -> Dimensions:
    return derive(varied(*CASES[case]))


@cache
def made(case: str) -> FingerBoards:
    return finger_boards(derived(case))


ALL_BOARDS = [(case, number) for case in CASES for number in (0, 1)] + [("tip", 2)]


def board_of(case: str, number: int) -> FingerBoard:
    boards = made(case)
    assert boards.problem == ""
    return boards.boards[min(number, len(boards.boards) - 1)]
