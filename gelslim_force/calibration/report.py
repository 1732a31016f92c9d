"""What a calibration found, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.camera_deviation import PARAMETERS

if TYPE_CHECKING:
    from gelslim_force.calibration.built_deviation import BuiltDeviation
    from gelslim_force.calibration.residual_bump import ResidualField
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_WORDS = {
    "rotation_x_deg": ("rotation about x", "°", 2),
    "rotation_y_deg": ("rotation about y", "°", 2),
    "rotation_z_deg": ("rotation about z, print included", "°", 2),
    "shift_x_mm": ("shift along x, print included", " mm", 3),
    "shift_y_mm": ("shift along y, print included", " mm", 3),
    "shift_z_mm": ("shift along z", " mm", 3),
    "focal_percent": ("focal length", " %", 2),
    "k1": ("distortion k1", "", 4),
    "k2": ("distortion k2", "", 4),
    "p1": ("distortion p1", "", 5),
    "p2": ("distortion p2", "", 5),
    "principal_x_px": ("lens off the picture's middle, along its rows", " px", 1),
    "principal_y_px": ("lens off the picture's middle, along its columns", " px", 1),
}
_LISTED = 12
_PART = 0.3
_ODD_SIGMAS = 2.5
_WARPED_MM = 0.01
_RESTLESS_PX = 0.5


def diagnosis_lines(
    deviation: BuiltDeviation,
    grid: MarkerGrid,
    found: NDArray[np.int64],
    missing: NDArray[np.int64],
    aside: NDArray[np.int64],
    in_view: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Lines for people: markers, camera, what is left over and what one picture cannot tell.

    `found`, `missing` and `aside` are marker ids: seen, in view but not seen, seen but not fitted
    by (doubtful or too far off). `in_view` (m,) are the markers the built camera sees whole.
    """
    d = deviation
    lines = [
        f"{len(found)} of {len(grid)} markers found, {int(in_view.sum())} are in view; missing "
        f"there: {_ids(missing)}; not fitted by: {_ids(aside)}.",
        f"Against the design the camera is turned by {d.rotation_deg:.2f}° and shifted by "
        f"{d.shift_mm:.2f} mm; the picture's scale differs by {d.scale_percent:+.2f} %, its "
        f"distortion by up to {d.distortion_px:.2f} px; dots lie {d.moved_px:.1f} px from where "
        "the design would have them (median).",
    ]
    for name, value, sigma, usual in zip(PARAMETERS, d.values, d.sigma, d.tolerance, strict=True):
        words, unit, places = _WORDS[name]
        lines.append(
            f"{words}: {value:+.{places}f} ± {sigma:.{places}f}{unit} "
            f"({abs(value) / usual:.1f} of its tolerance {usual:g}{unit})"
        )
    lines.append(
        f"A dot is off by {d.noise_px:.3f} px on each axis ({d.own_mm * 1000:.1f} µm on the gel, "
        f"detection and print together); neighbours share {d.shared_mm * 1000:.1f} µm."
    )
    lines.append(
        f"The fit leaves places on the gel uncertain by {d.map_sigma_mm * 1000:.2f} µm, and the "
        f"sideways motion that a press of 1 mm seems to make by "
        f"{d.lean_sigma_mm_per_mm * 1000:.2f} µm."
    )
    lines.append(_weak_line(d))
    lines.append(
        "The scale of the print and the thickness of the layers are taken as designed; a shift or "
        "turn of the print on the gel counts as the camera's."
    )
    return tuple(lines)


def warning_lines(
    deviation: BuiltDeviation,
    residuals: ResidualField,
    grid: MarkerGrid,
    missing: NDArray[np.int64],
    aside: NDArray[np.int64],
    in_view: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Return what deserves a look before the calibration is trusted."""
    lines = []
    if len(missing) > 0.05 * in_view.sum():
        lines.append(
            f"{len(missing)} of {int(in_view.sum())} markers in view are missing: clean the gel "
            "or look at the light"
        )
    if not in_view.all():
        lines.append(f"{int((~in_view).sum())} markers lie outside the picture or are cut by it")
    if len(aside) > 0.05 * len(grid):
        lines.append(
            f"{len(aside)} markers are doubtful or too far from the print to fit by: dirt, or a "
            "poor print"
        )
    for name, ratio in zip(PARAMETERS, deviation.values / deviation.tolerance, strict=True):
        if abs(ratio) > _ODD_SIGMAS:
            lines.append(f"{_WORDS[name][0]} is off by {abs(ratio):.1f} times its tolerance")
    if deviation.noise_px > _RESTLESS_PX:
        lines.append(
            f"dots scatter by {deviation.noise_px:.2f} px: a poor print, or a picture out of focus"
        )
    bump = residuals.bump
    if bump is not None and bump.significant and bump.shift_mm > _WARPED_MM:
        lines.append(
            f"near x = {bump.x_mm:.1f}, y = {bump.y_mm:.1f} mm the dots are off by "
            f"{bump.shift_mm * 1000:.0f} µm together: a light touch, a warped print, or a lens "
            "that the distortion's terms do not describe"
        )
    if len(grid.anchor_sites) == 0:
        lines.append(
            "the print has no anchors: a shift by one pitch or a mirrored picture of a symmetric "
            "print would go unnoticed"
        )
    return tuple(lines)


def _ids(ids: NDArray[np.int64]) -> str:
    if not len(ids):
        return "none"
    listed = ", ".join(str(k) for k in ids[:_LISTED])
    return f"{len(ids)} ({listed}{', …' if len(ids) > _LISTED else ''})"


def _weak_line(deviation: BuiltDeviation) -> str:
    if not deviation.weak:
        return "The picture determines every deviation better than the tolerances do."
    told = []
    for left, direction in deviation.weak:
        parts = [
            f"{_WORDS[name][0].removesuffix(', print included')} {share * usual:+.2g}"
            f"{_WORDS[name][1]}"
            for name, share, usual in zip(PARAMETERS, direction, deviation.tolerance, strict=True)
            if abs(share) >= _PART
        ]
        told.append(f"{' with '.join(parts)} ({left:.0%} of the prior variance is left)")
    return "The picture hardly tells these apart, the tolerances decide: " + "; ".join(told) + "."
