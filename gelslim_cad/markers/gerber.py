"""The marker print as Gerber X2, for a stencil maker or a photoplotter.

Written from the Gerber layer format specification (Ucamco, revision 2024): millimetres, six
decimals, one flash per dot with a round aperture per diameter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.layout import check_inside, decimal
from gelslim_cad.markers.outline import Outline, arc_centre
from gelslim_cad.markers.stencil import PIN_MM, StencilSheet
from gelslim_core import __version__
from ifem_export.markers.grid import MarkerGrid

_PROFILE_MM = 0.05
_GREATEST_MM = 9999.0


def render_gerber(grid: MarkerGrid, gel_outline: Outline) -> bytes:
    """Return the paste layer: one flash per dot, in the sensor frame (outside view).

    Raises ValueError when a dot crosses the outline.
    """
    check_inside(grid, gel_outline)
    return _flashes("Paste,Top", grid.positions_mm, grid.diameter_mm)


def render_gerber_profile(outline: Outline) -> bytes:
    """Return the profile layer: the gel's outline as one closed path, arcs as arcs."""
    body = ["%TA.AperFunction,Profile*%", f"%ADD10C,{decimal(_PROFILE_MM, 6)}*%", "%TD*%"]
    body += ["D10*", f"{_xy(outline.points_mm[0])}D02*"]
    ends = np.roll(outline.points_mm, -1, axis=0)
    for start, end, bulge in zip(outline.points_mm, ends, outline.bulges, strict=True):
        if bulge == 0:
            body += ["G01*", f"{_xy(end)}D01*"]
            continue
        to_centre = arc_centre(start, end, float(bulge)) - start
        body.append("G03*" if bulge > 0 else "G02*")
        body.append(f"{_xy(end)}I{_integer(to_centre[0])}J{_integer(to_centre[1])}D01*")
    return _file("Profile,NP", body)


def render_gerber_alignment(sheet: StencilSheet) -> bytes:
    """Return the stencil's alignment holes as flashes, to add to the stencil order."""
    holes = sheet.alignment_mm
    return _flashes("Other,Alignment", holes, np.full(len(holes), PIN_MM))


def _flashes(
    function: str, centres_mm: NDArray[np.float64], diameter_mm: NDArray[np.float64]
) -> bytes:
    sizes, which = np.unique(np.round(diameter_mm, 6), return_inverse=True)
    body = [f"%ADD{10 + i}C,{decimal(size, 6)}*%" for i, size in enumerate(sizes)]
    for i in range(len(sizes)):
        body.append(f"D{10 + i}*")
        body += [f"{_xy(point)}D03*" for point in centres_mm[which == i]]
    return _file(function, body)


def _file(function: str, body: list[str]) -> bytes:
    head = [
        f"%TF.GenerationSoftware,gelslim-cad,gelslim-cad,{__version__}*%",
        "%TF.SameCoordinates,sensor frame*%",
        f"%TF.FileFunction,{function}*%",
        "%TF.FilePolarity,Positive*%",
        "G04 Outside view of the gel: x to the tip of the finger, y across, origin at its centre*",
        "%FSLAX46Y46*%",
        "%MOMM*%",
        "G75*",
        "G01*",
        "%LPD*%",
    ]
    return ("\n".join([*head, *body, "M02*"]) + "\n").encode("ascii")


def _integer(value_mm: float) -> str:
    if not abs(value_mm) < _GREATEST_MM:
        raise ValueError(
            f"Gerber coordinate {value_mm:g} mm is beyond the format's {_GREATEST_MM:g} mm"
        )
    return str(round(float(value_mm) * 1e6))


def _xy(point_mm: NDArray[np.float64]) -> str:
    return f"X{_integer(point_mm[0])}Y{_integer(point_mm[1])}"
