"""BUILD.md: how to make and assemble this finger, with its own numbers."""

from __future__ import annotations

from collections.abc import Sequence

from gelslim_cad.assembly.order import Step
from gelslim_cad.build.assembly_steps import (
    ToldStep,
    fasteners_told,
    motion,
    told_steps,
    total_minutes,
)
from gelslim_cad.build.bezel_steps import bezel_blank_step, thread_step
from gelslim_cad.build.casting import Casting
from gelslim_cad.build.gel_steps import coat_lines, marking_steps, unmarked_steps
from gelslim_cad.build.sheet_steps import guide_steps, kerf_sentence
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.electronics.finger import FingerBoards, finger_boards
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.geometry.led_strips import is_white, shared_light, strip_wavelengths_nm
from gelslim_cad.ordering.line import BomLine
from ifem_export.markers.grid import MarkerGrid

MOULD = "mould_"
"""Begins the names of the mould's parts and of what closes it."""
MILLED = "mould_block"
"""The part of the mould that is milled to order, unless it is printed."""


def build_guide(
    d: Dimensions,
    grid: MarkerGrid | None,
    bom: tuple[BomLine, ...],
    name: str,
    steps: Sequence[Step],
) -> bytes:
    """Markdown with the steps print, cast, mark, laser, assemble, focus.

    Args:
        d: Dimensions of the finger.
        grid: Its markers, None for a gel without them.
        bom: Its bill of materials.
        name: Its name.
        steps: Its order of assembly, each step with the way that is free.

    Returns:
        The text of BUILD.md.
    """
    told = told_steps(d, finger_boards(d), steps)
    sections = (before_assembly(d, grid, bom, name, told), _assemble(told), after_assembly(d))
    return ("\n\n".join(sections) + "\n").encode()


def before_assembly(
    d: Dimensions,
    grid: MarkerGrid | None,
    bom: tuple[BomLine, ...],
    name: str,
    told: Sequence[ToldStep],
) -> str:
    """What to buy and to make before the assembly; see `build_guide`."""
    sections = [
        _head(d, name),
        _shopping(bom, finger_boards(d)),
        _print(d, bom, told),
        _laser(d),
        _cast(d, Casting.of(d).weighable(), bom),
        _mark(d, grid),
    ]
    return "\n\n".join(sections)


def after_assembly(d: Dimensions) -> str:
    """How the finger is focused and checked."""
    return f"{_focus(d)}\n\n{_check(d)}"


def _head(d: Dimensions, name: str) -> str:
    return (
        f"# Building {name}\n\n"
        f"A finger {d['finger.thickness_mm']:.1f} mm thick, {d['finger.width_mm']:.1f} mm wide and "
        f"{d['finger.length_mm']:.1f} mm long, with a {d['design.gel.length_mm']:g} × "
        f"{d['design.gel.width_mm']:g} × {d['stack.gel_total_mm']:g} mm gel. All lengths in mm. "
        f"Left and right are as in the camera's image: {_strips(d)}."
    )


def _strips(d: Dimensions) -> str:
    """Which light comes from where."""
    left, right, *tip = strip_wavelengths_nm(d)
    alike = shared_light(d)
    if is_white(d):
        third = ", and from the tip" if tip else ""
        return f"white light comes from -y (left) and from +y (right){third}"
    if alike:
        return f"light of {alike} comes from -y (left) and from +y (right)"
    third = f", {tip[0]} from the tip" if tip else ""
    return f"{left} light comes from -y (left), {right} from +y (right){third}"


def _shopping(bom: tuple[BomLine, ...], boards: FingerBoards) -> str:
    rows = [f"- {b.quantity} × {b.name}: {b.material}" for b in bom if b.process in ("buy", "pcb")]
    return "## 1. Buy\n\n" + "\n".join(rows) + "\n\n" + _board_order(boards)


def _board_order(boards: FingerBoards) -> str:
    """How the LED boards are ordered, or why they cannot be."""
    if not boards.boards:
        return f"No files of LED boards were written: {boards.problem}."
    names = " and ".join(f"{b.board.quantity} × `{b.board.name}`" for b in boards.boards)
    return (
        f"Order {names} from a board house with `electronics/ORDER.md`: each folder has the "
        "layers as a ZIP archive, the bill of materials and the places of the parts for assembly."
    )


def _print(d: Dimensions, bom: tuple[BomLine, ...], told: Sequence[ToldStep]) -> str:
    names = [b.name for b in bom if b.process == "print" and not b.tooling]
    fit = d["design.housing.fit_clearance_mm"]
    # Inserts and nuts are a step of the assembly.
    threads = "" if any(t.step.text == "threads" for t in told) else thread_step(d)
    return (
        "## 2. Print\n\n"
        "Print `print/fit_coupon.stl` first on the machine you will use: the gap that slides "
        f"without play must be {fit:g} mm, else set `design.housing.fit_clearance_mm` to what "
        "slides and build again.\n\n"
        + "\n".join(f"- `print/{n}.stl` (or `.3mf`), in the orientation of the file" for n in names)
        + "\n\nUse black material or paint the inside matt black: stray light lowers the contrast. "
        f"{threads}{bezel_blank_step(d)}{_printed_tools(bom)}"
    )


def _printed_tools(bom: tuple[BomLine, ...]) -> str:
    """The tools to print, with what to heed; those of the mould belong to the casting."""
    tools = [b for b in bom if b.tooling and b.process == "print" and not b.name.startswith(MOULD)]
    lines = [f"- `print/{b.name}.stl`: {b.note}" for b in tools]
    return "\n\nThe tools that are printed:\n\n" + "\n".join(lines) if lines else ""


