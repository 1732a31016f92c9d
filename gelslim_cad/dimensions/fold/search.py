"""The best candidates of grids, compiled, for batches of designs. Importing this loads numba.

Candidates are laid out by the same functions as in `fold.fold`, compiled here for single numbers,
one by one against the best so far. Each is left as soon as it cannot beat that one: missed limits
only add up, and a part of the depth bounds the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold import (
    camera as fold_camera,
)
from gelslim_cad.dimensions.fold import (
    distortion as fold_distortion,
)
from gelslim_cad.dimensions.fold import (
    focus as fold_focus,
)
from gelslim_cad.dimensions.fold import (
    fold,
)
from gelslim_cad.dimensions.fold import (
    goal as fold_goal,
)
from gelslim_cad.dimensions.fold import (
    housing as fold_housing,
)
from gelslim_cad.dimensions.fold import (
    mirror as fold_mirror,
)
from gelslim_cad.dimensions.fold import (
    problem as fold_problem,
)
from gelslim_cad.dimensions.fold import (
    room as fold_room,
)
from gelslim_cad.dimensions.fold import (
    sight as fold_sight,
)
from gelslim_cad.dimensions.fold.camera import camera, pitch_rad, smallest
from gelslim_cad.dimensions.fold.focus import distances
from gelslim_cad.dimensions.fold.fold import camera_depth_mm, depth_mm, measures
from gelslim_cad.dimensions.fold.goal import (
    FEASIBLE,
    INFEASIBLE_MM,
    besides_depth,
    beyond_mm,
    score,
    tie_mm,
)
from gelslim_cad.dimensions.fold.grids import STARTS, Best, best_of_bands
from gelslim_cad.dimensions.fold.housing import housing_missed, tip_x_mm
from gelslim_cad.dimensions.fold.mirror import (
    mirror,
    mirror_angle_rad,
    mirror_depth_mm,
    reflected,
)
from gelslim_cad.dimensions.fold.pieces import MEASURED, Measure
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_cad.dimensions.fold.room import (
    SCALE_MM,
    camera_below_window,
    camera_beside_view,
    camera_clear_of_ledge,
    camera_clear_of_mirror,
    ledge_edge_x_mm,
    mirror_before_camera,
    mirror_below_window,
    view_below_ledge,
)
from gelslim_cad.dimensions.fold.sight import (
    field_missed,
    keystone,
    least_px,
    lens_extension_mm,
    picture_missed,
    sight,
)
from gelslim_optics.camera import radial_scale, refraction_kernel, refraction_newton
from gelslim_optics.camera.refraction_kernel import COMPILED, INLINED, let_compile, source_key

SOURCES = (
    radial_scale, fold_focus, fold_distortion, fold_sight, fold_mirror, fold_camera, fold_room,
    fold_housing, fold_goal, fold
)  # fmt: skip


def search(problem: FoldProblem) -> Best:
    """The best candidate of each band of each design; releases the GIL."""
    records = np.tile(problem.records(), STARTS)
    return best_of_bands(len(problem), partial(best_of_grids, records))


def best_of_grids(records: Any, mid: Array, spread: Array, turn: Array, known: Array) -> Best:
    """The first best candidate of each grid: axes (n, k), designs and scores to beat (n,)."""
    # A grid in which nothing is better keeps its middle, the candidate that scored `known`.
    middle = [axis[:, axis.shape[1] // 2] for axis in (mid, spread, turn)]
    found = np.column_stack([*middle, known])
    _best_of_grids(records, mid, spread, turn, known, found)
    return Best(*found.T.copy())


def measured(problem: FoldProblem) -> Measure:
    """The measures of candidates of these designs, compiled; releases the GIL."""
    records = problem.records()

    def measure(design: NDArray[np.intp], place: Array) -> Array:
        found = np.empty((*place.shape[:2], MEASURED))
        _measures(records, design, place, found)
        return found

    return measure


def _positive_sum(missed: Any) -> Any:
    """Sum of the parts that are missed."""
    total = 0.0
    for k in range(len(missed)):
        total = total + larger(missed[k], 0.0)
    return total


def _parts(one_mm: Any, other_mm: Any) -> Any:
    """Two missed lengths as parts of their scale, summed."""
    return (larger(one_mm, 0.0) + larger(other_mm, 0.0)) / SCALE_MM


def _worse(missed: Any, known: Any) -> Any:
    """Whether a candidate that misses this much is certainly above `known`."""
    return missed > FEASIBLE and INFEASIBLE_MM * (1 + missed) > known


def _score(p: Any, s: Any, d: Any, picture: Any, angle: Any, cos: Any, sin: Any, known: Any) -> Any:
    """Score of a candidate; inf if certainly above `known`.

    `picture` holds what it misses in its picture, its pixels per marker and the tie.
    """
    missed, px, tie = picture
    m = mirror(p, s, cos, sin)
    x, z = reflected(m, s.virtual_x_mm, s.virtual_z_mm)
    missed += _parts(mirror_below_window(s, m), mirror_before_camera(p, m, x))
    # The entrance pupil lies in the camera: its lowest corner is lower, its rearmost behind it.
    mirror_depth = mirror_depth_mm(p, m)
    shallow = depth_mm(p, mirror_depth, camera_depth_mm(p, z))
    short = tip_x_mm(p, m) - x + p.mount_length_mm
    if score(p, missed, 0 * shallow, shallow, besides_depth(p, short, px, tie)) > known:
        return np.inf
    c = camera(p, x, z, pitch_rad(s, angle), lens_extension_mm(p, d))
    missed += _parts(camera_below_window(p, c), camera_beside_view(p, s, c))
    missed += _parts(camera_clear_of_mirror(p, m, c), 0.0)
    if _worse(missed, known):
        return np.inf
    ledge_x = ledge_edge_x_mm(p, s)
    missed += _parts(camera_clear_of_ledge(p, c, ledge_x), view_below_ledge(p, m, c, ledge_x))
    depth = depth_mm(p, mirror_depth, camera_depth_mm(p, smallest(c.corners_z_mm)))
    housing = housing_missed(p, s, m, c, ledge_x, depth)
    length = housing.length + p.max_length_mm
    besides = besides_depth(p, length, px, tie)
    return score(p, missed, beyond_mm(housing), depth, besides)


def repeats(axis: Any, k: int) -> Any:
    """Whether an increasing axis has the value before once more: a grid that the box cuts off.

    Only the first of equal candidates can be the first best.
    """
    return k > 0 and axis[k] == axis[k - 1]


def _best_of_grid(p: Any, mids: Any, spreads: Any, turns: Any, known: Any, found: Any) -> None:
    """Write the first best candidate and its score to `found` (4,).

    Equals are scored to the end: the first of them wins, as in `solver`.
    """
    best = np.inf
    for i in range(len(mids)):
        for j in range(len(spreads)):
            if repeats(mids, i) or repeats(spreads, j):
                continue
            s = sight(p, mids[i], spreads[j])
            d = distances(p, s.border, np.cos(s.tilt_rad), np.sin(s.tilt_rad))
            field = field_missed(p, s, d)
            missed = _positive_sum(field)
            if _worse(missed, min(known, best)):
                continue
            missed += _positive_sum(picture_missed(p, s, d))
            if _worse(missed, min(known, best)):
                continue
            use = 1 + larger(field.field_of_view_along, field.field_of_view_across)
            picture = (missed, least_px(p, s, d), tie_mm(use, keystone(d)))
            for k in range(len(turns)):
                to_beat = min(known, best)
                angle = mirror_angle_rad(turns[k], mids[i])
                cos, sin = np.cos(angle), np.sin(angle)
                value = _score(p, s, d, picture, angle, cos, sin, to_beat)
                if value < best:
                    best = value
                    found[0], found[1], found[2] = mids[i], spreads[j], turns[k]
                    found[3] = value


@overload(larger, strict=False, jit_options=INLINED)
def _larger_number(a: Any, b: Any) -> Any:
    return lambda a, b: a if a > b else b


@overload(smaller, strict=False, jit_options=INLINED)
def _smaller_number(a: Any, b: Any) -> Any:
    return lambda a, b: a if a < b else b


for shared in (module.SHARED for module in SOURCES):
    let_compile(shared)
let_compile((_positive_sum, _parts, _worse, _score, repeats, _best_of_grid))


def _compile(source: int) -> tuple[Callable[..., None], Callable[..., None]]:
    @njit(**COMPILED)
    def all_grids(records: Any, mid: Any, spread: Any, turn: Any, known: Any, found: Any) -> None:
        source  # noqa: B018
        for i in range(len(records)):
            _best_of_grid(records[i], mid[i], spread[i], turn[i], known[i], found[i])

    @njit(**COMPILED)
    def all_measures(records: Any, design: Any, place: Any, found: Any) -> None:
        source  # noqa: B018
        for i in range(len(design)):
            for k in range(place.shape[1]):
                mid, spread, mirror_rad = place[i, k, 0], place[i, k, 1], place[i, k, 2]
                values = measures(records[design[i]], mid, spread, mirror_rad)
                for m in range(len(values)):
                    found[i, k, m] = values[m]

    return all_grids, all_measures


_best_of_grids, _measures = _compile(
    source_key(refraction_newton, refraction_kernel, fold_problem, *SOURCES)
)
