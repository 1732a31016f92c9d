"""How far the bezel really compresses the shims: a plate on an elastic foundation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.elastic import ACRYLIC, bezel_elastic, strip_modulus_mpa_per_mm
from gelslim_cad.geometry.fasteners import SCREW_EDGE_MM, SCREWS
from gelslim_cad.geometry.frame_plate import Deflection, FramePlate, Strip, Support, deflect

SOURCE = "docs/physics.md#pre-compression"
WINDOW_GAP_MM = 0.3
"""Gap between the gel and the bezel's opening."""
SHIM_GAP_MM = 0.3
"""What the shims are shorter than the window's flat part, on each side."""
WINDOW_SHARE = 0.35
"""Width of the window that bends with a loaded end, over its span: 0.35 covers the peak at the
edge, as finite elements of plates show."""


@dimension(
    "shim.foundation_mpa_per_mm",
    formula="E_c / h (1 + λ + λ²) / (3 λ²), E_c = 4/3 E (1 + φ S²), S = width / 2h, λ = 1 - δ/h",
    source=SOURCE,
)
def shim_foundation_mpa_per_mm(
    housing_shim_hardness_shore_a: Real,
    housing_shim_thickness_mm: Real,
    light_guide_end_support_mm: Real,
    housing_precompression_mm: Real,
) -> Real:
    """Pressure of a shim per compression, at the compression that is wanted."""
    return strip_modulus_mpa_per_mm(
        housing_shim_hardness_shore_a,
        housing_shim_thickness_mm,
        light_guide_end_support_mm,
        housing_precompression_mm,
    )


FRAME = (
    "bezel.proximal_x_mm",
    "finger.tip_x_mm",
    "finger.width_mm",
    "bezel.thickness_mm",
    "design.gel.length_mm",
    "design.gel.width_mm",
    "design.housing.bezel_material",
    "manufacturing.print_process",
    "design.housing.tip_wall_mm",
    "design.housing.side_wall_mm",
    "design.housing.screw",
    "guide.proximal_end_x_mm",
    "ledge.edge_x_mm",
    "ledge.distal_x_mm",
    "guide.distal_end_x_mm",
    "guide.flat_width_mm",
    "shim.foundation_mpa_per_mm",
)


@dimension(
    "bezel.frame",
    formula="Ritz method: bending of the frame, springs of the shims, screws hold it",
    source=SOURCE,
    internal=True,
    inputs=FRAME,
)
def bezel_frame(values: Mapping[str, Any]) -> Deflection:
    """Compression of the shims under the bezel, per mm of what a rigid one would compress."""
    words = {name: values[name] for name in FRAME if isinstance(values[name], str)}
    numbers = [name for name in FRAME if name not in words]
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values[n], float)) for n in numbers))
    v = dict(zip(numbers, arrays, strict=True))
    data = bezel_elastic(
        words["design.housing.bezel_material"], words["manufacturing.print_process"]
    )
    size = SCREWS[words["design.housing.screw"]]
    thickness = np.maximum(v["bezel.thickness_mm"], 1e-3)
    half_gel = v["design.gel.length_mm"] / 2 + WINDOW_GAP_MM
    start, end = v["bezel.proximal_x_mm"], v["finger.tip_x_mm"]
    half_width = v["finger.width_mm"] / 2
    plate = FramePlate(
        start_x=start,
        end_x=end,
        half_width=half_width,
        open_x=(-half_gel, half_gel),
        open_half_width=v["design.gel.width_mm"] / 2 + WINDOW_GAP_MM,
        thickness=thickness,
        youngs_modulus=np.full_like(thickness, data.youngs_modulus_mpa),
        poisson=np.full_like(thickness, data.poissons_ratio),
    )
    across = half_width - v["design.housing.side_wall_mm"] - SCREW_EDGE_MM
    inset = v["design.housing.tip_wall_mm"] / 2
    ring = np.full_like(thickness, (size.countersunk_head_mm + size.clearance_mm) / 4)
    strips = tuple(
        _strip(v, low, high)
        for low, high in (
            (v["guide.proximal_end_x_mm"], np.minimum(v["ledge.edge_x_mm"], -half_gel)),
            (np.maximum(v["ledge.distal_x_mm"], half_gel), v["guide.distal_end_x_mm"]),
        )
    )
    supports = (Support(start + inset, across, ring), Support(end - inset, across, ring))
    return deflect(plate, strips, supports)


