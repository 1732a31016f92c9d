"""LED boards under the legs: red at -y (left in the image), green at +y."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import GREEN_BOARD, RED_BOARD
from gelslim_cad.solids.shapes import box, single, union


def led_positions_mm(d: Dimensions) -> list[float]:
    """LED centres along the finger."""
    count, pitch = round(d["led.count"]), d["led.pitch_mm"]
    return [(k - (count - 1) / 2) * pitch for k in range(count)]


def _board(d: Dimensions, side: int) -> cq.Solid:
    y = side * d["led.y_mm"]
    half = d["led.board_width_mm"] / 2
    bottom = d["led.board_bottom_z_mm"]
    top = bottom + d["design.leds.board_thickness_mm"]
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    reach = d["led.board_length_mm"] / 2
    package = d["design.leds.package_mm"] / 2
    pieces: list[cq.Shape] = [
        box((middle - reach, middle + reach), (y - half, y + half), (bottom, top))
    ]
    pieces += [
        box((x - package, x + package), (y - package, y + package), (top - 0.05, d["led.top_z_mm"]))
        for x in led_positions_mm(d)
    ]
    return single(union(pieces), "LED board")


def led_boards(d: Dimensions) -> tuple[Part, Part]:
    """The red and the green board."""
    model, count = d["design.leds.model"], round(d["led.count"])
    red, green = (
        Part(
            name=f"led_board_{name}",
            solid=_board(d, side),
            material=f"{count} × {model} {name}, {d['design.leds.board_thickness_mm']:g} mm board",
            process="pcb",
            colour=colour,
            explode_mm=(0, side * 16, -6),
            note=f"{count} LEDs at {d['led.pitch_mm']:.2f} mm pitch",
        )
        for name, side, colour in (("red", -1, RED_BOARD), ("green", 1, GREEN_BOARD))
    )
    return red, green
