"""What each service must know of an order, as plain text, and which archive goes where."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from gelslim_cad.export.print_files import stl_size_mm
from gelslim_cad.ordering.line import BomLine

Kerfs = Mapping[str, float]
"""Kerf in mm that an outline is moved for, by the name of its file; 0 where it is not moved."""
UNITS = "All lengths in mm, scale 1:1. Do not scale, do not mirror."
LAYERS = {
    "sla": "0.05 mm layers; wash and cure as the resin's maker says",
    "fdm": "0.15 mm layers from a nozzle of 0.4 mm, three walls, 40 % infill or more",
    "sls": "0.1 mm layers; remove all powder from holes and slots",
}
SUPPORTS = {
    "sla": "Supports only on faces without holes or slots, never inside a hole; tilting a part is "
    "fine if its flat base stays within the tolerance.",
    "fdm": "Print as it lies in the file; no supports inside holes and slots.",
    "sls": "No supports; the orientation is free.",
}
TITLES = {"sla": "resin (SLA, DLP)", "fdm": "filament (FDM)", "sls": "powder (SLS, MJF)"}
PROCESSES = {"tough resin": "sla", "mould resin": "sla", "PETG": "fdm", "PA12": "sls"}
"""Process by material."""


@dataclass(frozen=True)
class PrintOrder:
    """How parts are printed.

    Attributes:
        tolerance_mm: Accuracy, plus or minus.
        hints: What to mind of a part, by its name.
    """

    tolerance_mm: float
    hints: Mapping[str, str] = field(default_factory=dict)


def print_text(
    name: str, lines: Sequence[BomLine], order: PrintOrder, files: Mapping[str, bytes]
) -> bytes:
    """Text for the printing service."""
    groups = dict.fromkeys(line.material for line in lines)
    said = [
        f"3D PRINTING ORDER: {name}",
        f"{UNITS} The folders stl and 3mf hold the same parts: take either.",
        f"Accuracy: ± {order.tolerance_mm:g} mm. Colour: black, matt if there is a choice.\n"
        "Orientation: every file lies as it should be printed, z up, its lowest point at z = 0.\n"
        "Leave holes as they come: no drilling, no filling, no paint.",
    ]
    for material in groups:
        rows = [_print_row(line, files, order) for line in lines if line.material == material]
        process = PROCESSES[material]
        how = f"{TITLES[process]}, {LAYERS[process]}.\n{SUPPORTS[process]}"
        said.append("\n".join([f"MATERIAL: {material}, {how}", *rows]))
    said.append(_count(lines))
    return _text(said)


def _print_row(line: BomLine, files: Mapping[str, bytes], order: PrintOrder) -> str:
    size = " x ".join(f"{s:.1f}" for s in stl_size_mm(files[f"stl/{line.name}.stl"]))
    row = f"  {line.quantity} x  {line.name:<20} {size} mm, {line.need.volume_cm3:.1f} cm3"
    hint = order.hints.get(line.name, "")
    return f"{row}\n        {hint}" if hint else row


def laser_text(name: str, cut: Iterable[tuple[BomLine, str]], kerfs: Kerfs) -> bytes:
    """Text for the laser service; `cut` has each line with its file."""
    groups: dict[str, list[tuple[BomLine, str]]] = {}
    for line, path in cut:
        groups.setdefault(sheet_name(line), []).append((line, path))
    said = [
        f"LASER CUTTING ORDER: {name}",
        f"{UNITS} DXF R2010. Layer CUT is cut through; layer NOTES is text and stays uncut; layer "
        "ENGRAVE is empty.\n"
        "The part is what lies inside the outer line; every opening inside it falls out.",
    ]
    for sheet, group in groups.items():
        moved = {kerfs[path.rpartition("/")[2].removesuffix(".dxf")] for _, path in group}
        rows = [
            f"  {line.quantity} x  {path:<48} "
            f"{line.need.size_mm[0]:.2f} x {line.need.size_mm[1]:.2f} mm"
            for line, path in group
        ]
        said.append("\n".join([f"SHEET: {sheet}", _kerf_words(sorted(moved)), *rows]))
    said.append(_count([line for group in groups.values() for line, _ in group]))
    return _text(said)


def _kerf_words(kerfs_mm: Sequence[float]) -> str:
    words = []
    for kerf in kerfs_mm:
        if kerf == 0:
            words.append("The lines are the part's own edges: please compensate your kerf.")
        else:
            words.append(
                f"The lines already lie {kerf / 2:g} mm outside the part, for a kerf of {kerf:g} "
                "mm: please do not compensate again."
            )
    return " ".join(words)


def sheet_name(line: BomLine) -> str:
    """Material and thickness of the sheet that a line is cut from."""
    thickness = f"{round(line.need.thickness_mm, 2):g} mm"
    return line.material if thickness in line.material else f"{line.material}, {thickness}"


def sheet_folder(line: BomLine) -> str:
    """Name of a folder for the sheet: letters, digits, points and underscores."""
    return re.sub(r"[^A-Za-z0-9.]+", "_", sheet_name(line)).strip("_")


def glass_text(name: str, lines: Sequence[BomLine]) -> bytes:
    """Text for who cuts the mirror."""
    rows = [f"  {line.quantity} x  {line.name}.dxf, {line.material}: {line.note}" for line in lines]
    said = [
        f"GLASS ORDER: {name}",
        f"{UNITS} DXF R2010, layer CUT; the lines are the part's own edges, - 0.2 / + 0 mm.",
        "\n".join(rows),
        "The coating is on the face that the light meets first. Leave the protective film on.",
    ]
    return _text(said)


def milling_text(name: str, lines: Sequence[BomLine]) -> bytes:
    """Text for who mills the mould."""
    rows = [
        f"  {line.quantity} x  {line.name}.step, {line.material}: {line.note}" for line in lines
    ]
    said = [
        f"MILLING ORDER: {name}",
        f"{UNITS} STEP AP242, ± 0.05 mm; holes drilled through.",
        "\n".join(rows),
        "The floor of the cavity shapes an optical surface: polish it, do not bead-blast it.",
    ]
    return _text(said)


def stencil_text(name: str, files: Iterable[str]) -> bytes:
    """Text for the stencil maker."""
    said = [
        f"STENCIL ORDER: {name}",
        f"{UNITS} Gerber X2.",
        "One laser-cut stencil of stainless steel, 0.1 mm, without frame, not electropolished.\n"
        "Openings, outline and alignment holes are in " + ", ".join(files) + ".",
    ]
    return _text(said)


WHERE = {
    "printer.zip": "3D printing service, or your own printer",
    "laser.zip": "laser service or maker space",
    "glass.zip": "optics shop or glazier",
    "milling.zip": "milling service",
    "boards.zip": "board house: unpack it, then upload each `*_gerber.zip`",
    "stencil.zip": "stencil maker",
}


def overview(name: str, archives: Mapping[str, str], cost: str) -> bytes:
    """Markdown: which archive goes where, and what the finger costs."""
    rows = [f"| `{file}` | {WHERE[file]} |" for file in archives]
    text = (
        f"# What to order for {name}\n\n"
        "Each archive has all files for one service, the number of pieces, and a text that says "
        "what the service must know. The files in them are those of the other folders.\n\n"
        "| send | to |\n|---|---|\n" + "\n".join(rows) + "\n\n"
        "Buy the rest by `shopping.csv`, which lists it by supplier in whole packs; rows of the "
        "services are in it too, for the sums.\n\n"
        "Print `fit_coupon` and `fit_gauge` on the same printer first, if you can: they tell the "
        "clearance to set before the other parts are made. Order LEDs with the boards if they are "
        f"soldered for you.\n\n{cost}\n"
    )
    return text.encode()


def _count(lines: Sequence[BomLine]) -> str:
    pieces = sum(line.quantity for line in lines)
    return f"{len(lines)} different parts, {pieces} pieces."


def _text(paragraphs: Iterable[str]) -> bytes:
    return ("\n\n".join(paragraphs) + "\n").encode()
