"""The compiled looks at lines of a picture and of markers against plain NumPy."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from gelslim_force.detection.detection import as_planes
from gelslim_force.tracking import line_kernel, median_kernel, tear_kernel


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
    side = np.arange(64).reshape(8, 8)
    padded = np.pad(side, 1, constant_values=-1)
    near = np.stack(
        [padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]], axis=-1
    ).reshape(64, 4)
    motion = rng.normal(size=(64, 2))
    motion[rng.random(64) < 0.1] = np.nan
    apart = np.linalg.norm(motion[near] - motion[:, None], axis=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tear_kernel.strained(motion, near, 1.5) == ((apart > 1.5) & (near >= 0)).sum() // 2


def test_the_division_of_lines_in_two_parts() -> None:
    rng = np.random.default_rng(5)
    for count in (5, 12, 19):
        motion = rng.normal(0, 0.3, (count, 2))
        motion[count // 3 :] += [1.0, -2.0]
        np.testing.assert_allclose(tear_kernel.jump(motion), jump(motion), rtol=1e-9)
    assert tear_kernel.jump(np.full((6, 2), 0.25))[2] == pytest.approx(0.0, abs=1e-12)
