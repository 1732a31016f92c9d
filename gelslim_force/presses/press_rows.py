"""The data of one press as residuals over their deviations, with derivatives.

A press has four data of its own - load, size of the patch, and its place - and two for each marker
near it. Its unknowns are those that all presses share (`COMMON`) and its own: radius of contact,
place and friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.patch import ContactPatch
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_model import FRICTION, GEL, LOCAL, Expected, PressModel
from gelslim_force.presses.seen_press import PressView

Array = NDArray[np.float64]
YOUNG, THICKNESS, RATIO, BALL, SKIN, SIZE = range(6)
COMMON = 6
"""ln E, ln thickness, Poisson's ratio, ln ball, skin as in `press_model.skin_parameter`, and the
common relative error of all sizes."""
LAW_SIGMA = 0.01
"""Relative error of the force at a size: large strain and friction."""
MARKER_MM, MARKER_SHARE = 0.003, 0.02
"""Standard deviation of a marker's motion beyond the noise of the picture, and as a share of it."""
_HEADS = 4
_HEAD_LIMIT, _MARKER_LIMIT = 2.5, 4.0
"""Standard deviations beyond which load and size, and markers, count linearly."""


@dataclass(frozen=True, eq=False)
class Scatter:
    """Factors on the stated deviations of loads and sizes, and of markers."""

    load: float = 1.0
    marker: float = 1.0


@dataclass(frozen=True, eq=False)
class PressState:
    """Unknowns of one press: (3,) ln contact, x and y, and (t,) friction."""

    local: Array
    friction: Array


@dataclass(frozen=True, eq=False)
class PressRows:
    """Rows (n,) of one press: residual = what is left, over its deviation and weighted.

    Attributes:
        residual: (n,).
        by_common: (n, 6) derivative of what is expected by the common unknowns.
        by_own: (n, 3 + t) by those of the press.
        heads: (4,) residuals of load, size and place over their deviations, not weighted.
        markers: (m, 2) those of the markers.
    """

    residual: Array
    by_common: Array
    by_own: Array
    heads: Array
    markers: Array


def seen_patch(view: PressView, model: PressModel, found: Expected) -> ContactPatch:
    """The patch as seen, if its rim is at the height that is expected."""
    ball = view.ball_mm
    rim = ball - float(np.sqrt(max(ball**2 - found.rim_mm**2, 0.0)))
    return model.seen.patch.at_height(rim - found.depth_mm)


def marker_sigma_px(view: PressView, model: PressModel) -> Array:
    """(m, 1) standard deviation of the near markers."""
    px_per_mm = 1 / np.sqrt(np.abs(np.linalg.det(view.markers.mm_per_px[model.near])))
    own = np.hypot(model.seen.noise_px, MARKER_MM * px_per_mm)
    moved = np.hypot(*model.moved_px(view.markers).T)
    return np.asarray(np.hypot(own, MARKER_SHARE * moved)[:, None])


def press_rows(
    view: PressView,
    model: PressModel,
    load: Load,
    common: Array,
    own: PressState,
    scatter: Scatter,
) -> PressRows:
    """The rows of one press at common unknowns (6,) and its own."""
    here = model.linearised(common[1:SIZE], own.local, own.friction)
    heads, head_sigma = _heads(view, model, load, common, own, here.base, scatter)
    sigma = scatter.marker * marker_sigma_px(view, model)
    left = (model.moved_px(view.markers) - here.base.markers_px) / sigma
    head_weight = _weight(heads, _HEAD_LIMIT)
    head_scale = head_weight / head_sigma
    marker_weight = _weight(left, _MARKER_LIMIT)
    count = len(own.friction)
    by_size = here.rim_mm / here.base.rim_mm
    head_common, head_own = np.zeros((_HEADS, COMMON)), np.zeros((_HEADS, LOCAL + count))
    head_common[0, YOUNG], head_common[0, 1:SIZE] = 1.0, here.log_force[:GEL]
    head_common[1, 1:SIZE], head_common[1, SIZE] = by_size[:GEL], 1.0
    head_own[0], head_own[1] = here.log_force[GEL:], by_size[GEL:]
    head_own[2, 1] = head_own[3, 2] = 1.0
    by_markers = here.markers_px * (marker_weight / sigma)[..., None]
    marker_common = np.zeros((*left.shape, COMMON))
    marker_common[..., 1:SIZE] = by_markers[..., :GEL]
    marker_own = by_markers[..., GEL:]
    prior = np.column_stack([np.zeros((count, LOCAL)), np.eye(count)]) / FRICTION
    return PressRows(
        np.concatenate(
            [heads * head_weight, (left * marker_weight).ravel(),
             -own.friction / FRICTION]
        ),
        np.vstack([head_common * head_scale[:, None], marker_common.reshape(-1, COMMON),
                   np.zeros((count, COMMON))]),
        np.vstack([head_own * head_scale[:, None], marker_own.reshape(-1, LOCAL + count), prior]),
        heads,
        left,
    )  # fmt: skip


def _heads(
    view: PressView,
    model: PressModel,
    load: Load,
    common: Array,
    own: PressState,
    found: Expected,
    scatter: Scatter,
) -> tuple[Array, Array]:
    """(4,) residuals of load, size and place over their deviations, and (4,) these."""
    patch = seen_patch(view, model, found)
    load_sigma = scatter.load * np.hypot(load.sigma_n / load.load_n, LAW_SIGMA)
    place = np.maximum(np.sqrt(np.diag(patch.covariance)[:2]), 1e-3)
    sigma = np.array([load_sigma, scatter.load * patch.sigma_mm / patch.size_mm, *place])
    left = [
        np.log(load.load_n) - common[YOUNG] - found.log_force,
        np.log(patch.size_mm / found.rim_mm) - common[SIZE],
        *(patch.centre_mm - own.local[1:]),
    ]
    return np.array(left) / sigma, sigma


def _weight(residual: Array, limit: float) -> Array:
    """Square roots of Huber's weights."""
    return np.sqrt(np.minimum(1.0, limit / np.maximum(np.abs(residual), 1e-9)))
