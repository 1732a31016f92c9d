"""Steps of BUILD.md on what is cut from sheet and bent, with the finger's own numbers."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.led_strips import has_tip_light


def guide_steps(d: Dimensions) -> str:
    """Cutting, bending and trimming of the light guide."""
    r, t = d["guide.inner_radius_mm"], d["design.light_guide.thickness_mm"]
    leg, trim = d["design.light_guide.leg_length_mm"], d["manufacturing.leg_trim_mm"]
    shrinkage = d["manufacturing.heat_shrinkage_percent"]
    shrunk = (
        f"; the blank is larger by {shrinkage:g} % for the sheet's shrinkage when it is heated"
        if shrinkage
        else "; heat it along the bends only: cast sheet that is heated as a whole shrinks by up "
        "to 1.5 % (`manufacturing.heat_shrinkage_percent`)"
    )
    trimmed = (
        f"4. Set the guide on `print/trim_jig.stl` and file the legs, which are {trim:g} mm too "
        f"long, until the file touches the jig: {leg:g} mm stay straight. Polish the ends: light "
        "enters there.\n"
        if trim
        else "4. Polish the ends of the legs: light enters there.\n"
    )
    if has_tip_light(d):
        trimmed += (
            "   Polish the end face of the window at the tip as well: the third strip shines into "
            "it. A laser's cut is clear enough if it is not matt; keep the face flat and square.\n"
        )
    return (
        f"1. Laser-cut `laser/light_guide_blank.dxf` from {t:g} mm cast acrylic "
        f"({d['guide.blank_length_mm']:.2f} × {d['guide.blank_width_mm']:.2f} mm{shrunk}). Measure "
        f"the sheet: stock may differ by {stock_error_mm(d):.2f} mm.\n"
        "2. Anneal (80 °C, 1 h per 3 mm, slow cooling), or the edge crazes when glued.\n"
        f"3. Mark the middle of the blank. Heat it to about 160 °C, lay it on "
        "`print/bending_former.stl` against the stop, its middle at the notch, bend both sides by "
        f"90° at once and press them on with two boards until they are cold (radius {r:.2f} mm, "
        f"R/t = {d['guide.bend_ratio']:g}). Outer width {d['guide.outer_width_mm']:.2f} mm; if the "
        "legs end at different heights, the middle was off.\n"
        f"{trimmed}"
        "5. Anneal once more if you have sawn or filed much."
    )


def stock_error_mm(d: Dimensions) -> float:
    """Largest error of a cast sheet, ISO 7823-1."""
    share = d["manufacturing.acrylic_tolerance_ratio"] * d["design.light_guide.thickness_mm"]
    return d["tolerance.acrylic_sheet_mm"] + share


def kerf_sentence(d: Dimensions) -> str:
    """Who compensates the kerf."""
    kerfs = {
        "acrylic": d["manufacturing.kerf.acrylic_mm"],
        "metal": d["manufacturing.kerf.metal_mm"],
        "film": d["manufacturing.kerf.film_mm"],
        "silicone and fabric": d["manufacturing.kerf.soft_mm"],
    }
    moved = [f"{name} {kerf:g} mm" for name, kerf in kerfs.items() if kerf]
    nominal = [name for name, kerf in kerfs.items() if not kerf]
    words = []
    if moved:
        words.append(
            f"The paths already lie half a kerf outside the part ({', '.join(moved)}): let nobody "
            "compensate it again."
        )
    if nominal:
        words.append(
            f"The lines of {', '.join(nominal)} are the part's own edges: ask the service to "
            "compensate its kerf, or set `manufacturing.kerf`."
        )
    return " ".join(words)
