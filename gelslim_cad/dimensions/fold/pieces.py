"""The measures of candidates in which the polish is smooth: goal and limits in pieces."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold.fold import HOUSING_LIMITS, VIEW_LIMITS, measures
from gelslim_cad.dimensions.fold.goal import besides_depth, beyond_mm, score
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem

Designs = NDArray[np.intp]
Measure = Callable[[Designs, Array], Array]
"""From designs (n,) and their candidates (n, k, 3) the numbers (n, k, m) of `fold.measures`."""
DEPTHS, PIXELS, LENGTHS, TIE = slice(0, 4), slice(4, 8), slice(8, 13), slice(13, 14)
VIEW = slice(14, 15 + len(VIEW_LIMITS))
HOUSING = slice(VIEW.stop, VIEW.stop + len(HOUSING_LIMITS) - 2)
"""Where the measures stand."""
MEASURED = HOUSING.stop
ENVELOPE = slice(0, DEPTHS.stop + LENGTHS.stop - LENGTHS.start)
CLASHES = slice(ENVELOPE.stop, None)
"""What depends on the envelope among the pieces of the housing's limits, and what does not."""


class Pieces(NamedTuple):
    """Limits in smooth pieces, or their slopes; <= 0 holds."""

    view: Array
    """As parts of their scales, four sizes of a marker and three parts of the camera first,
    (n, a, k)."""
    housing: Array
    """In mm, (n, b, k)."""

    @classmethod
    def of(cls, p: FoldProblem, values: Array, slopes: Array | None = None) -> Pieces:
        """The limits from the measures (n, m, 1), or their slopes from those (n, m, 3) as well."""
        px = values[:, PIXELS]
        if slopes is None:
            pixels = p.min_px_per_marker / px - 1
            within = (values[:, DEPTHS] - p.max_depth_mm, values[:, LENGTHS] - p.max_length_mm)
            return cls(
                np.concatenate([pixels, values[:, VIEW]], axis=1),
                np.concatenate([*within, values[:, HOUSING]], axis=1),
            )
        falling = -p.min_px_per_marker / (px * px) * slopes[:, PIXELS]
        return cls(
            np.concatenate([falling, slopes[:, VIEW]], axis=1),
            np.concatenate([slopes[:, DEPTHS], slopes[:, LENGTHS], slopes[:, HOUSING]], axis=1),
        )


def measured_by_arrays(problem: FoldProblem) -> Measure:
    """The measures of candidates of these designs, by NumPy."""

    def measure(design: Designs, place: Array) -> Array:
        axes = (place[..., i, None] for i in range(3))
        found = measures(problem.rows(design), *axes)
        shape = (*place.shape[:2], 1)
        return np.concatenate([np.broadcast_to(value, shape) for value in found], axis=-1)

    return measure


def scores(problem: FoldProblem, design: Designs, measured: Array) -> Array:
    """Scores of candidates from their measures (n, m)."""
    p = problem.rows(design)
    pieces = Pieces.of(p, measured[..., None])
    view, housing = pieces.view[..., 0], pieces.housing[..., 0]
    # The four sizes of a marker are one limit, and so are the three parts of the camera.
    whole = np.column_stack([view[:, :4].max(axis=1), view[:, 4:7].max(axis=1), view[:, 7:]])
    missed = np.maximum(whole, 0.0).sum(axis=1)
    clashes = (housing[:, k] for k in range(CLASHES.start, housing.shape[1]))
    over = housing[:, ENVELOPE].max(axis=1)
    beyond = beyond_mm((over, over, *clashes))
    depth = np.maximum(measured[:, DEPTHS].max(axis=1), p.guide_stack_mm[:, 0, 0])
    length, least_px = measured[:, LENGTHS].max(axis=1), measured[:, PIXELS].min(axis=1)
    values = (missed, beyond, depth, length, least_px, measured[:, TIE][:, 0])
    missed, beyond, depth, length, least_px, tie = (v[:, None, None] for v in values)
    found: Array = score(p, missed, beyond, depth, besides_depth(p, length, least_px, tie))
    return found[:, 0, 0]
