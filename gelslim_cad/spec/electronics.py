"""The LED boards: their supply, their circuit and what the board house can make."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

OWN = (
    "own_forward_v",
    "own_test_current_ma",
    "own_max_current_ma",
    "own_thermal_k_per_w",
    "own_max_junction_c",
)
"""Fields that together stand for an LED that the library does not have."""


class Electronics(Block):
    """Supply, circuit and making of the LED boards."""

    supply_v: float = between(1.5, 60, "Supply voltage", default=5.0)
    driver: Literal["resistor", "constant_current"] = Field(
        default="resistor",
        description="What limits the current: a resistor for each string, on the board, or a "
        "driver at the supply, with all LEDs of a board in one string",
    )
    current_ma: float | None = Field(
        default=None,
        gt=0,
        le=5000,
        description="Current of each LED; left out: that which gives design.leds.radiant_flux_mw",
    )
    ambient_c: float = between(-20, 60, "Temperature of the air around the finger", default=25.0)
    board: Literal["fr4", "flexible"] = Field(
        default="fr4", description="Rigid board, or polyimide foil for boards below 0.4 mm"
    )
    copper_um: float = between(9, 140, "Thickness of the copper", default=35.0)
    min_trace_mm: float = between(0.05, 1, "Narrowest trace of the board house", default=0.15)
    min_space_mm: float = between(0.05, 1, "Narrowest space of the board house", default=0.15)
    min_drill_mm: float = between(0.1, 1, "Smallest plated hole of the board house", default=0.3)
    min_ring_mm: float = between(
        0.05, 0.5, "Narrowest copper ring around a plated hole", default=0.13
    )
    edge_mm: float = between(0.1, 2, "Copper's distance from the edge of the board", default=0.2)
    own_forward_v: tuple[float, ...] = Field(
        default=(),
        max_length=3,
        description="Typical forward voltages of the LEDs on the left and on the right board and, "
        "where there is one, at the tip, for a model that the library does not have; needs the "
        "other own_ fields too",
    )
    own_test_current_ma: float | None = above(0, 5000, "Current of own_forward_v", default=None)
    own_max_current_ma: float | None = above(0, 5000, "Greatest current", default=None)
    own_thermal_k_per_w: float | None = above(
        0, 2000, "Thermal resistance from junction to solder point", default=None
    )
    own_max_junction_c: float | None = above(50, 200, "Greatest junction temperature", default=None)

    @model_validator(mode="after")
    def _whole_led(self) -> Electronics:
        missing = [name for name in OWN if getattr(self, name) in (None, ())]
        if missing and len(missing) < len(OWN):
            raise FieldError(
                missing[0],
                "is needed with the other own_ fields, which describe an LED together",
                f"give {', '.join(missing)} too, or none of them",
            )
        volts = self.own_forward_v
        if volts and not (len(volts) in (2, 3) and all(0.5 < v < 10 for v in volts)):
            raise FieldError(
                "own_forward_v",
                "must be voltages between 0.5 and 10 V, of the left and of the right board and of "
                "that at the tip where there is one",
                "give the typical forward voltages of the LED's sheet",
            )
        return self
