"""The compiled looks at lines of a picture, at markers and at their dots against plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.detection.detection import as_planes
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking import line_kernel, median_kernel, tear_kernel, whole_kernel
from gelslim_force.tracking.marker_noise import noise_px, robust_sigma

SITES = np.stack(np.mgrid[:14, :16], axis=-1).reshape(-1, 2)
LATTICE = ReferenceLattice(SITES, SITES[:, ::-1] * 17.0, np.arange(len(SITES)))


def sharpness(rows: np.ndarray) -> np.ndarray:
    """Of lines (n, s): bend across each, in the third dullest of its parts."""
    steps = np.diff(rows.astype(int), axis=0)
    bends = np.abs(2 * steps[1:-1] - steps[:-2] - steps[2:])
    length = bends.shape[1] // line_kernel.PARTS
    kept = bends[:, : length * line_kernel.PARTS]
    parts = kept.reshape(len(bends), line_kernel.PARTS, length).sum(axis=2)
    return np.sort(parts, axis=1)[:, line_kernel.PARTS // 3]


def longest_run(rows: np.ndarray) -> int:
    """Of lines (n, s)."""
    same = (rows[1:] == rows[:-1]).all(axis=1)
    ends = np.flatnonzero(~np.concatenate([[False], same, [False]]))
    return int(np.diff(ends).max())


def jump(motion: np.ndarray) -> tuple[float, float, float]:
    """Share explained, steepness and size of the best division of lines in two parts."""
    count = len(motion)
    means = [(motion[:k].mean(axis=0), motion[k:].mean(axis=0)) for k in range(1, count)]
    between = [
        k * (count - k) / count * ((b - a) ** 2).sum() for k, (a, b) in enumerate(means, start=1)
    ]
    best = int(np.argmax(between))
    apart = means[best][1] - means[best][0]
    spread = ((motion - motion.mean(axis=0)) ** 2).sum()
    steep = (motion[best + 1] - motion[best]) @ apart / (apart @ apart)
    return between[best] / spread, steep, float(np.hypot(*apart))


@pytest.mark.parametrize("channels", [1, 3])
def test_lines_of_a_picture(channels: int) -> None:
    rng = np.random.default_rng(channels)
    for left, top, right, bottom in ((3, 5, 150, 90), (0, 0, 160, 120), (40, 60, 60, 120)):
        image = rng.integers(0, 256, (120, 160, channels)).astype(np.uint8)
        image[top + 10 : top + 17] = image[top + 10]
        part = image[top:bottom, left:right].astype(int).sum(axis=2)
        for write, whole, step in (
            (line_kernel.rows, part, 3),
            (line_kernel.columns, part.T, 2),
        ):
            expected = whole[:, ::step]
            lines = np.empty(expected.T.shape, dtype=np.int16)
            write(as_planes(image), left, top, step, lines)
            np.testing.assert_array_equal(lines.T, expected)
            assert line_kernel.longest_run(lines) == longest_run(expected)
            found = np.empty(lines.shape[1] - 3, dtype=np.int32)
            line_kernel.sharpness(lines, found)
            np.testing.assert_array_equal(found, sharpness(expected))


def test_medians_leave_out_what_is_not_known() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(size=(60, 2))
    values[rng.random(60) < 0.3] = np.nan
    lines = np.where(rng.random((9, 8)) < 0.2, -1, rng.integers(0, 60, (9, 8)))
    found = np.empty((9, 2))
    median_kernel.line_medians(values, lines, 4, found)
    for line, medians in zip(lines, found, strict=True):
        some = values[line[line >= 0]]
        some = np.sort(some[np.isfinite(some[:, 0])], axis=0)
        expected = some[(len(some) - 1) // 2] if len(some) >= 4 else [np.nan, np.nan]
        np.testing.assert_array_equal(medians, expected)
    for count in (1, 2, 7, 60):
        assert median_kernel.median(values[:count, 0]) == pytest.approx(
            np.nanmedian(values[:count, 0]), rel=1e-12, nan_ok=True
        )
    assert np.isnan(median_kernel.median(np.full(3, np.nan)))


def test_pairs_that_part() -> None:
    rng = np.random.default_rng(4)
    motion = rng.normal(size=(len(SITES), 2))
    motion[rng.random(len(SITES)) < 0.1] = np.nan
    near = LATTICE.neighbours[:, :4]
    apart = np.linalg.norm(motion[near] - motion[:, None], axis=2)
    count = ((apart > 1.5) & (near >= 0)).sum() // 2
    assert tear_kernel.strained(motion, LATTICE.neighbours, 1.5) == count > 0


def test_the_division_of_lines_in_two_parts() -> None:
    rng = np.random.default_rng(5)
    for count in (5, 12, 19):
        motion = rng.normal(0, 0.3, (count, 2))
        motion[count // 3 :] += [1.0, -2.0]
        np.testing.assert_allclose(tear_kernel.jump(motion), jump(motion), rtol=1e-9)
    assert tear_kernel.jump(np.full((6, 2), 0.25))[2] == pytest.approx(0.0, abs=1e-12)


def test_size_and_stretch_are_those_of_the_eigenvalues() -> None:
    rng = np.random.default_rng(6)
    axes = rng.normal(size=(2, 30, 2, 2)) + 2 * np.eye(2)
    now, rest = axes @ axes.swapaxes(-1, -2)
    dots = rng.permutation(30)
    dots[:4] = -1
    growth, stretch = np.empty(30), np.empty(30)
    as_rows = [np.stack([m[:, 0, 0], m[:, 0, 1], m[:, 1, 1]], axis=1) for m in (now, rest)]
    whole_kernel.changes(dots, *as_rows, growth, stretch)
    assert np.isnan(growth[:4]).all()
    assert np.isnan(stretch[:4]).all()
    for marker in range(4, 30):
        ratio = np.linalg.eigvals(np.linalg.solve(rest[marker], now[dots[marker]])).real
        assert growth[marker] == pytest.approx(np.log(ratio.prod()) / 2)
        assert stretch[marker] == pytest.approx(abs(np.log(ratio[0] / ratio[1])) / 2)


def test_dots_that_grow_otherwise_than_those_around() -> None:
    rng, near = np.random.default_rng(7), LATTICE.neighbours
    for spread in (0.05, 0.1, 0.3):
        growth = rng.normal(0, spread, len(SITES))
        growth[rng.random(len(SITES)) < 0.1] = np.nan
        around = np.where(near >= 0, growth[near], np.nan)
        around = np.where(np.isnan(around), growth[:, None], around)
        limits = rng.uniform(0.1, 0.2, len(SITES))
        expected = np.abs(growth - np.median(around, axis=1)) > limits
        found = np.empty(len(SITES), dtype=bool)
        whole_kernel.far_from_neighbours(growth, near, limits, found)
        np.testing.assert_array_equal(found, expected)
        assert 0 < expected.sum() < len(SITES) or spread < 0.1


def test_the_strain_about_a_marker_is_the_largest_of_its_own_and_its_neighbours() -> None:
    rng, near = np.random.default_rng(9), LATTICE.neighbours
    rest, now = (np.empty((len(SITES), 3)) for _ in range(2))
    own = np.empty(len(SITES))
    for k in range(len(SITES)):
        root, turned = np.diag(rng.uniform(2, 3, 2)), rng.normal(size=(2, 2)) * 0.2 + np.eye(2)
        before = root @ root
        after = turned @ before @ turned.T
        rest[k], now[k] = (m[[0, 0, 1], [0, 1, 1]] for m in (before, after))
        ratio = np.linalg.eigvals(np.linalg.solve(before, after)).real
        own[k] = max(abs(np.log(ratio.prod())), abs(np.log(ratio[0] / ratio[1]))) / 2
    found = np.empty(len(SITES))
    whole_kernel.strain_about(now, rest, near, found)
    expected = np.maximum(own, np.where(near >= 0, own[near], 0).max(axis=1))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_markers_beside_the_inside_of_a_gap() -> None:
    rng, near = np.random.default_rng(8), LATTICE.neighbours
    there = near[:, :8] >= 0
    seen = 0
    for radius, worn in ((0.0, 0.02), (2.5, 0.02), (4.0, 0.02), (4.0, 0.3)):
        whole = np.hypot(*(SITES - [6, 5]).T) >= radius
        whole &= rng.random(len(SITES)) >= worn
        missing = (there & ~whole[near[:, :8]]).sum(axis=1)
        inside = ~whole & (missing == there.sum(axis=1)) & (missing >= 5)
        expected = ((near >= 0) & inside[near]).any(axis=1)
        if (~whole & (missing < there.sum(axis=1) / 2)).mean() > 0.05:
            expected[:] = False
        found = np.empty(len(SITES), dtype=bool)
        whole_kernel.beside_gap(whole, near, 8, 5, 0.05, found)
        np.testing.assert_array_equal(found, expected)
        seen += expected.sum()
        whole_kernel.beside_lost(whole, near, 8, 2, found)
        np.testing.assert_array_equal(found, missing >= 2)
    assert seen > 20


def test_noise_is_told_by_the_deviation_from_four_neighbours() -> None:
    motion = np.random.default_rng(9).normal(size=(len(SITES), 2))
    motion[[3, 77, 150]] = np.nan
    inner = LATTICE.neighbours[(LATTICE.neighbours[:, :4] >= 0).all(axis=1), :4]
    own = motion[(LATTICE.neighbours[:, :4] >= 0).all(axis=1)]
    off = own - motion[inner].mean(axis=1)
    expected = robust_sigma(off[np.isfinite(off).all(axis=1)]) / np.sqrt(1.25)
    assert noise_px(LATTICE, motion) == pytest.approx(expected, rel=1e-12)
