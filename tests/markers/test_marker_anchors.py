"""Anchors settle every shift, turn and mirror image: proved by trying all of them."""

import numpy as np
import pytest

from ifem_export.errors import MarkerGridError
from ifem_export.markers.anchors import choose_anchor_sites

SYMMETRIES = [
    np.array(m)
    for m in (
        [[1, 0], [0, 1]],
        [[0, -1], [1, 0]],
        [[-1, 0], [0, -1]],
        [[0, 1], [-1, 0]],
        [[1, 0], [0, -1]],
        [[-1, 0], [0, 1]],
        [[0, 1], [1, 0]],
        [[0, -1], [-1, 0]],
    )
]
PRINTED = {
    (5, 5): [(0, 3), (1, 0), (2, 2), (4, 2)],
    (5, 9): [(1, 0), (2, 4), (2, 7), (4, 2)],
    (6, 6): [(0, 3), (1, 0), (3, 3), (4, 1)],
    (6, 13): [(0, 8), (1, 2), (3, 6), (4, 2), (4, 9)],
    (7, 7): [(0, 4), (1, 2), (3, 3), (4, 6), (5, 1), (6, 3)],
    (7, 12): [(0, 4), (2, 7), (2, 10), (3, 0), (5, 5), (6, 8)],
    (8, 8): [(0, 4), (1, 1), (3, 4), (4, 6), (6, 1), (6, 3)],
    (8, 40): [(0, 25), (1, 34), (2, 2), (4, 13), (4, 20), (6, 8), (6, 30)],
    (9, 9): [(0, 5), (2, 0), (4, 4), (4, 7), (6, 1), (7, 6)],
    (10, 10): [(0, 4), (2, 3), (3, 6), (5, 3), (5, 7), (8, 4)],
    (11, 11): [(0, 3), (1, 7), (3, 0), (6, 5), (8, 9), (9, 4)],
    (11, 14): [(0, 8), (3, 4), (5, 0), (5, 7), (8, 2), (8, 10)],
    (12, 12): [(2, 7), (4, 4), (6, 6), (7, 9), (9, 2), (10, 6)],
    (12, 13): [(1, 8), (3, 4), (6, 1), (6, 6), (7, 11), (10, 5)],
    (13, 12): [(3, 3), (4, 8), (6, 5), (8, 1), (10, 4), (10, 8)],
    (17, 22): [(3, 15), (4, 7), (7, 1), (8, 11), (8, 17), (12, 4), (14, 13)],
    (23, 25): [(1, 11), (6, 20), (7, 4), (8, 11), (13, 15), (13, 22), (15, 7), (19, 13)],
    (40, 40): [(2, 19), (11, 25), (16, 12), (21, 2), (23, 35), (31, 19), (32, 30), (33, 9)],
}
"""Anchor sites of lattices: printed gels and stored calibrations rely on them."""
LATTICES = [(n, n) for n in range(8, 41)]
LATTICES += [(23, 25), (25, 23), (8, 40), (40, 8), (9, 14), (13, 30), (39, 40), (17, 22)]


