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
