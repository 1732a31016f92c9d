"""Marker stencil: a thin sheet with a hole for every dot, on four alignment pins.

.---------------.
| o           o |     o  alignment holes, one displaced: fits one way only
|   · · · · ·   |
|   · · · · ·   |
| o         o   |
'---------------'
"""

from __future__ import annotations

from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.stencil import StencilSheet
from gelslim_cad.solids.prism import prism
from gelslim_cad.solids.shapes import SolidError
from ifem_export.markers.grid import MarkerGrid

THICKNESS_MM = 0.1
LEAST_WEB_MM = 0.05
MOST_HOLES = 2000
"""With more holes the check of the solid takes minutes, as it compares every pair of holes."""
FILM = (0.75, 0.75, 0.80, 0.9)


def stencil_problem(grid: MarkerGrid) -> str:
    """Reason why no stencil can be cut for the grid; empty when one can."""
    if grid.smallest_gap_mm < LEAST_WEB_MM:
        return (
            f"only {grid.smallest_gap_mm:.3f} mm of film would stay between two dots, at least "
            f"{LEAST_WEB_MM:g} mm are needed; use a larger markers.pitch_mm or smaller dots"
        )
    if len(grid) > MOST_HOLES:
        return (
            f"{len(grid)} holes are more than a stencil of {MOST_HOLES} takes; "
            "use a larger markers.pitch_mm, or print the dots"
        )
    return ""


def stencil(sheet: StencilSheet, grid: MarkerGrid) -> Part:
    """The stencil of the layout that the DXF is drawn from; see `markers.lay_out_stencil`.

    Raises SolidError where `stencil_problem` names a reason.
    """
    problem = stencil_problem(grid)
    if problem:
        raise SolidError(f"marker_stencil: {problem}")
    pins = [(x, y, sheet.alignment_diameter_mm) for x, y in sheet.alignment_mm.tolist()]
    dots = zip(*sheet.holes_mm.T.tolist(), sheet.hole_diameter_mm.tolist(), strict=True)
    return Part(
        name="marker_stencil",
        # The solid is not checked: that takes a second, and separate circles are always valid.
        solid=prism(sheet.sheet, (0.0, THICKNESS_MM), [*pins, *dots]),
        material="polyester film",
        process="laser",
        colour=FILM,
        in_assembly=False,
        note=f"{len(grid)} holes in {THICKNESS_MM:g} mm film; seen from outside the gel",
        tags=frozenset({"tooling"}),
    )