def brute_force(rows, columns, sites, *, overlap_only):
    """Fewest contradictions left over all wrong motions when the worst anchor is not seen.

    A full lattice with anchors `sites` is observed; site p is taken for M p + t. Written from
    the definition with coordinates, not with arrays as the code under test.
    """
    is_anchor = np.zeros((rows, columns), dtype=bool)
    is_anchor[sites[:, 0], sites[:, 1]] = True
    size = np.array([rows, columns])
    half = size // 2
    worst = 10**9
    for matrix in SYMMETRIES:
        pure = np.array_equal(matrix, np.eye(2))
        turned = abs(matrix[0, 0]) == 0
        if overlap_only and turned and rows != columns:
            continue
        to_middle = (size - 1) / 2 - matrix @ ((size - 1) / 2)
        spans = [
            np.arange(np.floor(m) - h, np.ceil(m) + h + 1, dtype=int)
            for m, h in zip(to_middle, half, strict=True)
        ]
        shifts = np.stack(np.meshgrid(*spans, indexing="ij"), axis=-1).reshape(-1, 1, 2)
        if pure:
            shifts = shifts[np.any(shifts[:, 0] != 0, axis=1)]

        def look_up(where):
            inside = np.all((where >= 0) & (where < size), axis=-1)
            kept = np.where(inside[..., None], where, 0)
            return inside, inside & is_anchor[kept[..., 0], kept[..., 1]]

        inside, on_anchor = look_up(sites[None] @ matrix.T + shifts)
        wrong = (inside & ~on_anchor) if overlap_only else ~on_anchor
        seen = wrong.sum(axis=1)
        inside, from_anchor = look_up((sites[None] - shifts) @ matrix)
        hidden = (inside & ~from_anchor).sum(axis=1)
        left = hidden + np.maximum(seen - 1, 0)
        worst = min(worst, int(left.min()))
    return worst


@pytest.mark.parametrize(("rows", "columns"), PRINTED)
def test_the_pattern_of_a_lattice_never_changes(rows, columns):
    assert choose_anchor_sites(rows, columns).tolist() == [list(s) for s in PRINTED[rows, columns]]


@pytest.mark.parametrize(("rows", "columns"), LATTICES)
def test_every_wrong_motion_is_seen_with_any_one_anchor_missing(rows, columns):
    sites = choose_anchor_sites(rows, columns)
    assert 4 <= len(sites) <= 8
    assert brute_force(rows, columns, sites, overlap_only=False) >= 1
    # The stricter reading: only sites where the two lattices overlap count.
    assert brute_force(rows, columns, sites, overlap_only=True) >= 1


@pytest.mark.slow
@pytest.mark.parametrize("rows", range(8, 41))
def test_every_oblong_lattice_up_to_40(rows):
    for columns in range(8, 41):
        sites = choose_anchor_sites(rows, columns)
        assert brute_force(rows, columns, sites, overlap_only=False) >= 1, (rows, columns)
        assert brute_force(rows, columns, sites, overlap_only=True) >= 1, (rows, columns)


@pytest.mark.parametrize(("rows", "columns"), [(5, 5), (5, 9), (6, 6), (7, 5), (7, 12)])
def test_small_lattices_are_unambiguous_with_one_anchor_missing(rows, columns):
    sites = choose_anchor_sites(rows, columns)
    assert brute_force(rows, columns, sites, overlap_only=False) >= 1


@pytest.mark.parametrize(("rows", "columns"), [(8, 8), (23, 25), (40, 40)])
def test_pattern_is_a_golomb_pattern_and_touches_nothing(rows, columns):
    sites = choose_anchor_sites(rows, columns)
    worst = []
    for matrix in SYMMETRIES:
        shifts = (sites[:, None, :] - (sites @ matrix.T)[None, :, :]).reshape(-1, 2)
        shifts = shifts[(shifts != 0).any(axis=1) | (not np.array_equal(matrix, np.eye(2)))]
        worst.append(np.unique(shifts, axis=0, return_counts=True)[1].max())
    assert worst[0] == 1
    assert max(worst[1:]) == 2
    apart = np.abs(sites[:, None] - sites[None]).max(axis=-1)
    assert apart[~np.eye(len(sites), dtype=bool)].min() >= 2


def test_a_symmetric_pattern_is_ambiguous():
    corners = np.array([[2, 2], [2, 7], [7, 2], [7, 7]])
    assert brute_force(10, 10, corners, overlap_only=False) == 0


@pytest.mark.parametrize(("rows", "columns"), [(4, 4), (4, 30), (30, 3), (1, 1)])
def test_too_small_a_lattice_is_refused_with_a_remedy(rows, columns):
    with pytest.raises(MarkerGridError) as caught:
        choose_anchor_sites(rows, columns)
    assert (caught.value.field, caught.value.value) == ("anchors", (rows, columns))
