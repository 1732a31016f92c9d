"""What a calibration found, in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_core.uncertainty import with_sigma
from gelslim_force.calibration.camera_deviation import PARAMETERS

if TYPE_CHECKING:
    from gelslim_force.calibration.built_deviation import BuiltDeviation
    from gelslim_force.calibration.residual_bump import ResidualField
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_WORDS = {
    "rotation_x_deg": ("rotation about x", "°"),
    "rotation_y_deg": ("rotation about y", "°"),
    "rotation_z_deg": ("rotation about z, print included", "°"),
    "shift_x_mm": ("shift along x, print included", " mm"),
    "shift_y_mm": ("shift along y, print included", " mm"),
    "shift_z_mm": ("shift along z", " mm"),
    "focal_percent": ("focal length", " %"),
    "k1": ("distortion k1", ""),
    "k2": ("distortion k2", ""),
    "p1": ("distortion p1", ""),
    "p2": ("distortion p2", ""),
    "principal_x_px": ("lens axis from the picture's middle, along its rows", " px"),
    "principal_y_px": ("lens axis from the picture's middle, along its columns", " px"),
}
_MOST_IDS = 12
_LEAST_PART = 0.3
_LARGE_RATIO = 2.5
_LARGE_BUMP_MM = 0.01
_LARGE_NOISE_PX = 0.5


def diagnosis_lines(
    deviation: BuiltDeviation,
    grid: MarkerGrid,
    found: NDArray[np.int64],
    missing: NDArray[np.int64],
    unused: NDArray[np.int64],
    in_view: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Sentences on markers, camera, residuals, and what one picture cannot determine.

    `found`, `missing` and `unused` are marker ids: seen; in view but not seen; seen but not used in
    the fit, because they are doubtful or outliers. `in_view` (m,) are the markers that the built
    camera sees without a cut.
    """
    d = deviation
    lines = [
        f"{len(found)} of {len(grid)} markers found, {int(in_view.sum())} are in view; missing "
        f"there: {_ids(missing)}; not used in the fit: {_ids(unused)}.",
        f"Relative to the design the camera is rotated by {d.rotation_deg:.2f}° and shifted by "
        f"{d.shift_mm:.2f} mm; the picture's scale differs by {d.scale_percent:+.2f} %, its "
        f"distortion by up to {d.distortion_px:.2f} px; the median dot is {d.moved_px:.1f} px from "
        "where the design has it.",
    ]
    for name, value, sigma, usual in zip(PARAMETERS, d.values, d.sigma, d.tolerance, strict=True):
        words, unit = _WORDS[name]
        lines.append(
            f"{words}: {with_sigma(value, sigma)}{unit} "
            f"({abs(value) / usual:.1f} of its tolerance {usual:g}{unit})"
        )
    lines.append(
        f"The noise of a dot is {d.noise_px:.3f} px per axis ({d.own_mm * 1000:.1f} µm on the gel, "
        "from detection and print); neighbouring dots have a displacement of "
        f"{d.shared_mm * 1000:.1f} µm in common."
    )
    lines.append(
        f"The fit leaves positions on the gel uncertain by {d.map_sigma_mm * 1000:.2f} µm, and the "
        f"apparent lateral motion of a marker pressed in by 1 mm by "
        f"{d.lean_sigma_mm_per_mm * 1000:.2f} µm."
    )
    lines.append(_weak_line(d))
    lines.append(
        "The scale of the print and the thickness of the layers are taken as designed; a shift or "
        "rotation of the print on the gel is attributed to the camera."
    )
    return tuple(lines)


def warning_lines(
    deviation: BuiltDeviation,
    residuals: ResidualField,
    grid: MarkerGrid,
    missing: NDArray[np.int64],
    unused: NDArray[np.int64],
    in_view: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Sentences on what should be looked at before the calibration is trusted."""
    lines = []
    if len(missing) > 0.05 * in_view.sum():
        lines.append(
            f"{len(missing)} of {int(in_view.sum())} markers in view are missing: clean the gel "
            "or check the light"
        )
    if not in_view.all():
        lines.append(f"{int((~in_view).sum())} markers are outside the picture or cut by its edge")
    if len(unused) > 0.05 * len(grid):
        lines.append(
            f"{len(unused)} markers are doubtful or too far from the print to be used in the fit: "
            "dirt, or a poor print"
        )
    for name, ratio in zip(PARAMETERS, deviation.values / deviation.tolerance, strict=True):
        if abs(ratio) > _LARGE_RATIO:
            lines.append(f"{_WORDS[name][0]} is off by {abs(ratio):.1f} times its tolerance")
    if deviation.noise_px > _LARGE_NOISE_PX:
        lines.append(
            f"the noise of the dots is {deviation.noise_px:.2f} px: a poor print, or a picture out "
            "of focus"
        )
    bump = residuals.bump
    if bump is not None and bump.significant and bump.shift_mm > _LARGE_BUMP_MM:
        lines.append(
            f"near x = {bump.x_mm:.1f}, y = {bump.y_mm:.1f} mm the dots are displaced by "
            f"{bump.shift_mm * 1000:.0f} µm together: a light touch, a warped print, or a lens "
            "that the model of distortion does not describe"
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
    listed = ", ".join(str(k) for k in ids[:_MOST_IDS])
    return f"{len(ids)} ({listed}{', …' if len(ids) > _MOST_IDS else ''})"


def _weak_line(deviation: BuiltDeviation) -> str:
    if not deviation.weak:
        return "The picture determines every deviation better than the tolerances do."
    lines = []
    for left, direction in deviation.weak:
        parts = [
            f"{_WORDS[name][0].removesuffix(', print included')} {share * usual:+.2g}"
            f"{_WORDS[name][1]}"
            for name, share, usual in zip(PARAMETERS, direction, deviation.tolerance, strict=True)
            if abs(share) >= _LEAST_PART
        ]
        lines.append(f"{' with '.join(parts)} ({left:.0%} of the prior variance remains)")
    return (
        "The picture hardly distinguishes these, the tolerances decide: " + "; ".join(lines) + "."
    )
