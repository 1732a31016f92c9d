"""Anchor sites of a marker lattice: a few different dots that identify all others.

A regular lattice looks the same after a shift by one pitch, a half turn or a reflection. Anchors
remove this ambiguity. A *motion* is one of the eight rotations and reflections of the square
lattice, followed by a shift by whole pitches. An observation contradicts a wrong motion wherever
an anchor coincides with a regular dot. The pattern is chosen such that every wrong motion has at
least two contradictions, so the lattice stays unambiguous if one anchor is not detected.

For shifts alone the pattern is a two-dimensional Golomb pattern (all difference vectors
distinct: J. P. Robinson, "Golomb rectangles", IEEE Trans. Inf. Theory 25, 1979), so at most one
anchor coincides with another. For rotations and reflections at most two do.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ifem_export.errors import MarkerGridError

SMALLEST_LATTICE = 5
"""Smallest number of rows or columns of a lattice with anchors."""
STRICT_LATTICE = 8
"""From this size on, the overlap of the two lattices alone contradicts every motion twice."""
ROOMY_LATTICE = 12
"""From this size on, no anchor lies in the outermost rows and columns."""
ROBUST_CONTRADICTIONS = 2
"""Contradictions that every wrong motion must have, so that one anchor may be missed."""

# Each row is a 2x2 integer matrix (row-major) of the symmetry group of the square lattice.
_SYMMETRIES = np.array(
    [
        [1, 0, 0, 1],
        [0, -1, 1, 0],
        [-1, 0, 0, -1],
        [0, 1, -1, 0],
        [1, 0, 0, -1],
        [-1, 0, 0, 1],
        [0, 1, 1, 0],
        [0, -1, -1, 0],
    ]
).reshape(8, 2, 2)
_PLASTIC = 1.32471795724474602596
_ATTEMPTS = 400
_STRIDE = 7
_DRAWS = 120


@lru_cache(maxsize=256)
def _chosen(rows: int, columns: int) -> tuple[tuple[int, int], ...]:
    count = _wanted_count(rows, columns)
    strict = min(rows, columns) >= STRICT_LATTICE
    for spacing in (0.7, 0.5):
        # This is above √2, and two sites cannot be between √2 and 2 pitches apart.
        least = spacing * float(np.sqrt(rows * columns / count))
        for attempt in range(_ATTEMPTS):
            sites = _draw(rows, columns, count, least, attempt)
            if sites is not None and (not strict or _is_robust(rows, columns, sites)):
                return tuple(sorted(sites))
    raise MarkerGridError(
        f"no anchor pattern found for a {rows} x {columns} marker lattice; "
        "use more rows or columns, or anchors 'none'",
        field="anchors",
        value=(rows, columns),
    )


def choose_anchor_sites(rows: int, columns: int) -> NDArray[np.int64]:
    """Anchor sites (k, 2) as (row, column), 4 <= k <= 8, in row-major order.

    Each pair of anchors is at least two pitches apart, and all lie inside the ellipse inscribed
    in the lattice, so that a gel with rounded corners keeps them.

    Raises:
        MarkerGridError: The lattice has fewer than 5 rows or columns, where no pattern is robust.
    """
    if min(rows, columns) < SMALLEST_LATTICE:
        raise MarkerGridError(
            f"marker lattice {rows} x {columns} is too small for anchors: at least "
            f"{SMALLEST_LATTICE} x {SMALLEST_LATTICE} are needed; "
            "use a smaller pitch, or anchors 'none'",
            field="anchors",
            value=(rows, columns),
        )
    return np.array(_chosen(rows, columns), dtype=np.int64)


def _is_robust(rows: int, columns: int, sites: list[tuple[int, int]]) -> bool:
    """Whether every wrong motion of a full lattice has enough contradictions in the overlap.

    Quarter turns of an oblong lattice are left out, because they overlap too little.
    """
    lattice = np.ones((rows, columns), dtype=bool)
    anchors = np.zeros_like(lattice)
    anchors[tuple(np.array(sites).T)] = True
    for turn in range(4):
        for mirror in (False, True):
            moved = np.rot90(anchors, turn)
            if moved.shape != anchors.shape:
                continue
            if mirror:
                moved = moved[:, ::-1]
            both = _overlaps(moved, anchors)
            on_regular = _overlaps(moved, lattice)
            from_regular = _overlaps(anchors[::-1, ::-1], lattice)
            count = on_regular + from_regular - 2 * both
            if turn == 0 and not mirror:
                count[count.shape[0] // 2, count.shape[1] // 2] = np.iinfo(np.int64).max
            if count.min() < ROBUST_CONTRADICTIONS:
                return False
    return True


def _overlaps(few: NDArray[np.bool_], many: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Number of sites of `few` that coincide with sites of `many`, for every shift."""
    half = np.array(few.shape) // 2
    padded = np.pad(many.astype(np.int64), np.stack([half, half], axis=1))
    windows = sliding_window_view(padded, tuple(2 * half + 1))
    return np.asarray(windows[few].sum(axis=0))


