"""Processes that put dots on the gel, with the smallest dots and gaps of each."""

from __future__ import annotations

from dataclasses import dataclass

STENCIL_FOIL_MM = 0.1
"""Thickness of the usual laser-cut steel foil."""
STENCIL_AREA_RATIO = 0.66
"""Least opening area over wall area for paste to leave a stencil (IPC-7525)."""


STENCIL_DOT_MM = 4.0 * STENCIL_AREA_RATIO * STENCIL_FOIL_MM
"""The smallest round opening that releases its ink or paste: a hole of diameter d in a foil of
thickness t has the area ratio (pi d²/4)/(pi d t) = d/(4t)."""


@dataclass(frozen=True)
class MarkingProcess:
    """A process that makes the dots; `min_gap_mm` is the distance between neighbouring rims."""

    name: str
    title: str
    min_diameter_mm: float
    min_gap_mm: float
    files: tuple[str, ...]
    """Which of the written files go to the machine or the supplier."""
    reason: str
    """Why the limits are what they are."""


_ALL = (
    MarkingProcess(
        name="laser_opened_paint",
        title="Paint opened by laser, filled with ink",
        min_diameter_mm=0.3,
        min_gap_mm=0.3,
        files=("markers.svg", "markers.dxf"),
        reason=(
            "A CO2 spot is 0.1 to 0.2 mm wide and the paint's edge lifts by about as much again; "
            "a smaller hole does not hold ink, and a narrower web of paint between two holes "
            "peels. Rule of thumb: run a test row on scrap gel before the first print."
        ),
    ),
    MarkingProcess(
        name="laser_etch",
        title="Laser etch of the surface",
        min_diameter_mm=0.25,
        min_gap_mm=0.25,
        files=("markers.svg", "markers.dxf"),
        reason=(
            "A spot is about 0.15 mm wide; a dot under one and a half spots is a blur and not a "
            "disc, and the heat reaches about half a spot past each rim, so closer dots run "
            "together. Rule of thumb: run a test row on scrap gel before the first print."
        ),
    ),
    MarkingProcess(
        name="uv_print",
        title="UV ink-jet print",
        min_diameter_mm=0.4,
        min_gap_mm=0.3,
        files=("markers.svg", "markers.pdf"),
        reason=(
            "At 600 dpi a pixel is 0.042 mm, and ink on silicone draws back or spreads by up to "
            "two pixels on each side: under 0.4 mm the diameter is no longer round and equal. "
            "Silicone needs corona, flame or primer first. Rule of thumb: print a test row."
        ),
    ),
    MarkingProcess(
        name="stencil",
        title="Stencil from Gerber",
        min_diameter_mm=round(STENCIL_DOT_MM, 3),
        min_gap_mm=0.2,
        files=("markers-F_Paste.gbr", "markers-Edge_Cuts.gbr", "markers-Alignment.gbr"),
        reason=(
            f"A round hole lets go of its ink when d/(4t) is at least {STENCIL_AREA_RATIO} "
            f"(IPC-7525), {STENCIL_DOT_MM:.3f} mm for a foil of {STENCIL_FOIL_MM} mm; "
            "webs under two foil thicknesses bend when the stencil is lifted or wiped."
        ),
    ),
)

MARKING_PROCESSES: dict[str, MarkingProcess] = {process.name: process for process in _ALL}
"""The known processes by name. Their limits are values to start from."""
