"""Steps of BUILD.md on the gel's coat and its markers, by the process that is chosen."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.markers.process import MARKING_PROCESSES
from ifem_export.markers.grid import MarkerGrid

COAT_MM = 0.02
"""Dry thickness of the coat, three sprayed passes: assumed; thicker coats stiffen the gel."""
COAT_SOLIDS = 0.1
"""Volume of dry coat over that of the sprayed liquid: one part of silicone in ten."""
SPRAY_SHARE = 0.3
"""Share of the sprayed liquid that lands on a gel of this size (assumed)."""
LEAST_COAT_ML = 2.0
"""Less liquid cannot be mixed and sprayed (assumed)."""
PIGMENT_SHARE = 0.03
"""Mass of the pigment over that of the coat's silicone (assumed)."""
BASE = "silicone of the gel or a softer one (Psycho Paint or the like), platinum cure"
SOLVENT = "NOVOCS or naphtha, a solvent for silicone"
PIGMENT = f"silver or grey pigment for silicone, {100 * PIGMENT_SHARE:.0f} % of the silicone's mass"


def coat_volume_ml(d: Dimensions) -> float:
    """Liquid to mix for the coat of one gel, ml."""
    shape = GelShape.of(d)
    dry = shape.length_mm * shape.width_mm * COAT_MM / 1000
    return dry / COAT_SOLIDS / SPRAY_SHARE


def coat_lines(d: Dimensions) -> str:
    """Recipe of the coat."""
    liquid = coat_volume_ml(d)
    return (
        "\n\nThe coat is the paint on the outer face: one part of "
        f"{BASE}, {PIGMENT}, in nine parts of {SOLVENT}. Mix "
        f"{max(liquid, LEAST_COAT_ML):.1f} ml for one gel (it needs {liquid:.1f} ml; "
        f"{COAT_MM * 1000:.0f} µm dry), spray three thin passes from 20 cm, five minutes apart, "
        "and cure it as the gel. Its diffuse reflectance is taken to be "
        f"{d['material.gel.coat_reflectance']:g}; these figures are assumed, weigh a spoilt gel "
        "before and after."
    )


def marking_steps(d: Dimensions, grid: MarkerGrid) -> str:
    """What to do with which file, for the process of the spec."""
    name = d["manufacturing.marking_process"]
    process = MARKING_PROCESSES[name]
    files = ", ".join(f"`markers/{file}`" for file in process.files)
    jig = "`laser/cutting_template.dxf` holds the gel in place"
    anchors = (
        f"The {len(grid.anchor_sites)} anchors ({d['design.markers.anchors']}) must stay: they "
        "tell the tracker where it is."
        if len(grid.anchor_sites)
        else "There are no anchors."
    )
    return (
        f"{len(grid)} dots of {d['design.markers.diameter_mm']:g} mm at "
        f"{d['design.markers.pitch_mm']:g} mm pitch, {grid.lattice_shape[0]} rows along the finger "
        f"× {grid.lattice_shape[1]} columns. Process: {process.title.lower()} ({name}); files: "
        f"{files}. The arrow in the drawing points to the tip.\n\n"
        + "\n".join(f"{k}. {step}" for k, step in enumerate(_STEPS[name], start=1))
        + f"\n\n{jig}. {anchors}"
    )


def unmarked_steps() -> str:
    """What to do with a gel without markers."""
    return (
        "Spray the coat (above) on the cured gel in `laser/cutting_template.dxf`, and let it cure. "
        "This gel has no markers: it shows shapes and textures, but there are no forces and no "
        "bundle for it."
    )


_STEPS = {
    "laser_opened_paint": (
        "Spray the coat (above) on the cured gel, and let it cure.",
        "Open the dots with a CO2 laser at low power, coordinates in mm, 1:1; try the power on a "
        "scrap gel until the paint is gone and the gel is not marked.",
        "Fill the dots with black silicone ink, draw it off flush, let it cure.",
        "Measure the length of ten pitches in the picture of a scale: it must agree to 0.2 %.",
    ),
    "laser_etch": (
        "Etch the dots into the bare gel with a CO2 laser, 1:1, one pass; the dots turn matt.",
        "Rub black silicone ink into them and wipe the face clean.",
        "Measure ten pitches, then spray the coat (above) over the dots.",
    ),
    "uv_print": (
        "Treat the face with corona, flame or primer: ink does not stay on bare silicone.",
        "Print the PDF at 100 % in black, no scaling to the page, and measure its scale bar; then "
        "print on the gel in the template.",
        "Spray the coat (above) over the dots.",
    ),
    "stencil": (
        "Send the Gerber files to a stencil maker (0.1 mm foil, laser-cut, no frame), or cut "
        "`markers/stencil.dxf` from 0.1 mm film.",
        "Lay it on the dowel pins of the cutting template over the gel, draw black silicone ink "
        "over it once, lift it straight up, let it cure.",
        "Measure ten pitches, then spray the coat (above) over the dots.",
    ),
}