def _wanted_count(rows: int, columns: int) -> int:
    spread = int(np.ceil(np.sqrt(rows * columns) / 4.0)) + 2
    least = 4 if min(rows, columns) < 7 else 6
    return int(np.clip(spread, least, 8))


def _candidates(rows: int, columns: int, attempt: int) -> list[tuple[int, int]]:
    """Sites inside the inner ellipse, in the order of a section of the R2 low-discrepancy sequence.

    The sequence (steps by powers of the plastic number) is evenly distributed and needs no random
    generator, so the pattern does not change with the version of a library.
    """
    steps = attempt * _STRIDE + np.arange(_DRAWS)
    unit = (0.5 + steps[:, None] * np.array([1 / _PLASTIC, 1 / _PLASTIC**2])) % 1.0
    sites = (unit * [rows, columns]).astype(np.int64)
    rim = 0 if min(rows, columns) < ROOMY_LATTICE else 1
    half = np.array([rows / 2 - rim, columns / 2 - rim])
    offset = (sites - [(rows - 1) / 2, (columns - 1) / 2]) / half
    inside = sites[np.sum(offset**2, axis=1) <= 1.0]
    return list(dict.fromkeys((int(r), int(c)) for r, c in inside))


def _draw(
    rows: int, columns: int, count: int, least: float, attempt: int
) -> list[tuple[int, int]] | None:
    """Sites from one section of the sequence that keep motions distinct; None if too few do."""
    sites: list[tuple[int, int]] = []
    used: list[Counter[tuple[int, int]]] = [Counter() for _ in _SYMMETRIES]
    for site in _candidates(rows, columns, attempt):
        if any((site[0] - r) ** 2 + (site[1] - c) ** 2 < least**2 for r, c in sites):
            continue
        added = _added_shifts(sites, site)
        if all(_stays_distinct(*pair, i) for i, pair in enumerate(zip(used, added, strict=True))):
            for old, new in zip(used, added, strict=True):
                old.update(new)
            sites.append(site)
        if len(sites) == count:
            return sites
    return None


def _added_shifts(
    sites: list[tuple[int, int]], site: tuple[int, int]
) -> list[Counter[tuple[int, int]]]:
    """Per symmetry, the shifts under which a new site makes an anchor coincide with an anchor."""
    r, c = site
    added = []
    for (a, b), (d, e) in _SYMMETRIES.tolist():
        mr, mc = a * r + b * c, d * r + e * c
        shifts = Counter({(r - mr, c - mc): 1})
        for pr, pc in sites:
            shifts[pr - mr, pc - mc] += 1
            shifts[r - a * pr - b * pc, c - d * pr - e * pc] += 1
        added.append(shifts)
    return added


def _stays_distinct(
    used: Counter[tuple[int, int]], added: Counter[tuple[int, int]], symmetry: int
) -> bool:
    limit = 1 if symmetry == 0 else 2
    return all(
        used[shift] + times <= limit
        for shift, times in added.items()
        if symmetry != 0 or shift != (0, 0)
    )
