"""Which dot of a frame is which marker, by a robust matching.

It first matches markers and dots that are mutual nearest neighbours. A match is
trusted if the affine motion of its neighbours predicts it. Markers that are wrong by a whole pitch
agree among themselves, so only one patch of markers with smooth motion is kept, and the matching
grows from there: each marker is searched where the motion of its neighbours predicts it. If the
patch itself was wrong, all markers are wrong by the same number of pitches; the shift with which
most dots are explained corrects this.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.read_only import read_only
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

_TOLERANCE = 0.45
_AGREEMENT = 0.15
_SMOOTHNESS = (0.15, 0.08, 0.04)
"""Largest relative motion of neighbours in one patch, per distance. Later values are tried if an
earlier one joins wrong markers to the rest through a few markers between them."""
_GROWTH_TOLERANCE = 0.33
_ROUNDS = 4
_MAX_STRAIN = 0.5
"""Largest change of the vector between direct neighbours, per length, at the edge of a contact."""
_NEARLY_ALL = 0.97
_MAX_PATCHES = 6
_MIN_PATCH = 6
_MAX_SHIFT = 2
_MOTION_COST = 6.0
"""Number of dots that outweighs one pitch of median motion when the shift is chosen."""


def match(
    reference: ReferenceLattice,
    points_px: NDArray[np.float64],
    expected_px: NDArray[np.float64] | None = None,
) -> Tracks:
    """Match the markers to the dots of a frame.

    Args:
        reference: The n markers at rest.
        points_px: (m, 2) positions of the dots.
        expected_px: (n, 2) predicted positions, NaN where there is none; the positions at rest
            by default.

    Raises:
        ValueError: An array of another shape, or a position that is not finite.
    """
    points = read_only(np.asarray(points_px, dtype=float))
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError(f"dots {points.shape} must be finite positions (m, 2)")
    expected = (
        reference.positions_px if expected_px is None else np.asarray(expected_px, dtype=float)
    )
    if expected.shape != (len(reference), 2):
        raise ValueError(f"expected positions {expected.shape} must be ({len(reference)}, 2)")
    return _matched(reference, points, read_only(expected))


def _matched(
    reference: ReferenceLattice, points: NDArray[np.float64], expected: NDArray[np.float64]
) -> Tracks:
    from gelslim_force.tracking import matching_kernel as mk
    from gelslim_force.tracking.steep_kernel import match_by_elimination

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    dots = np.full(len(reference), -1, dtype=np.int64)
    mk.mutual(expected, points, pitch, _TOLERANCE, dots)
    offered = dots >= 0
    trusted = offered.copy()
    sure = mk.verify(rest, near, pitch, points, dots, trusted, _AGREEMENT, 1)
    if sure == len(reference) and _one_patch(reference, points, dots, trusted):
        # All markers are verified by all their neighbours: nothing below would change a match.
        status = np.full(len(reference), int(MarkerStatus.TRACKED), dtype=np.int64)
        return _tracks(reference, dots, status, points[dots])
    sure = mk.verify(rest, near, pitch, points, dots, trusted, _AGREEMENT, _ROUNDS - 1)
    dots, trusted = _grown(reference, points, dots, trusted)
    if sure < _NEARLY_ALL * min(len(reference), len(points)):
        dots, trusted = _shifted(reference, points, expected, dots, trusted)
    mk.verify(rest, near, pitch, points, dots, trusted, _AGREEMENT, 2)
    match_by_elimination(rest, near, pitch, points, dots, trusted, _TOLERANCE, _MAX_STRAIN)
    dots[~trusted] = -1
    status = np.where(trusted, MarkerStatus.TRACKED, MarkerStatus.LOST).astype(np.int64)
    guess = np.full((len(reference), 2), np.nan)
    for i in np.flatnonzero(~trusted):
        x, y, support = mk.local_position(i, rest, near, pitch, points, dots, trusted)
        if support >= 4:
            guess[i] = x, y
            status[i] = MarkerStatus.PREDICTED
            gap = mk.nearest(points, x, y)[1]
            if gap < (_TOLERANCE * pitch[i]) ** 2:
                status[i] = MarkerStatus.REJECTED
        elif offered[i]:
            status[i] = MarkerStatus.REJECTED
    seen = dots >= 0
    guess[seen] = points[dots[seen]]
    return _tracks(reference, dots, status, guess)


def _one_patch(
    reference: ReferenceLattice,
    points: NDArray[np.float64],
    dots: NDArray[np.int64],
    trusted: NDArray[np.bool_],
) -> bool:
    """Whether the motion is smooth over all markers."""
    from gelslim_force.tracking import matching_kernel as mk

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    return not mk.patches(rest, near, pitch, points, dots, trusted, _SMOOTHNESS[0]).any()


def _grown(
    reference: ReferenceLattice,
    points: NDArray[np.float64],
    dots: NDArray[np.int64],
    trusted: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Grow the largest patches one by one until one explains nearly all dots; return the best."""
    from gelslim_force.tracking import matching_kernel as mk

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    enough = _NEARLY_ALL * min(len(reference), len(points))
    best, most = (dots.copy(), np.zeros_like(trusted)), -1
    for alike in _SMOOTHNESS:
        patch = mk.patches(rest, near, pitch, points, dots, trusted, alike)
        sizes = np.bincount(patch[patch >= 0], minlength=1)
        for which in np.argsort(-sizes, kind="stable")[:_MAX_PATCHES]:
            if sizes[which] < _MIN_PATCH:
                break
            tried, kept = dots.copy(), patch == which
            for _ in range(2):
                mk.grow(rest, near, pitch, points, tried, kept, _GROWTH_TOLERANCE)
                count = mk.verify(rest, near, pitch, points, tried, kept, _AGREEMENT, 2)
            if count > most:
                best, most = (tried, kept), count
            if count >= enough:
                return best
    return best