def _laser(d: Dimensions) -> str:
    return (
        f"## 3. Light guide\n\n{guide_steps(d)}\n"
        "6. Cut the shims, the fabric skin, the cutting template and the mirror from the other "
        f"`laser/` files. {kerf_sentence(d)}"
    )


def _mould(bom: tuple[BomLine, ...]) -> str:
    """The parts of the mould from below, with their files and what to heed."""
    lines = [
        f"- {b.quantity} × `{_mould_file(b)}`: {b.note}\n"
        for b in bom
        if b.tooling and b.name.startswith(MOULD) and b.note
    ]
    return "The mould, from below:\n\n" + "".join(lines) + "\n" if lines else ""


def _mould_file(line: BomLine) -> str:
    """File that a part of the mould is made from; the name of what closes the mould."""
    if line.process == "buy" and line.name != MILLED:
        return line.name
    folder, suffix = {"laser": ("laser", "dxf"), "print": ("mould", "stl")}.get(
        line.process, ("mould", "step")
    )
    return f"{folder}/{line.name}.{suffix}"


def _cast(d: Dimensions, batch: Casting, bom: tuple[BomLine, ...]) -> str:
    return (
        "## 4. Cast the gel\n\n"
        f"{_mould(bom)}"
        f"- Mix **{batch.mass_a_g:.2f} g A + {batch.mass_b_g:.2f} g B** "
        f"({d['material.gel.mix_ratio_a']:g}:{d['material.gel.mix_ratio_b']:g} by mass).\n\n"
        "| quantity | how | value |\n|---|---|---|\n"
        + "".join(
            f"| {q} | {how} | {value:.3g} {unit} |\n" for q, how, value, unit in batch.lines()
        )
        + "\n"
        f"- The cavity is larger by {d['manufacturing.gel_shrinkage_percent']:g} % for shrinkage.\n"
        "- Degas in vacuum until no bubble rises. Pour at the gate until every vent shows gel.\n"
        "- Platinum silicone does not cure against sulphur, amines, tin or uncured resin: wear "
        "nitrile gloves; coat a printed mould, or use the acrylic one.\n"
        "- Cure, open, trim the edge along `laser/cutting_template.dxf`.\n"
        "- Bond the flat face to the acrylic window (primer, no bubbles); the gel sits "
        f"{d['design.light_guide.side_margin_mm']:g} mm inside the window on each side."
        f"{coat_lines(d)}"
    )


def _mark(d: Dimensions, grid: MarkerGrid | None) -> str:
    if grid is None:
        return f"## 5. Coat\n\n{unmarked_steps()}"
    return f"## 5. Markers\n\n{marking_steps(d, grid)}"


def _assemble(told: Sequence[ToldStep]) -> str:
    """The steps of the proven order, each with what it moves, what holds it and what to check."""
    steps = "\n".join(
        f"{t.number}. **{t.text.title}** ({t.text.minutes:g} min). *Way:* {motion(t.step)} "
        + " ".join(words for words in (t.text.do, fasteners_told(t.step)) if words)
        + f" *Check:* {t.text.look}"
        for t in told
    )
    return (
        f"## 6. Assemble\n\n{len(told)} steps, about {total_minutes(told):.0f} minutes for the "
        "first finger (assumed; curing of glue comes on top). The finger lies with its gel up. "
        "Torques are assumed: two fingers on the driver, "
        "not the fist. `assembly.json` has the same steps as data; every way was found free, and "
        "every screw within reach of its driver. `BUILD.html` shows a picture of each step.\n\n"
        f"{steps}"
    )


def _focus(d: Dimensions) -> str:
    return (
        "## 7. Focus\n\n"
        f"{_how_to_focus(d)} Expect a blur of "
        f"{d['view.near_blur_mm']:.3f} mm at the near and {d['view.far_blur_mm']:.3f} mm at the "
        f"far edge of the gel ({_detail(d)} {d['design.markers.diameter_mm']:g} mm)."
    )


def _detail(d: Dimensions) -> str:
    """What the picture must resolve."""
    return "markers are" if has_markers(d) else "to be compared with a detail of"


def _how_to_focus(d: Dimensions) -> str:
    before_mm = d["view.focus_mm"] - d["camera_pose.lens_front_mm"]
    if d["camera.focusing"] == "fixed":
        return f"The lens is fixed: it is sharp {before_mm:.2f} mm from its front."
    turn = (
        f": about {d['view.lens_extension_mm']:.2f} mm out from infinity focus"
        if d["camera.focusing"] == "unit"
        else ""
    )
    return (
        "Set the camera in `print/focus_jig.stl` and turn the lens until the target, "
        f"{before_mm:.2f} mm from the front of the lens, is sharp{turn}."
    )


def _check(d: Dimensions) -> str:
    return (
        "## 8. Check\n\n"
        f"Compare the live image with the camera's view in `report.html`: {_all_seen(d)}, "
        f"{d['view.marker_across_px']:.1f} × {d['view.marker_along_px']:.1f} px (across × along) "
        "at the gel's far edge, near edge "
        f"{d['view.keystone']:.2f} times larger than the far one. {_seen(d)}"
    )


def _all_seen(d: Dimensions) -> str:
    """What the picture must show whole."""
    if has_markers(d):
        return "all dots in the picture"
    detail = d["design.markers.diameter_mm"]
    return f"the whole gel in the picture, a detail of {detail:g} mm"


def _seen(d: Dimensions) -> str:
    """What the picture shows of the light of the strips."""
    if d["camera.picture"] == "mono":
        return "The picture is grey, and left and right are equally bright."
    if shared_light(d):
        return "Left and right have the same colour."
    left, right, *tip = strip_wavelengths_nm(d)
    third = f", the edge at the tip {tip[0]}" if tip else ""
    return f"Left {left}, right {right}{third}."
