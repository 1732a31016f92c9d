"""The marker print as Gerber X2, for a stencil maker or a photoplotter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.gerber_file import (
    GerberObject,
    circle,
    gerber_file,
    integer,
    object_lines,
    xy,
)
from gelslim_cad.markers.layout import check_inside, decimal
from gelslim_cad.markers.outline import Outline, arc_centre
from gelslim_cad.markers.stencil import PIN_MM, StencilSheet
from ifem_export.markers.grid import MarkerGrid

_PROFILE_MM = 0.05


def render_gerber(grid: MarkerGrid, gel_outline: Outline) -> bytes:
    """Return the paste layer: one flash per dot, in the sensor frame (outside view).

    Raises ValueError when a dot crosses the outline.
    """
    check_inside(grid, gel_outline)
    return _flashes("Paste,Top", grid.positions_mm, grid.diameter_mm)


def render_gerber_profile(outline: Outline) -> bytes:
    """Return the profile layer: the gel's outline as one closed path, arcs as arcs."""
    body = ["%TA.AperFunction,Profile*%", f"%ADD10C,{decimal(_PROFILE_MM, 6)}*%", "%TD*%"]
    body += ["D10*", f"{xy(outline.points_mm[0])}D02*"]
    ends = np.roll(outline.points_mm, -1, axis=0)
    for start, end, bulge in zip(outline.points_mm, ends, outline.bulges, strict=True):
        if bulge == 0:
            body += ["G01*", f"{xy(end)}D01*"]
            continue
        to_centre = arc_centre(start, end, float(bulge)) - start
        body.append("G03*" if bulge > 0 else "G02*")
        body.append(f"{xy(end)}I{integer(to_centre[0])}J{integer(to_centre[1])}D01*")
    return _file("Profile,NP", body)


def render_gerber_alignment(sheet: StencilSheet) -> bytes:
    """Return the stencil's alignment holes as flashes, to add to the stencil order."""
    holes = sheet.alignment_mm
    return _flashes("Other,Alignment", holes, np.full(len(holes), PIN_MM), "Other,Alignment hole")


def _flashes(
    function: str,
    centres_mm: NDArray[np.float64],
    diameter_mm: NDArray[np.float64],
    use: str = "Material",
) -> bytes:
    sizes, which = np.unique(np.round(diameter_mm, 6), return_inverse=True)
    dots = [
        GerberObject(circle(float(size), use), (point,))
        for i, size in enumerate(sizes)
        for point in centres_mm[which == i]
    ]
    return _file(function, object_lines(dots))


def _file(function: str, body: list[str]) -> bytes:
    return gerber_file(
        function,
        body,
        project="marker print",
        frame="sensor frame",
        comment="Outside view of the gel: x to the tip of the finger, y across, origin at its "
        "centre",
        part="Other,Marker print",
    )
