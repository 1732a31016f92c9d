"""Layout of a sheet around the dots: crosses, scale bar, arrow, notes; numbers as text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

CROSS_ARM_MM = 2.0
"""Half the length of a registration cross."""
CROSS_DISTANCE_MM = 4.0
"""Distance of a cross from the gel's bounding box, along x and along y."""
SCALE_BAR_MM = 10.0


@dataclass(frozen=True)
class SheetLayout:
    """A drawing around the gel, in the frame of the view (x to the tip, y up), in mm."""

    dots_mm: NDArray[np.float64]
    """(m, 2) dot centres as drawn."""
    outline: Outline
    crosses_mm: NDArray[np.float64]
    """(4, 2) registration crosses outside the gel's corners."""
    arrow_mm: NDArray[np.float64]
    """(7, 2) closed arrow that points to the tip."""
    box_mm: tuple[float, float, float, float]
    """(x least, y least, x greatest, y greatest) of gel and crosses."""
    mirrored: bool

    @property
    def view(self) -> str:
        """Say from which side of the gel the drawing is seen."""
        return "inside view (mirrored)" if self.mirrored else "outside view"


def lay_out(grid: MarkerGrid, outline: Outline, *, mirrored: bool = False) -> SheetLayout:
    """Return the layout as seen from outside the gel, or mirrored as seen from inside.

    From outside the viewer looks against z: x points right and y up. From inside y points down.
    Raises ValueError when a dot reaches beyond the outline.
    """
    check_inside(grid, outline)
    sign = np.array([1.0, -1.0 if mirrored else 1.0])
    drawn = outline.mirrored() if mirrored else outline
    x0, y0, x1, y1 = drawn.bounds_mm
    gap = CROSS_DISTANCE_MM
    crosses = np.array(
        [(x0 - gap, y0 - gap), (x1 + gap, y0 - gap), (x1 + gap, y1 + gap), (x0 - gap, y1 + gap)]
    )
    reach = gap + CROSS_ARM_MM
    return SheetLayout(
        dots_mm=grid.positions_mm * sign,
        outline=drawn,
        crosses_mm=crosses,
        arrow_mm=tip_arrow((x1 + 2.0, (y0 + y1) / 2)),
        box_mm=(x0 - reach, y0 - reach, x1 + reach, y1 + reach),
        mirrored=mirrored,
    )


def tip_arrow(
    tail_mm: tuple[float, float], length_mm: float = 4.0, width_mm: float = 1.8
) -> NDArray[np.float64]:
    """Return the closed outline (7, 2) of an arrow along +x that starts at `tail_mm`."""
    shaft, neck, half = 0.2 * width_mm / 2, 0.55 * length_mm, width_mm / 2
    shape = [(0, -shaft), (neck, -shaft), (neck, -half), (length_mm, 0)]
    shape += [(neck, half), (neck, shaft), (0, shaft)]
    return np.array(shape, dtype=np.float64) + tail_mm


def check_inside(grid: MarkerGrid, outline: Outline) -> None:
    """Raise ValueError when a dot crosses the outline, and say how many do."""
    try:
        lost = len(grid) - len(grid.clipped(outline.contains))
    except ValueError:
        lost = len(grid)
    if lost:
        raise ValueError(
            f"{lost} of {len(grid)} marker dots cross the gel outline; clip the grid with "
            "MarkerGrid.clipped, or use a smaller pitch or a larger gel"
        )


def notes(grid: MarkerGrid, layout: SheetLayout) -> list[str]:
    """Return the lines of text that go with a drawing: view and scale, count, sizes, anchors."""
    rows, columns = grid.lattice_shape
    sizes = " and ".join(decimal(d, 3) for d in np.unique(np.round(grid.diameter_mm, 6)))
    lines = [
        f"{layout.view[0].upper()}{layout.view[1:]}, scale 1:1",
        f"{len(grid)} dots, lattice {rows} x {columns} (along, across)",
        f"pitch {decimal(grid.pitch_mm)} mm, diameter {sizes} mm",
    ]
    if layout.mirrored:
        lines.append("for transfer film, or to print from the inside")
    large = int(np.sum(grid.kind == ANCHOR_LARGE))
    if large:
        lines.append(f"{large} larger dots are anchors")
    if len(grid.omitted):
        lines.append(f"{len(grid.omitted)} sites left empty are anchors")
    return lines


def decimal(value: float, places: int = 4) -> str:
    """Return `value` rounded to `places`, without trailing zeros, exponent or minus zero."""
    text = f"{float(value):.{places}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
