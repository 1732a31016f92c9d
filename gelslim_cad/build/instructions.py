"""BUILD.md: how to make and assemble this finger, with its own numbers."""

from __future__ import annotations

from collections.abc import Iterable

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.report import BomLine
from gelslim_cad.solids.casting import Casting
from ifem_export.markers.grid import MarkerGrid


def build_guide(
    d: Dimensions, grid: MarkerGrid, batch: Casting, bom: Iterable[BomLine], name: str
) -> bytes:
    """Markdown with the steps print, cast, mark, laser, assemble, focus."""
    lines = tuple(bom)
    sections = [
        _head(d, name),
        _shopping(lines),
        _print(d, lines),
        _laser(d),
        _cast(d, batch),
        _mark(d, grid),
        _assemble(d),
        _focus(d),
        _check(d),
    ]
    return ("\n\n".join(sections) + "\n").encode()


def _head(d: Dimensions, name: str) -> str:
    return (
        f"# Building {name}\n\n"
        f"A finger {d['finger.thickness_mm']:.1f} mm thick, {d['finger.width_mm']:.1f} mm wide and "
        f"{d['finger.length_mm']:.1f} mm long, with a {d['design.gel.length_mm']:g} × "
        f"{d['design.gel.width_mm']:g} × {d['stack.gel_total_mm']:g} mm gel. All lengths in mm. "
        "Left and right are as in the camera's image: red light comes from -y (left), green from "
        "+y (right)."
    )


def _shopping(bom: tuple[BomLine, ...]) -> str:
    rows = [f"- {b.quantity} × {b.name}: {b.material}" for b in bom if b.process in ("buy", "pcb")]
    return "## 1. Buy\n\n" + "\n".join(rows)


def _print(d: Dimensions, bom: tuple[BomLine, ...]) -> str:
    names = [b.name for b in bom if b.process == "print" and not b.tooling]
    fit = d["design.housing.fit_clearance_mm"]
    return (
        "## 2. Print\n\n"
        "Print `print/fit_coupon.stl` first on the machine you will use: the gap that slides "
        f"without play must be {fit:g} mm, else set `design.housing.fit_clearance_mm` to what "
        "slides and build again.\n\n"
        + "\n".join(f"- `print/{n}.stl` (or `.3mf`), in the orientation of the file" for n in names)
        + "\n\nUse black material or paint the inside matt black: stray light lowers the contrast. "
        "Holes for countersunk screws are tapped by the screws themselves."
    )


def _laser(d: Dimensions) -> str:
    r, t = d["guide.inner_radius_mm"], d["design.light_guide.thickness_mm"]
    return (
        "## 3. Light guide\n\n"
        f"1. Laser-cut `laser/light_guide_blank.dxf` from {t:g} mm cast acrylic "
        f"({d['guide.length_mm']:.2f} × {d['guide.blank_width_mm']:.2f} mm). Measure the sheet: "
        f"stock may differ by {100 * d['manufacturing.acrylic_tolerance_ratio']:g} %.\n"
        "2. Anneal (80 °C, 1 h per 3 mm, slow cooling), or the edge crazes when glued.\n"
        f"3. Bend both sides by 90° over a former of radius {r:.2f} mm (R/t = "
        f"{d['guide.bend_ratio']:g}) at about 160 °C; legs "
        f"{d['design.light_guide.leg_length_mm']:g} mm long, outer width "
        f"{d['guide.outer_width_mm']:.2f} mm.\n"
        "4. Polish the ends of the legs: light enters there.\n"
        "5. Cut the shims, the fabric skin and the cutting template from the other `laser/` files."
    )


def _cast(d: Dimensions, batch: Casting) -> str:
    return (
        "## 4. Cast the gel\n\n"
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
    )


def _mark(d: Dimensions, grid: MarkerGrid) -> str:
    return (
        "## 5. Markers\n\n"
        f"{len(grid)} dots of {d['design.markers.diameter_mm']:g} mm at "
        f"{d['design.markers.pitch_mm']:g} mm pitch, {grid.lattice_shape[0]} rows along the finger "
        f"× {grid.lattice_shape[1]} columns; process: {d['manufacturing.marking_process']}. Print "
        "`markers/markers.pdf` at 100 % and measure the scale bar before anything else. The arrow "
        "points to the tip. The dots go on the outer surface, under the paint. The "
        f"{len(grid.anchor_sites)} anchors ({d['design.markers.anchors']}) must stay: they "
        "tell the tracker where it is."
    )


def _assemble(d: Dimensions) -> str:
    return (
        "## 6. Assemble\n\n"
        "1. Glue the mirror on `mirror_seat` against its stop, coated side up; screw the seat to "
        "`back_cover` (its thin end drops into the recess).\n"
        "2. Drop the camera into `camera_clamp`, screw the clamp to the cover.\n"
        "3. Lay the LED boards on the pedestals of the cover: red at -y, green at +y; lead the "
        "wires through the notches into the chamber.\n"
        "4. Lay the two shims on the ledges of `body`, then the guide with the gel, legs into the "
        "channels.\n"
        f"5. Screw down `tip_bezel`. It compresses the shims from "
        f"{d['design.housing.shim_thickness_mm']:g} to {d['shim.compressed_mm']:.2f} mm; that "
        "pre-load keeps the acrylic out of tension.\n"
        "6. Close the back cover with the cable through the slot of the mount.\n"
        "7. Slide the tongues of `gripper_adapter` into the mount and fasten the two cross bolts."
    )


def _focus(d: Dimensions) -> str:
    return (
        "## 7. Focus\n\n"
        f"Set the camera in `print/focus_jig.stl` and turn the lens until the target, "
        f"{d['view.focus_mm']:.2f} mm from the front of the lens, is sharp: about "
        f"{d['view.lens_extension_mm']:.2f} mm out from infinity focus. Expect a blur of "
        f"{d['view.near_blur_mm']:.3f} mm at the near and {d['view.far_blur_mm']:.3f} mm at the "
        f"far edge of the gel (markers are {d['design.markers.diameter_mm']:g} mm)."
    )


def _check(d: Dimensions) -> str:
    return (
        "## 8. Check\n\n"
        "Compare the live image with the camera's view in `report.html`: all dots in the picture, "
        f"about {d['view.marker_across_px']:.1f} px wide at the far edge, near edge "
        f"{d['view.keystone']:.2f} times larger than the far one. Left red, right green."
    )
