"""Compiled sums over windows, rings and components against slow, obvious ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from gelslim_force.detection import component_kernel as ck
from gelslim_force.detection import ring_kernel as rk
from gelslim_force.detection import window_kernel as wk

Array = NDArray[np.float64]
HEIGHT, WIDTH = 60, 90
PLANE = np.array([300.0, 0.8, -0.5])


def picture(rng: np.random.Generator) -> NDArray[np.uint16]:
    """Random light; the columns beyond the width hold what must not be used."""
    return rng.integers(0, 765, (HEIGHT, WIDTH + wk.LANES)).astype(np.uint16)


def around(x0: float, y0: float) -> tuple[Array, Array]:
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    return u - x0, v - y0


def inside(shape: tuple[float, ...], u: Array, v: Array) -> NDArray[np.bool_]:
    return np.asarray(shape[0] * u**2 + 2 * shape[1] * u * v + shape[2] * v**2 <= 1)


def light(u: Array, v: Array) -> Array:
    return np.asarray(PLANE[0] + PLANE[1] * u + PLANE[2] * v)


def places(rng: np.random.Generator, count: int) -> list[Array]:
    """Centres, also near the border, with second moments up to those of a dot of 40 px."""
    found = []
    for _ in range(count):
        long, short = np.sort(rng.uniform(1.0, 10.0, 2))[::-1]
        turn = rng.uniform(0, np.pi)
        c, s = np.cos(turn), np.sin(turn)
        moments = [
            (long * c) ** 2 + (short * s) ** 2,
            (long**2 - short**2) * c * s,
            (long * s) ** 2 + (short * c) ** 2,
        ]
        found.append(np.array([rng.uniform(0, WIDTH - 1), rng.uniform(0, HEIGHT - 1), *moments]))
    return found


def test_an_ellipse_has_the_axes_of_its_moments() -> None:
    """A filled ellipse of semi-axes a and b has the second moments a² / 4 and b² / 4."""
    shape = wk.ellipse(9.0, 0.0, 4.0, 1.5, 2.0)
    assert shape == pytest.approx((1 / 11**2, 0.0, 1 / 8**2, 11.0, 8.0))
    turned = wk.ellipse(6.5, 2.5, 6.5, 1.5, 2.0)
    u = np.array([11.0, 1.0]) / np.sqrt(2)
    assert turned[0] * u[0] ** 2 + 2 * turned[1] * u[0] ** 2 + turned[2] * u[0] ** 2 == (
        pytest.approx(1.0)
    )
    assert turned[3:] == pytest.approx([np.sqrt((11**2 + 8**2) / 2)] * 2)


def test_sums_over_windows_are_those_of_all_pixels() -> None:
    rng = np.random.default_rng(2)
    image, lanes, sums = picture(rng), np.empty(wk.QUANTITIES * wk.LANES, np.float32), np.empty(6)
    low, high = 0.1, 0.7
    for x0, y0, *moments in places(rng, 40):
        window = wk.ellipse(*moments, 1.1, 1.5)
        wk.window_sums(image, WIDTH, x0, y0, window, PLANE, low, high, lanes, sums)
        u, v = around(x0, y0)
        dark = np.where(inside(window, u, v), 1 - image[:, :WIDTH] / light(u, v), 0)
        mass = np.maximum(dark, 0)
        weight = np.clip((dark - low) / (high - low), 0, 1)
        contrast = wk.window_contrast(image, WIDTH, x0, y0, window, PLANE, lanes)
        expected = (mass**2).sum() / mass.sum() if mass.any() else 0.0
        assert contrast == pytest.approx(expected, rel=2e-5)
        parts = (weight, weight * u, weight * v)
        squares = (weight * u**2, weight * u * v, weight * v**2)
        truth = [part.sum() for part in (*parts, *squares)]
        assert sums == pytest.approx(truth, rel=2e-5, abs=2e-5 * np.abs(truth).max())


def test_sums_over_rings_are_those_of_all_pixels() -> None:
    """Around whole pixels, also at the border; the values beyond a ring's pixels do not count."""
    rng, most = np.random.default_rng(3), 70
    image, lanes = picture(rng), np.empty(rk.SUMS * wk.LANES, np.float32)
    size = (2 * most + 1) ** 2 + wk.LANES
    ring_u, ring_v = np.full((2, size), np.nan, np.float32)
    steps, level = np.empty(size, np.int64), np.empty(size, np.int32)
    limits, inside_picture = np.array([-180.0, 250.0]), 0
    for x0, y0, *moments in places(rng, 40):
        x0, y0 = round(x0), round(y0)
        inner, outer = wk.ellipse(*moments, 1.35, 1.5), wk.ellipse(*moments, 1.7, 3.5)
        count = rk.ring_pixels(inner, outer, most, image.shape[1], ring_u, ring_v, steps)
        reach = max(outer[3:])
        count, *levels = rk.ring_light(
            image, WIDTH, x0, y0, reach, ring_u, ring_v, steps, count, level
        )
        assert count % wk.LANES == 0
        u, v = around(x0, y0)
        ring = inside(outer, u, v) & ~inside(inner, u, v)
        values = image[:, :WIDTH][ring].astype(np.int64)
        assert levels == [len(values), values.sum(), (values**2).sum()]
        off = image[:, :WIDTH] - light(u, v)
        keep = ring & (off > limits[0]) & (off < limits[1])
        parts = (1 + 0 * u, u, v, u * u, u * v, v * v, off, u * off, v * off, off**2)
        truth = [part[keep].sum() for part in parts]
        found = rk.ring_sums(ring_u, ring_v, level, count, PLANE, limits, lanes)
        assert found[0] == truth[0]
        assert found == pytest.approx(truth, rel=2e-5, abs=2e-6 * np.abs(truth).max())
        inside_picture += min(x0, y0, WIDTH - 1 - x0, HEIGHT - 1 - y0) >= reach
    assert 0 < inside_picture < 40


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6])
def test_components_are_those_of_scipy(share: float) -> None:
    """Random pixels, a share of them dark; then at a higher level within the large ones only."""
    rng = np.random.default_rng(int(100 * share))
    dark = np.asarray(rng.uniform(-1, 1, (HEIGHT, WIDTH)) + 2 * share - 1, np.float32)
    table, runs, owner = ck.components(dark, ck.whole_rows(HEIGHT, WIDTH), 0.0)
    compare(dark, dark > 0, table)
    large = table[:, ck.AREA] > 4
    again, _, _ = ck.components(dark, runs[large[owner]], 0.3)
    within = np.zeros(dark.shape, dtype=bool)
    for y, begin, end in runs[large[owner]]:
        within[y, begin:end] = True
    assert np.array_equal(within.sum(), table[large, ck.AREA].sum())
    compare(dark, within & (dark > np.float32(0.3)), again)


