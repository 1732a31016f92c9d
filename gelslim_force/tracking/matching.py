"""Which dot of a frame is which marker: the paper's nearest neighbour, and a robust matching.

Robust: markers and dots that are each other's nearest are matched, and a match is trusted where
the affine motion of its neighbours leads to it. Markers mistaken by a whole pitch agree among
themselves, so only one patch of markers that move alike is kept and the rest is grown from it,
each marker looked for where its neighbours' motion puts it. Should the seed have been mistaken,
all are off by the same whole pitches, and the shift that explains most dots sets them right.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.read_only import read_only
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

MatchMode = Literal["robust", "nearest"]
_GATE = 0.45
_AGREES = 0.15
_ALIKE = (0.15, 0.08, 0.04)
"""Motion between neighbours, per distance, that one patch may have; the first is tried first:
a thin bridge may join markers mistaken by a pitch to the rest."""
_GROWS = 0.33
_ROUNDS = 4
_STRAIN = 0.5
"""Change of the vector between direct neighbours, per length, that a contact's rim may cause."""
_CLEAN = 0.97
_PATCHES = 6
_SMALLEST_PATCH = 6
_SHIFTS = 2
_MOTION_COST = 6.0
"""Dots that one pitch of median motion outweighs when a whole-pitch mistake is undone."""


def match(
    reference: ReferenceLattice,
    points_px: NDArray[np.float64],
    expected_px: NDArray[np.float64] | None = None,
    mode: MatchMode = "robust",
) -> Tracks:
    """Return the markers' tracks among the dots `points_px` (m, 2) of a frame.

    `expected_px` (n, 2) are predicted places, by default those of the reference; NaN where there
    is none. Raises ValueError for arrays of other shapes or an unknown mode.
    """
    points = read_only(np.asarray(points_px, dtype=float))
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError(f"dots {points.shape} must be finite places (m, 2)")
    expected = (
        reference.positions_px if expected_px is None else np.asarray(expected_px, dtype=float)
    )
    if expected.shape != (len(reference), 2):
        raise ValueError(f"expected places {expected.shape} must be ({len(reference)}, 2)")
    expected = read_only(expected)
    if mode == "nearest":
        return _nearest(reference, points, expected)
    if mode == "robust":
        return _robust(reference, points, expected)
    raise ValueError(f"matching mode {mode!r}: must be 'robust' or 'nearest'")


def _nearest(
    reference: ReferenceLattice, points: NDArray[np.float64], expected: NDArray[np.float64]
) -> Tracks:
    """Each marker takes the nearest dot, as in the paper: unverified, two may take one."""
    from gelslim_force.tracking import matching_kernel as mk

    dots = np.full(len(reference), -1, dtype=np.int64)
    for i, (x, y) in enumerate(expected):
        if np.isfinite(x + y):
            dots[i] = mk.nearest(points, x, y)[0]
    status = np.where(dots >= 0, MarkerStatus.TRACKED, MarkerStatus.LOST).astype(np.int64)
    return _tracks(reference, points, dots, status, np.full((len(reference), 2), np.nan))


def _robust(
    reference: ReferenceLattice, points: NDArray[np.float64], expected: NDArray[np.float64]
) -> Tracks:
    from gelslim_force.tracking import matching_kernel as mk
    from gelslim_force.tracking.steep_kernel import settle

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    dots = np.full(len(reference), -1, dtype=np.int64)
    mk.mutual(expected, points, pitch, _GATE, dots)
    offered = dots >= 0
    trusted = offered.copy()
    sure = mk.verify(rest, near, pitch, points, dots, trusted, _AGREES, _ROUNDS)
    dots, trusted = _grown(reference, points, dots, trusted)
    if sure < _CLEAN * min(len(reference), len(points)):
        dots, trusted = _shifted(reference, points, expected, dots, trusted)
    mk.verify(rest, near, pitch, points, dots, trusted, _AGREES, 2)
    settle(rest, near, pitch, points, dots, trusted, _GATE, _STRAIN)
    dots[~trusted] = -1
    status = np.where(trusted, MarkerStatus.TRACKED, MarkerStatus.LOST).astype(np.int64)
    guess = np.full((len(reference), 2), np.nan)
    for i in np.flatnonzero(~trusted):
        x, y, support = mk.local_place(i, rest, near, pitch, points, dots, trusted)
        if support >= 4:
            guess[i] = x, y
            status[i] = MarkerStatus.PREDICTED
            gap = mk.nearest(points, x, y)[1]
            if gap < (_GATE * pitch[i]) ** 2:
                status[i] = MarkerStatus.REJECTED
        elif offered[i]:
            status[i] = MarkerStatus.REJECTED
    return _tracks(reference, points, dots, status, guess)


def _grown(
    reference: ReferenceLattice,
    points: NDArray[np.float64],
    dots: NDArray[np.int64],
    trusted: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Grow the largest patches in turn until one explains nearly all dots; the best of them."""
    from gelslim_force.tracking import matching_kernel as mk

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    enough = _CLEAN * min(len(reference), len(points))
    best, most = (dots.copy(), np.zeros_like(trusted)), -1
    for alike in _ALIKE:
        patch = mk.patches(rest, near, pitch, points, dots, trusted, alike)
        sizes = np.bincount(patch[patch >= 0], minlength=1)
        for which in np.argsort(-sizes, kind="stable")[:_PATCHES]:
            if sizes[which] < _SMALLEST_PATCH:
                break
            tried, held = dots.copy(), patch == which
            for _ in range(2):
                mk.grow(rest, near, pitch, points, tried, held, _GROWS)
                count = mk.verify(rest, near, pitch, points, tried, held, _AGREES, 2)
            if count > most:
                best, most = (tried, held), count
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
    """Undo a mistake of the seed by whole pitches: the shift that explains most dots.

    Among shifts that explain as many, the one whose median motion is least.
    """
    from gelslim_force.tracking import matching_kernel as mk

    rest, near, pitch = reference.positions_px, reference.neighbours, reference.pitch_px
    low = reference.sites.min(axis=0) - _SHIFTS
    table = np.full(tuple(reference.sites.max(axis=0) - low + 1 + _SHIFTS), -1, dtype=np.int64)
    table[tuple((reference.sites - low).T)] = np.arange(len(reference))
    best, most = (dots, trusted), -np.inf
    for rows in range(-_SHIFTS, _SHIFTS + 1):
        for columns in range(-_SHIFTS, _SHIFTS + 1):
            source = table[tuple((reference.sites - low - [rows, columns]).T)]
            held = (source >= 0) & trusted[source]
            moved = np.where(held, dots[source], -1)
            if held.sum() < _SMALLEST_PATCH:
                continue
            count = mk.grow(rest, near, pitch, points, moved, held, _GROWS)
            off = points[moved[held]] - expected[held]
            off = off[np.isfinite(off).all(axis=1)]
            motion = np.median(np.hypot(*off.T)) / np.median(pitch) if len(off) else 0.0
            score = count - _MOTION_COST * motion
            if score > most:
                best, most = (moved, held), score
    return best


def _tracks(
    reference: ReferenceLattice,
    points: NDArray[np.float64],
    dots: NDArray[np.int64],
    status: NDArray[np.int64],
    places: NDArray[np.float64],
) -> Tracks:
    seen = dots >= 0
    places[seen] = points[dots[seen]]
    return Tracks(
        positions_px=places,
        displacement_px=places - reference.positions_px,
        status=status,
        dots=dots,
    )
