"""Anchors settle every shift, turn and mirror image: proved by trying all of them."""

import numpy as np
import pytest

from ifem_export.markers.anchors import (
    choose_anchor_sites,
    fewest_contradictions,
    most_coincidences,
)

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
    shift, other = most_coincidences(sites)
    assert shift == 1
    assert other == 2
    apart = np.abs(sites[:, None] - sites[None]).max(axis=-1)
    assert apart[~np.eye(len(sites), dtype=bool)].min() >= 2


def test_brute_force_and_code_condemn_a_symmetric_pattern():
    corners = np.array([[2, 2], [2, 7], [7, 2], [7, 7]])
    anchors = np.zeros((10, 10), dtype=bool)
    anchors[tuple(corners.T)] = True
    assert brute_force(10, 10, corners, overlap_only=False) == 0
    assert fewest_contradictions(np.ones_like(anchors), anchors) == 0
    assert most_coincidences(corners) == (2, 4)


@pytest.mark.parametrize("overlap_only", [False, True])
def test_contradictions_match_counting_by_hand_of_every_site(overlap_only):
    rng = np.random.default_rng(5)
    for shape in ((7, 7), (8, 8), (7, 7)):
        present = rng.random(shape) < 0.9
        anchors = present & (rng.random(shape) < 0.12)
        expected = 10**9
        half = np.array(shape) // 2
        for turn in range(4):
            for mirror in (False, True):
                for i in range(-half[0], half[0] + 1):
                    for j in range(-half[1], half[1] + 1):
                        if turn == 0 and not mirror and (i, j) == (0, 0):
                            continue
                        moved_p, moved_a = np.rot90(present, turn), np.rot90(anchors, turn)
                        if mirror:
                            moved_p, moved_a = moved_p[:, ::-1], moved_a[:, ::-1]
                        count = 0
                        for r, c in np.ndindex(shape):
                            if not moved_p[r, c]:
                                continue
                            rr, cc = r + i, c + j
                            known = (
                                0 <= rr < shape[0] and 0 <= cc < shape[1] and bool(present[rr, cc])
                            )
                            if known:
                                count += moved_a[r, c] != anchors[rr, cc]
                            elif not overlap_only:
                                count += moved_a[r, c]
                        expected = min(expected, int(count))
        assert fewest_contradictions(present, anchors, overlap_only=overlap_only) == expected


@pytest.mark.parametrize(("rows", "columns"), [(4, 4), (4, 30), (30, 3), (1, 1)])
def test_too_small_a_lattice_is_refused_with_a_remedy(rows, columns):
    with pytest.raises(ValueError, match=r"at least 5 x 5 are needed; .* anchors 'none'"):
        choose_anchor_sites(rows, columns)