def compare(dark: NDArray[np.float32], mask: NDArray[np.bool_], table: Array) -> None:
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    assert len(table) == count
    every = np.arange(1, count + 1)
    y, x = np.mgrid[: dark.shape[0], : dark.shape[1]].astype(float)
    mass = ndimage.sum(dark, labels, every)
    columns = {
        ck.AREA: ndimage.sum(mask, labels, every),
        ck.PEAK: ndimage.maximum(dark, labels, every),
        ck.X: ndimage.sum(dark * x, labels, every) / mass,
        ck.Y: ndimage.sum(dark * y, labels, every) / mass,
        ck.LEFT: ndimage.minimum(x, labels, every),
        ck.RIGHT: ndimage.maximum(x, labels, every),
        ck.TOP: ndimage.minimum(y, labels, every),
        ck.BOTTOM: ndimage.maximum(y, labels, every),
    }
    columns[ck.XX] = ndimage.sum(dark * x * x, labels, every) / mass - columns[ck.X] ** 2
    columns[ck.XY] = ndimage.sum(dark * x * y, labels, every) / mass
    columns[ck.XY] -= columns[ck.X] * columns[ck.Y]
    columns[ck.YY] = ndimage.sum(dark * y * y, labels, every) / mass - columns[ck.Y] ** 2
    truth = np.column_stack([columns[k] for k in range(ck.COLUMNS)])
    mine, theirs = (
        t[np.lexsort((t[:, ck.LEFT], t[:, ck.TOP], t[:, ck.X]))] for t in (table, truth)
    )
    assert np.allclose(mine, theirs, rtol=1e-6, atol=2e-3)
