"""What the report says of the traced light: captions of its pictures, and notes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from gelslim_cad.geometry.led_strips import has_tip_light
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.report.tables import Note


def light_pictures(d: Lookup) -> dict[str, tuple[str, str]]:
    """Title and caption of each picture of the light, by its path in the build."""
    rows, more = "From both LED rows", ""
    if has_tip_light(d):
        rows = "From the LED rows of both sides and, along the finger, from that of the tip"
        more = " Below: profiles, and how much a slope of the gel changes each light."
    return {
        "pictures/light_paths.png": ("Light paths", f"{rows}, traced through the guide."),
        "pictures/irradiance.png": (
            "Light on the gel",
            f"That of each strip on the gel's coat.{more}",
        ),
        "pictures/light_ratio.png": (
            "Brightness against bend radius",
            "Over a straight guide with glued 45° mirrors, with 95 % intervals.",
        ),
    }


def light_notes(record: bytes) -> tuple[Note, ...]:
    """Certificate, comparison and exposure from a build's light.json."""
    light = json.loads(record)
    certificate = " ".join(light["certificate"]["sentences"])
    compared = "\n".join(f"The guide is {c['sentence']}." for c in light["comparisons"])
    exposed = "\n".join(f"{e['sentence']}." for e in light["exposures"])
    return (
        Note("Total internal reflection", certificate),
        Note("Brightness", compared),
        Note("Exposure and frame rate", exposed),
        *_tip_notes(light),
    )


def _tip_notes(light: Mapping[str, Any]) -> tuple[Note, ...]:
    """What the light of a strip at the tip brings; none without one, or in the dark."""
    if "tip" not in light:
        return ()
    tip, lights = light["tip"], light["guides"]["curved"]["by_colour"]
    slopes = "; ".join(
        f"{name} changes by {_change(found['slope_sensitivity_along'])} per unit slope along "
        f"the finger and by {_change(found['slope_sensitivity'])} across"
        for name, found in lights.items()
    )
    name, over_sides = tip["colour"], tip["over_sides"]
    least = lights[name]["min_over_mean"]
    if over_sides is None or least is None:
        return ()
    text = (
        f"Light from the tip{'' if name == 'tip' else f' ({name})'}, which no bend guides, is "
        f"{over_sides:.2f} times as bright on the coat as that of a side; its darkest 64th has "
        f"{least:.0%} of its mean.\n{slopes.capitalize()}."
    )
    return (Note("Light from the tip", text),)


def _change(found: Mapping[str, float | None]) -> str:
    """A change with its sign and two decimals; a change that rounds to nothing is +0.00."""
    value = found["value"]
    return "nothing known" if value is None else f"{round(value, 2) + 0.0:+.2f}"
