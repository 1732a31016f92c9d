"""A first patch from the outline of what changed in the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from gelslim_force.contact.indenter import Flat, Indenter
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_outline import fit_circle, fit_strip
from gelslim_force.contact.patch_place import flat_patch, strip_covariance, strip_patch
from gelslim_force.contact.patch_settings import PatchSettings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FEWEST = 6
"""Points of an outline that tell its shape."""


def region_patch(
    region: Mask,
    on_pad: Mask,
    x_mm: Array,
    y_mm: Array,
    indenter: Indenter | None,
    settings: PatchSettings,
) -> ContactPatch | None:
    """Patch of a region's outline, from the part that the pad's edge does not cut.

    Args:
        region: (rows, columns) bins whose light changed.
        on_pad: (rows, columns) bins on the pad.
        x_mm: (rows, columns) places of the bins on the gel.
        y_mm: likewise.
        indenter: says what the patch looks like; a disc where it is None.
        settings: for the error of a size that rests on an outline.

    Returns:
        The patch with its covariance; None where the outline tells none.
    """
    closed = ndimage.binary_closing(np.pad(region, 3), iterations=3)[3:-3, 3:-3]
    filled = ndimage.binary_fill_holes(closed | region)
    rim = filled & ~ndimage.binary_erosion(filled, border_value=1)
    # Where the pad or the picture ends, the region's end is not the patch's.
    rim &= ndimage.binary_erosion(on_pad, iterations=2, border_value=0)
    points = np.column_stack([x_mm[rim], y_mm[rim]])
    inside = np.column_stack([x_mm[filled], y_mm[filled]])
    if len(points) < FEWEST:
        return None
    if isinstance(indenter, Flat):
        return flat_patch(indenter, points, inside)
    covariance = np.zeros((4, 4))
    try:
        if indenter is not None and indenter.patch_kind == "strip":
            (offset, half, angle), found = fit_strip(points)
            axis = getattr(indenter, "axis_deg", None)
            angle = angle if axis is None else float(np.deg2rad(axis))
            patch = strip_patch(offset, half, angle, inside.mean(axis=0))
            covariance[:] = strip_covariance(found, angle)
        else:
            (x, y, half), found = fit_circle(points)
            patch = ContactPatch("disc", np.array([x, y]), float(half))
            covariance[:3, :3] = found
    except (ValueError, np.linalg.LinAlgError):
        return None
    if not (np.isfinite(half) and half < 1.2 * np.ptp(inside, axis=0).max()):
        return None
    spread = (settings.outline_error * float(half)) ** 2
    covariance[2, 2] += spread
    covariance[:2, :2] += np.eye(2) * spread / 4
    return replace(patch, covariance=covariance, method="outline")