def _strip(v: Mapping[str, Any], low: Any, high: Any) -> Strip:
    """The springs of one shim, under the part of it that the bezel covers."""
    half = v["guide.flat_width_mm"] / 2 - SHIM_GAP_MM
    return Strip((low, np.maximum(high, low + 0.1)), half, v["shim.foundation_mpa_per_mm"])


@dimension("shim.least_reached_mm", formula="precompression · least share that the frame leaves")
def shim_least_reached_mm(housing_precompression_mm: Real, bezel_frame: Deflection) -> Real:
    """Compression of the shims where the bezel bows most."""
    return housing_precompression_mm * bezel_frame.least


@dimension("shim.mean_reached_mm", formula="precompression · mean share that the frame leaves")
def shim_mean_reached_mm(housing_precompression_mm: Real, bezel_frame: Deflection) -> Real:
    """Mean compression of the shims."""
    return housing_precompression_mm * bezel_frame.mean


@dimension("bezel.bow_mm", formula="precompression · largest deflection of the frame")
def bezel_bow_mm(housing_precompression_mm: Real, bezel_frame: Deflection) -> Real:
    """How far the bezel bows outwards."""
    return housing_precompression_mm * bezel_frame.bow


@dimension("shim.force_n", formula="area · foundation · mean compression, both shims")
def shim_force_n(housing_precompression_mm: Real, bezel_frame: Deflection) -> Real:
    """Force of both shims on the acrylic, which the screws of the bezel carry."""
    return housing_precompression_mm * bezel_frame.force_n


@dimension(
    "precompression.stack_mm",
    formula="acrylic + print + shim; acrylic 0.4 mm + ratio · t as bought, or as it is measured",
    source=SOURCE,
)
def precompression_stack_mm(
    tolerance_acrylic: str,
    tolerance_acrylic_sheet_mm: Real,
    tolerance_acrylic_measured_mm: Real,
    manufacturing_acrylic_tolerance_ratio: Real,
    light_guide_thickness_mm: Real,
    manufacturing_print_tolerance_mm: Real,
    tolerance_shim_mm: Real,
) -> Real:
    """Pre-compression that a thin sheet, a deep ledge and a thin shim may take away together."""
    bought = (
        tolerance_acrylic_sheet_mm
        + manufacturing_acrylic_tolerance_ratio * light_guide_thickness_mm
    )
    acrylic = tolerance_acrylic_measured_mm if tolerance_acrylic == "measured" else bought
    return acrylic + manufacturing_print_tolerance_mm + tolerance_shim_mm


@dimension(
    "window.pressure_mpa", formula="foundation · mean compression of the shims", source=SOURCE
)
def window_pressure_mpa(shim_foundation_mpa_per_mm: Real, shim_mean_reached_mm: Real) -> Real:
    """Pressure between bezel, acrylic and shims."""
    return shim_foundation_mpa_per_mm * shim_mean_reached_mm


@dimension(
    "window.stress_mpa",
    formula="min(6 q c² / 8 / (b t²), 4.8 E t bow / c²)",
    source=SOURCE,
)
def window_stress_mpa(
    shim_force_n: Real,
    bezel_bow_mm: Real,
    guide_flat_width_mm: Real,
    guide_length_mm: Real,
    light_guide_thickness_mm: Real,
) -> Real:
    """Bending stress in the acrylic, the lesser of two upper bounds.

    A bezel that bows leaves the window between the corners of its flat part, whose width is c.
    Each end of the window then carries half of the force as a beam, of the width b at most; and it
    bows by no more than the bezel, 5 q c⁴ / (384 E I).
    """
    load = shim_force_n / 2 / guide_flat_width_mm
    moment = load * guide_flat_width_mm**2 / 8
    width = np.minimum(guide_length_mm / 2, WINDOW_SHARE * guide_flat_width_mm)
    by_force = 6 * moment / (width * light_guide_thickness_mm**2)
    bent = ACRYLIC.youngs_modulus_mpa * light_guide_thickness_mm * bezel_bow_mm
    return np.minimum(by_force, 4.8 * bent / guide_flat_width_mm**2)