def _shifted(
    reference: ReferenceLattice,
    points: NDArray[np.float64],
    expected: NDArray[np.float64],
    dots: NDArray[np.int64],
    trusted: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Correct an error of all markers by whole pitches: take the shift that explains most dots.

    Of shifts that explain equally many dots the one with the smallest median motion is taken.
    """
    from gelslim_force.tracking import matching_kernel as mk

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    low = reference.sites.min(axis=0) - _MAX_SHIFT
    table = np.full(tuple(reference.sites.max(axis=0) - low + 1 + _MAX_SHIFT), -1, dtype=np.int64)
    table[tuple((reference.sites - low).T)] = np.arange(len(reference))
    best, most = (dots, trusted), -np.inf
    for rows in range(-_MAX_SHIFT, _MAX_SHIFT + 1):
        for columns in range(-_MAX_SHIFT, _MAX_SHIFT + 1):
            source = table[tuple((reference.sites - low - [rows, columns]).T)]
            kept = (source >= 0) & trusted[source]
            moved = np.where(kept, dots[source], -1)
            if kept.sum() < _MIN_PATCH:
                continue
            count = mk.grow(rest, near, pitch, points, moved, kept, _GROWTH_TOLERANCE)
            off = points[moved[kept]] - expected[kept]
            off = off[np.isfinite(off).all(axis=1)]
            motion = np.median(np.hypot(*off.T)) / np.median(pitch) if len(off) else 0.0
            score = count - _MOTION_COST * motion
            if score > most:
                best, most = (moved, kept), score
    return best


def _tracks(
    reference: ReferenceLattice,
    dots: NDArray[np.int64],
    status: NDArray[np.int64],
    positions: NDArray[np.float64],
) -> Tracks:
    return Tracks(
        positions_px=positions,
        displacement_px=positions - reference.positions_px,
        status=status,
        dots=dots,
    )
