"""Anchor sites of a marker lattice: few odd dots that fix which dot is which.

A regular lattice looks the same after a shift by one pitch, a half turn or a mirror image.
Anchors break this. A *motion* is one of the eight turns and mirror images of the square
lattice followed by a whole-pitch shift. Under a wrong motion an observation is contradicted by
every anchor seen that falls on a regular dot, and by every regular dot seen that falls on an
anchor. The pattern is chosen such that each wrong motion is contradicted at least twice, so one
anchor that is not seen never makes the lattice ambiguous.

For shifts alone the pattern is a two-dimensional Golomb pattern (all difference vectors
distinct: J. P. Robinson, "Golomb rectangles", IEEE Trans. Inf. Theory 25, 1979), so at most one
anchor falls on an anchor; for turns and mirror images at most two do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

SMALLEST_LATTICE = 5
"""Rows or columns under which no anchor pattern is offered."""
STRICT_LATTICE = 8
"""From this size on the overlap of two lattices alone settles every wrong motion twice."""
ROOMY_LATTICE = 12
"""From this size on anchors keep off the outermost rows and columns."""
ROBUST_CONTRADICTIONS = 2
"""Contradictions every wrong motion must meet for one unseen anchor to be harmless."""

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
    wanted = _wanted_count(rows, columns)
    strict = min(rows, columns) >= STRICT_LATTICE
    for count in (wanted, wanted + 1, wanted - 1, wanted - 2):
        for spacing in (0.7, 0.5, 0.35, 0.0):
            least = max(2.0, spacing * float(np.sqrt(rows * columns / count)))
            for attempt in range(_ATTEMPTS):
                sites = _draw(rows, columns, count, least, attempt) if count >= 4 else None
                if sites is not None and (not strict or _robust_in_overlap(rows, columns, sites)):
                    return tuple(sorted(sites))
    raise ValueError(
        f"no anchor pattern found for a {rows} x {columns} marker lattice; "
        "use more rows or columns, or anchors 'none'"
    )


def choose_anchor_sites(rows: int, columns: int) -> NDArray[np.int64]:
    """Return the anchor sites (k, 2) as (row, column), 4 <= k <= 8, in row-major order.

    No two anchors touch (each pair is at least two pitches apart), and all lie inside the
    ellipse inscribed in the lattice, so that a gel with rounded corners keeps them.
    Raises ValueError for fewer than 5 rows or columns, where no pattern can be told apart
    robustly.
    """
    if min(rows, columns) < SMALLEST_LATTICE:
        raise ValueError(
            f"marker lattice {rows} x {columns} is too small for anchors: at least "
            f"{SMALLEST_LATTICE} x {SMALLEST_LATTICE} are needed; "
            "use a smaller pitch, or anchors 'none'"
        )
    return np.array(_chosen(rows, columns), dtype=np.int64)


def most_coincidences(sites: NDArray[np.int64]) -> tuple[int, int]:
    """Return how many anchors can fall on anchors under a wrong motion.

    `sites` (k, 2). First value: pure shifts by any amount but zero; second: each turn or mirror
    image with any shift.
    """
    worst_shift, worst_other = 0, 0
    for matrix in _SYMMETRIES:
        shifts = (sites[:, None, :] - (sites @ matrix.T)[None, :, :]).reshape(-1, 2)
        pure = bool(np.array_equal(matrix, np.eye(2)))
        if pure:
            shifts = shifts[np.any(shifts != 0, axis=1)]
        if len(shifts) == 0:
            continue
        worst = int(np.unique(shifts, axis=0, return_counts=True)[1].max())
        worst_shift, worst_other = (
            (max(worst_shift, worst), worst_other)
            if pure
            else (worst_shift, max(worst_other, worst))
        )
    return worst_shift, worst_other


def fewest_contradictions(
    present: NDArray[np.bool_], anchors: NDArray[np.bool_], *, overlap_only: bool = False
) -> int:
    """Return the number of contradictions that the most plausible wrong motion meets.

    `present` (rows, columns): sites that carry a dot or a hole left on purpose; `anchors`
    (rows, columns): which of them are anchors. Motions are the eight symmetries about the
    lattice centre with shifts up to half the lattice in each direction. An anchor that falls
    beyond the known sites counts as a contradiction (it is seen where the print has none)
    unless `overlap_only`; that stricter count is meant for turns that keep the lattice's shape
    and leaves quarter turns of an oblong lattice out, because little of it overlaps.
    A result of 2 or more means that one unseen anchor is harmless; 0 without anchors.
    """
    return min(_counts(present, anchors & present, overlap_only))


def _counts(
    present: NDArray[np.bool_], anchors: NDArray[np.bool_], overlap_only: bool
) -> Iterator[int]:
    """Yield the fewest contradictions over all shifts, for one symmetry after the other."""
    for turn in range(4):
        for mirror in (False, True):
            moved_p, moved_a = (_moved(a, turn, mirror) for a in (present, anchors))
            if overlap_only and moved_p.shape != present.shape:
                continue
            both = _overlaps(moved_a, anchors, present.shape)
            seen = _overlaps(moved_a, present, present.shape)
            hidden = _overlaps(anchors[::-1, ::-1], moved_p[::-1, ::-1], present.shape)
            lost = seen if overlap_only else np.full_like(both, int(anchors.sum()))
            count = lost + hidden - 2 * both
            if turn == 0 and not mirror:
                count[count.shape[0] // 2, count.shape[1] // 2] = np.iinfo(np.int64).max
            yield int(count.min())


def _moved(array: NDArray[np.bool_], turn: int, mirror: bool) -> NDArray[np.bool_]:
    turned = np.rot90(array, turn)
    return turned[:, ::-1] if mirror else turned


def _overlaps(
    few: NDArray[np.bool_], many: NDArray[np.bool_], lattice: tuple[int, int]
) -> NDArray[np.int64]:
    """Count the sites of `few` that fall on sites of `many`, for every shift in the window."""
    half = (lattice[0] // 2, lattice[1] // 2)
    offset = [(m - f) // 2 for m, f in zip(many.shape, few.shape, strict=True)]
    pad = [h + abs(o) + max(few.shape) for h, o in zip(half, offset, strict=True)]
    padded = np.pad(many.astype(np.int64), ((pad[0], pad[0]), (pad[1], pad[1])))
    total = np.zeros((2 * half[0] + 1, 2 * half[1] + 1), dtype=np.int64)
    for row, column in np.argwhere(few):
        top = pad[0] + int(row) + offset[0] - half[0]
        left = pad[1] + int(column) + offset[1] - half[1]
        total += padded[top : top + total.shape[0], left : left + total.shape[1]]
    return total


def _wanted_count(rows: int, columns: int) -> int:
    spread = int(np.ceil(np.sqrt(rows * columns) / 4.0)) + 2
    least = 4 if min(rows, columns) < 7 else 6
    return int(np.clip(spread, least, 8))


@lru_cache(maxsize=8)
def _candidates(rows: int, columns: int) -> tuple[tuple[int, int], ...]:
    """Return sites in the order of the R2 low-discrepancy sequence, inside the inner ellipse.

    The sequence (steps by powers of the plastic number) spreads evenly and needs no random
    generator, so the pattern cannot change with a library's version.
    """
    steps = np.arange(_ATTEMPTS * _STRIDE + _DRAWS)
    unit = (0.5 + steps[:, None] * np.array([1 / _PLASTIC, 1 / _PLASTIC**2])) % 1.0
    sites = (unit * [rows, columns]).astype(np.int64)
    rim = 0 if min(rows, columns) < ROOMY_LATTICE else 1
    half = np.array([rows / 2 - rim, columns / 2 - rim])
    off = (sites - [(rows - 1) / 2, (columns - 1) / 2]) / half
    inside = np.sum(off**2, axis=1) <= 1.0
    return tuple(
        (int(r), int(c)) if ok else (-1, -1) for (r, c), ok in zip(sites, inside, strict=True)
    )


def _draw(
    rows: int, columns: int, count: int, least: float, attempt: int
) -> list[tuple[int, int]] | None:
    """Take sites in turn, from the attempt's place in the sequence, that keep motions distinct."""
    sites: list[tuple[int, int]] = []
    used: list[Counter[tuple[int, int]]] = [Counter() for _ in _SYMMETRIES]
    tried = {(-1, -1)}
    start = attempt * _STRIDE
    for site in _candidates(rows, columns)[start : start + _DRAWS]:
        if site in tried:
            continue
        tried.add(site)
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
    """Return, per symmetry, the shifts that a new site makes bring an anchor onto an anchor."""
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


def _robust_in_overlap(rows: int, columns: int, sites: list[tuple[int, int]]) -> bool:
    anchors = np.zeros((rows, columns), dtype=bool)
    anchors[tuple(np.array(sites).T)] = True
    counts = _counts(np.ones_like(anchors), anchors, overlap_only=True)
    return all(count >= ROBUST_CONTRADICTIONS for count in counts)
