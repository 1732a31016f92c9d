"""The bill of materials of a finger: its parts, what stands on its boards, and the supplies."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

from gelslim_cad.build.casting import Casting
from gelslim_cad.build.gel_steps import (
    BASE,
    COAT_MM,
    COAT_SOLIDS,
    LEAST_COAT_ML,
    PIGMENT,
    PIGMENT_SHARE,
    SOLVENT,
    coat_volume_ml,
)
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import PAD_LENGTH_MM
from gelslim_cad.electronics.finger import FingerBoards
from gelslim_cad.electronics.order import MATERIAL, bought_parts
from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.geometry.led_strips import has_tip_light, strip_wavelengths_nm
from gelslim_cad.geometry.materials import density_g_cm3
from gelslim_cad.geometry.part import Part
from gelslim_cad.ordering.line import BomLine, Need
from gelslim_cad.ordering.pricing import ASSEMBLY, SHEET_PROCESSES

WIRE_M = 0.5
"""Length of each wire from an LED board to the supply (assumed)."""
CLAMP_BOLTS_MM = (12, 16, 20, 25, 30, 35, 40, 50)
NUT_ROOM_MM = 3.0
"""Of a bolt behind what it clamps: a nut M3 of 2.4 mm and a turn of thread."""
SHEET_MM = re.compile(r"\b([0-9]+(?:\.[0-9]+)?) mm\b")
"""Thickness in the name of a material."""
COAT_G_PER_ML = 1.0
"""Density of silicone and pigment of the coat, about."""

_supply = partial(BomLine, quantity=1, process="buy")


def finger_bill(d: Dimensions, parts: Iterable[Part], boards: FingerBoards) -> tuple[BomLine, ...]:
    """Everything that one finger and its tooling take, without prices.

    Args:
        d: Dimensions of the finger.
        parts: All its parts and tooling.
        boards: Its LED boards.

    Returns:
        The parts, the gel's coat, the parts of the boards with their soldering, the supplies.
    """
    made = bill_of_materials(parts, d["material.gel.density_kg_m3"])
    needs: dict[str, Need] = {
        "gel_pad": Need(Casting.of(d).weighable().mass_g, "g"),
        "cable_pad": Need(PAD_LENGTH_MM * d["camera.cable_width_mm"] / 100, "cm²"),
        "led_wire_1": Need(WIRE_M, "m"),
    }
    if has_tip_light(d):
        tip = list(strip_wavelengths_nm(d))[-1]
        needs[f"led_board_{tip}"] = _board_need(
            d, d["led.tip_board_length_mm"], d["led.tip_board_width_mm"]
        )
    side = _board_need(d, d["led.board_length_mm"], d["led.board_width_mm"])
    lines = (_with_need(line, needs, side) for line in made)
    return (*lines, *coat_bill(d), *board_lines(d, boards), *supplies(d))


def bill_of_materials(parts: Iterable[Part], gel_density_kg_m3: float) -> tuple[BomLine, ...]:
    """Lines in the order of the parts; screws of one kind share a line."""
    known = tuple(parts)
    blanks = {p.name.removesuffix("_blank"): p for p in known if p.name.endswith("_blank")}
    lines = []
    for part in known:
        if part.quantity < 1:
            continue
        name = part.name
        if "fastener" in part.tags:
            name = name.rsplit("_", 1)[0]
        lines.append(
            BomLine(
                name,
                part.quantity,
                part.material,
                part.process,
                _mass_g(part, gel_density_kg_m3),
                part.note,
                not part.in_assembly,
                _measured(blanks.get(part.name, part), part.process),
            )
        )
    return tuple(lines)


def _measured(part: Part, process: str) -> Need:
    """What a printed part, or one that is cut from sheet, takes of its material."""
    if process == "print":
        return Need(volume_cm3=float(part.as_made().solid.Volume()) / 1000)
    if process not in SHEET_PROCESSES:
        return Need()
    from gelslim_cad.export.outline import cut_length_mm, drawn_size_mm, flat_face, moved_contours

    face = flat_face(part.solid)
    contours = moved_contours(face, 0.0)
    return Need(
        size_mm=drawn_size_mm(contours),
        thickness_mm=_sheet_mm(part, float(part.solid.Volume() / face.Area())),
        cut_mm=cut_length_mm(contours),
    )


def _sheet_mm(part: Part, drawn_mm: float) -> float:
    """Thickness of the sheet: that which the material states, as a squeezed shim is thinner."""
    stated = SHEET_MM.search(part.material)
    return drawn_mm if stated is None else float(stated.group(1))


def _with_need(line: BomLine, needs: Mapping[str, Need], board: Need) -> BomLine:
    usual = board if line.process == "pcb" else line.need
    return replace(line, need=needs.get(line.name, usual))


def _board_need(d: Dimensions, length_mm: float, width_mm: float) -> Need:
    return Need(
        size_mm=(length_mm, width_mm),
        thickness_mm=d["design.leds.board_thickness_mm"],
        stock=MATERIAL[d["electronics.board"]],
    )


def board_lines(d: Dimensions, boards: FingerBoards) -> tuple[BomLine, ...]:
    """The parts on the LED boards, which the assembly service buys or you do, and their soldering.

    Without a design of the boards the LEDs alone are known.
    """
    if not boards.boards:
        name = d["design.leds.model"] or "LEDs"
        count = 2 * round(d["led.count"]) + round(d["led.tip_count"])
        return (BomLine("led_any", count, name, "buy", note="no design of the boards, see ORDER"),)
    bought = (
        BomLine(
            part.name,
            part.quantity,
            f"{part.manufacturer} {part.part_number}".strip(),
            "buy",
            note=f"on {part.board}",
            manufacturer=part.manufacturer,
            part_number=part.part_number,
        )
        for part in bought_parts(boards)
    )
    soldered = (
        BomLine(
            f"{ASSEMBLY}_{item.board.name.removeprefix('led_board_')}",
            item.board.quantity,
            f"{count} parts placed and soldered on one side",
            "solder",
            note=f"of {item.board.name}; left out if you solder it yourself on a hot plate",
            need=Need(placements=count),
        )
        for item in boards.boards
        for count in (sum(c.kind != "wires" for c in item.board.components),)
    )
    return (*bought, *soldered)


def coat_bill(d: Dimensions) -> tuple[BomLine, ...]:
    """The paint on the gel: silicone, pigment and solvent."""
    millilitres = coat_volume_ml(d)
    made = f"{COAT_MM * 1000:.0f} µm dry, about {millilitres:.1f} ml of liquid for one gel"
    mixed = max(millilitres, LEAST_COAT_ML)
    silicone_g = COAT_SOLIDS * mixed * COAT_G_PER_ML
    return (
        _supply("coat_silicone", material=BASE, note=made, need=Need(silicone_g, "g")),
        _supply("coat_pigment", material=PIGMENT, need=Need(PIGMENT_SHARE * silicone_g, "g")),
        _supply(
            "coat_solvent",
            material=SOLVENT,
            note="nine parts to one of silicone",
            need=Need((1 - COAT_SOLIDS) * mixed, "ml"),
        ),
    )


def supplies(d: Dimensions) -> tuple[BomLine, ...]:
    """Bolts, glues and small things that no solid stands for."""
    from gelslim_cad.solids.tooling.mould import clamped_mm, plan_mould

    jaw, plan = JawBolts.of_design(d), plan_mould(d)
    over_mm = clamped_mm(d)
    length = next((n for n in CLAMP_BOLTS_MM if n >= over_mm + NUT_ROOM_MM), CLAMP_BOLTS_MM[-1])
    bolts = len(plan.bolts)
    lines = [
        BomLine(
            "jaw_bolt",
            len(jaw.places_mm),
            f"{jaw.bolt} cap head, steel",
            "buy",
            note=f"for the jaw of {jaw.gripper.name}; length by its sheet",
        ),
        BomLine(
            "mould_bolt",
            bolts,
            f"M3 cap head, steel, {length} mm",
            "buy",
            note=f"clamps the mould over {over_mm:.1f} mm",
            tooling=True,
        ),
        BomLine("mould_nut", bolts, "hexagon nut M3, ISO 4032, steel", "buy", tooling=True),
        _supply(
            "bond_primer",
            material="primer for silicone on acrylic",
            note="bonds the gel to the window",
            need=Need(1.0, "ml"),
        ),
        _supply(
            "epoxy",
            material="epoxy adhesive, two parts, slow",
            note="mirror, LED boards and inserts",
            need=Need(2.0, "g"),
        ),
        _supply(
            "marker_ink",
            material="black silicone ink",
            note="for the dots",
            need=Need(1.0, "g"),
        ),
        _supply(
            "led_supply",
            material=f"supply of {d['electronics.supply_v']:g} V for the LEDs",
            note="see electronics/wiring.svg",
        ),
    ]
    if d["manufacturing.mould_process"] in ("acrylic", "aluminium"):
        pins = len(plan.dowels)
        lines.insert(3, BomLine("mould_pin", pins, "dowel pin 3 mm", "buy", tooling=True))
    return tuple(lines)


def _mass_g(part: Part, gel_density_kg_m3: float) -> float | None:
    density = density_g_cm3(part, gel_density_kg_m3)
    return None if density is None else round(part.solid.Volume() / 1000 * density, 2)
