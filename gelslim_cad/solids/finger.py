"""All parts of the finger, assembled in the sensor frame."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.adapter import adapter
from gelslim_cad.solids.bezel import bezel
from gelslim_cad.solids.body import body
from gelslim_cad.solids.camera import camera, camera_clamp
from gelslim_cad.solids.cover import cover
from gelslim_cad.solids.gel import gel_pad
from gelslim_cad.solids.guide import guide_blank, light_guide
from gelslim_cad.solids.leds import led_boards
from gelslim_cad.solids.mirror import mirror, mirror_seat
from gelslim_cad.solids.screws import screws
from gelslim_cad.solids.shims import shims


def finger_parts(d: Dimensions) -> tuple[Part, ...]:
    """Every part in its place; raises SolidError naming a part that cannot be made."""
    return (
        body(d),
        cover(d),
        bezel(d),
        light_guide(d),
        gel_pad(d),
        mirror(d),
        mirror_seat(d),
        camera(d),
        camera_clamp(d),
        *led_boards(d),
        *shims(d),
        adapter(d),
        *screws(d),
    )


def blanks(d: Dimensions) -> tuple[Part, ...]:
    """Flat blanks that parts of the finger are formed from."""
    return (guide_blank(d),)
