"""The proven order of assembly as plain data, for `assembly.json`, the report and other programs.

Infinite lengths, of legs that come from far outside, are null.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gelslim_cad.assembly.drivers import Driver
from gelslim_cad.assembly.order import Fastener, Leg, Step, Way

if TYPE_CHECKING:
    from gelslim_cad.assembly.proof import ProvenStep

FORMAT = "gelslim-assembly/1"
DECIMALS = 6


def assembly_record(name: str, proven: Sequence[ProvenStep]) -> dict[str, Any]:
    """The order of a finger as data.

    Args:
        name: Name of the finger.
        proven: Its steps, as `prove` gives them.

    Returns:
        A mapping that can be written as JSON: lengths in mm, directions in the sensor frame.
    """
    from gelslim_cad.assembly.bodies import SLACK_MM
    from gelslim_cad.assembly.proof import GAPS_MM, SEAT_MM

    return {
        "format": FORMAT,
        "name": name,
        "frame": "origin at the centre of the gel's outer surface, x towards the tip, y across, "
        "z out of the gel; mm",
        "overlap_found_mm": SLACK_MM,
        "gaps_tried_mm": list(GAPS_MM),
        "gap_ends_before_seat_mm": SEAT_MM,
        "steps": [_step(number, p) for number, p in enumerate(proven, start=1)],
    }


def _step(number: int, proven: ProvenStep) -> dict[str, Any]:
    step = proven.step
    return {
        "number": number,
        "key": step.key,
        "text": step.text,
        "moves": list(step.moves),
        "stays": list(step.stays),
        "way": _way(proven.way),
        "held_by": step.held_by,
        "gap_mm": proven.gap_mm,
        "closest": list(proven.closest),
        "ignored": [{"part": part, "reason": reason} for part, reason in step.ignored],
        "fasteners": [
            {
                "part": f.part,
                "way": _way(f.way),
                "driver": None if f.driver is None else {"name": f.driver.name, **asdict(f.driver)},
            }
            for f in step.fasteners
        ],
    }


def _way(way: Way) -> list[dict[str, Any]]:
    return [
        {
            "direction": [round(v, DECIMALS) + 0.0 for v in leg.direction],
            "length_mm": round(leg.length_mm, DECIMALS) if math.isfinite(leg.length_mm) else None,
        }
        for leg in way
    ]


def read_steps(record: Mapping[str, Any]) -> tuple[Step, ...]:
    """The steps of a record, each with the way that is free.

    Args:
        record: What `assembly_record` gives, also after a round through JSON.

    Returns:
        The steps; directions are rounded to six digits.
    """
    return tuple(
        Step(
            s["key"],
            s["text"],
            tuple(s["moves"]),
            tuple(s["stays"]),
            _read_way(s["way"]),
            (),
            s["held_by"],
            tuple(_read_fastener(f) for f in s["fasteners"]),
            tuple((i["part"], i["reason"]) for i in s["ignored"]),
        )
        for s in record["steps"]
    )


def _read_fastener(found: Mapping[str, Any]) -> Fastener:
    driver = found["driver"]
    values = None if driver is None else {k: v for k, v in driver.items() if k != "name"}
    return Fastener(
        found["part"], _read_way(found["way"]), None if values is None else Driver(**values)
    )


def _read_way(legs: Sequence[Mapping[str, Any]]) -> Way:
    return tuple(
        Leg(
            (leg["direction"][0], leg["direction"][1], leg["direction"][2]),
            math.inf if leg["length_mm"] is None else leg["length_mm"],
        )
        for leg in legs
    )
