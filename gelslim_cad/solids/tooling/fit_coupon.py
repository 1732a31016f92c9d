"""Fit coupon: it shows how the printer reproduces clearances, pilot holes and thin walls.

[ ]   [ ]   [ ]   [ ]   [ ]     slots for the gauge's tongue, clearance growing
 o     o     o     o     o      pilot holes for the housing's screw, -10 % ... +10 %
[__]  [__]  [__]  [__]  [__]    slots for the acrylic sheet, -10 % ... +10 %
 |     |     ||    ||    ||     walls standing up, growing
 .     ..    ...   ....  .....  dots count the step; 3 is nominal
"""

from __future__ import annotations

from dataclasses import dataclass

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.fasteners import SCREWS
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.materials import PRINTED
from gelslim_cad.solids.shapes import Hole, box, prism, rectangle, rounded_polygon, single, union

PLATE_MM = 3.0
TONGUE_MM = (8.0, 3.0)
CLEARANCE_STEPS = (0.5, 0.75, 1.0, 1.5, 2.0)
SCREW_STEPS = (0.90, 0.95, 1.0, 1.05, 1.10)
WALLS_MM = (0.4, 0.6, 0.8, 1.0, 1.2)
WALL_HEIGHT_MM = 5.0
SHEET_SLOT_MM = 10.0
DOT_MM = 1.2
DOT_PITCH_MM = 2.2
GAP_MM = 4.0
COUPON = (0.55, 0.42, 0.62, 1.0)


@dataclass(frozen=True)
class CouponPlan:
    """Sizes of each step, mm."""

    clearances: tuple[float, ...]
    """Gap on each side of the tongue."""
    pilots: tuple[float, ...]
    sheets: tuple[float, ...]
    """Widths of the slots for the acrylic."""

    @property
    def cell_mm(self) -> float:
        """Width of a step."""
        widest = max(TONGUE_MM[0] + 2 * max(self.clearances), SHEET_SLOT_MM, 5 * DOT_PITCH_MM)
        return widest + GAP_MM

    @property
    def rows_mm(self) -> tuple[float, float, float, float, float]:
        """Middles of the rows from the top: tongue, pilots, sheets, walls, dots."""
        heights = (
            TONGUE_MM[1] + 2 * max(self.clearances),
            max(self.pilots),
            max(self.sheets),
            max(WALLS_MM),
            DOT_MM,
        )
        middles, y = [], 0.0
        for height in heights:
            y -= GAP_MM + height / 2
            middles.append(y)
            y -= height / 2
        return middles[0], middles[1], middles[2], middles[3], middles[4]


def plan_coupon(d: Dimensions) -> CouponPlan:
    """Steps around the spec's clearance, screw and acrylic."""
    fit = float(d["design.housing.fit_clearance_mm"])
    pilot = SCREWS[d["design.housing.screw"]].pilot_mm
    sheet = float(d["design.light_guide.thickness_mm"])
    tolerance = max(float(d["manufacturing.acrylic_tolerance_ratio"]), 0.02)
    return CouponPlan(
        clearances=tuple(fit * s for s in CLEARANCE_STEPS),
        pilots=tuple(pilot * s for s in SCREW_STEPS),
        sheets=tuple(sheet * (1 + tolerance * s) for s in (-1, -0.5, 0, 0.5, 1)),
    )


def fit_coupon(d: Dimensions) -> tuple[Part, Part]:
    """The coupon and its gauge, both lying flat."""
    p = plan_coupon(d)
    tongue, pilot, sheet, wall, dots = p.rows_mm
    centres = [(k - 2) * p.cell_mm for k in range(5)]
    holes: list[Hole] = []
    windows: list[Outline] = []
    walls = []
    for k, x in enumerate(centres):
        c = p.clearances[k]
        windows.append(_slot(x, tongue, TONGUE_MM[0] + 2 * c, TONGUE_MM[1] + 2 * c))
        holes.append((x, pilot, p.pilots[k]))
        windows.append(_slot(x, sheet, SHEET_SLOT_MM, p.sheets[k]))
        half = WALLS_MM[k] / 2
        rise = (PLATE_MM - 1.0, PLATE_MM + WALL_HEIGHT_MM)
        walls.append(box((x - 4.0, x + 4.0), (wall - half, wall + half), rise))
        holes += [(x + (i - k / 2) * DOT_PITCH_MM, dots, DOT_MM) for i in range(k + 1)]
    reach = 2.5 * p.cell_mm
    plate = prism(
        rectangle((-reach, reach), (dots - DOT_MM / 2 - GAP_MM, 0.0), 2.0),
        (0.0, PLATE_MM),
        holes,
        windows,
    )
    material = PRINTED[d["manufacturing.print_process"]]
    return (
        _printed("fit_coupon", union([plate, *walls]), material, coupon_note(p)),
        _printed("fit_gauge", _gauge(), material, "tongue to try in the coupon's first row"),
    )


def _printed(name: str, shape: cq.Shape, material: str, note: str) -> Part:
    return Part(
        name=name,
        solid=single(shape, name),
        material=material,
        process="print",
        colour=COUPON,
        in_assembly=False,
        note=note,
        tags=frozenset({"tooling"}),
    )


def coupon_note(p: CouponPlan) -> str:
    """Explain the steps, which are marked with one to five dots."""

    def listed(values: tuple[float, ...]) -> str:
        return ", ".join(f"{v:.2f}" for v in values)

    return (
        f"steps 1 to 5 by dots: clearance per side {listed(p.clearances)}; pilot "
        f"{listed(p.pilots)}; acrylic {listed(p.sheets)}; walls {listed(WALLS_MM)} mm. Set "
        "housing.fit_clearance_mm to the tightest step that slides"
    )


def _slot(x: float, y: float, width: float, height: float) -> Outline:
    return rectangle((x - width / 2, x + width / 2), (y - height / 2, y + height / 2))


def _gauge() -> cq.Solid:
    half = TONGUE_MM[0] / 2
    outline = rounded_polygon(
        [(-half, 0), (half, 0), (half, 14), (12, 14), (12, 24), (-12, 24), (-12, 14), (-half, 14)],
        0.8,
    )
    return prism(outline, (0.0, TONGUE_MM[1]))
