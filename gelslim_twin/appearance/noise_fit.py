"""Level and spectrum of a camera's noise, from small blocks in which nothing else varies.

A single picture cannot tell noise from the texture of the coat. In each range of brightness the
quietest blocks are therefore taken, after a polynomial of second degree is removed from each
block. Differences of two pictures have no texture, and all unchanged blocks serve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
BLOCK_PX = 12
_LEAST_USED = 0.6
"""Share of a block's pixels that must be free of dots."""
_QUIET = 0.3
"""Share of the blocks of one picture that count as free of texture."""
_CHANGED = 3.0
"""Mean difference of an unchanged block, at most, in standard deviations of its mean."""
_RANGES, _LEAST_BLOCKS = 6, 8
_DARK_DN, _BRIGHT_DN = 4, 248
"""Grey values between which the noise is not cut off."""
_UNCORRELATED = 0.06
"""Product of neighbouring residuals over that of white noise, up to which noise is white."""
_APART_PX = (1, 2, 3)
_LEAST_DN2 = 1e-3
_MOST_ELECTRONS = 1e6, 1000.0
"""Largest full well and read noise that a scene may have."""
_ROUNDING = 1 / 12
"""Variance that rounding to whole grey values adds."""
_ALIKE_DN = 0.5


@dataclass(frozen=True)
class FittedNoise:
    """Noise of a camera in linear grey values.

    Attributes:
        read_dn: Standard deviation without light.
        electrons_per_dn: Electrons for a linear grey value.
        grain_px: Standard deviation of the Gaussian filter that gives white noise its correlation.
        correlation: Correlation of pixels 1, 2 and 3 px apart within blocks, less a polynomial.
        grey_dn: Standard deviation in grey values, the median over the blocks.
        blocks: Number of blocks and channels used.
    """

    read_dn: float
    electrons_per_dn: float
    grain_px: float
    correlation: tuple[float, float, float]
    grey_dn: float
    blocks: int


@dataclass(frozen=True, eq=False)
class Blocks:
    """Residuals of n blocks of single channels.

    Attributes:
        residual: (n, b, b) what the polynomial leaves, in grey values; 0 where not used.
        used: (n, b, b) pixels that count.
        level_dn: (n,) mean grey value.
        mean_dn: (n,) mean of the values from which the residuals are.
        freedom: (n,) degrees of freedom.
    """

    residual: Array
    used: Mask
    level_dn: Array
    mean_dn: Array
    freedom: Array

    @property
    def variance(self) -> Array:
        """(n,) unbiased."""
        return np.asarray((self.residual**2).sum(axis=(1, 2)) / self.freedom)

    def take(self, which: NDArray[np.bool_]) -> Blocks:
        """The chosen blocks."""
        return Blocks(*(v[which] for v in vars(self).values()))


def fit_noise(
    picture: NDArray[np.uint8],
    covered: Mask,
    gamma: float,
    others: Sequence[tuple[NDArray[np.uint8], Mask]] = (),
) -> FittedNoise:
    """Fit level and correlation of the noise.

    Args:
        picture: (h, w, c) uint8 at rest.
        covered: (h, w) pixels of dots.
        gamma: Inverse of the exponent of the response.
        others: Further pictures with the pixels of their dots. Where there are any, only
            differences from `picture` are used.

    Raises:
        ValueError: There are too few blocks without dots.
    """
    if others:
        found = _joined([_unchanged(picture, image, covered | mask) for image, mask in others])
    else:
        found = _quiet(blocks_of(picture.astype(float), picture, covered))
    if len(found.level_dn) < _LEAST_BLOCKS:
        raise ValueError("too few even places between the dots to measure the noise")
    from scipy.stats import chi2

    share = found.level_dn / 255
    # d linear / d grey of the response, by which grey noise becomes linear noise.
    slope = gamma * share ** (gamma - 1)
    correlation = _correlation(found)
    grain = _grain(correlation)
    seen, freedom, _ = _expected(grain)
    if not others:
        # The quietest blocks of even noise are below its mean, by its own scatter.
        seen *= float(chi2.ppf(_QUIET / 2, freedom)) / freedom
    grey2 = np.maximum(found.variance / seen - _ROUNDING, _LEAST_DN2)
    variance = grey2 * slope**2
    read2, shot = _line(255 * share**gamma, variance)
    per_dn = 1 / max(shot, 255 / _MOST_ELECTRONS[0])
    read = float(np.sqrt(read2))
    per_dn = min(per_dn, _MOST_ELECTRONS[1] / max(read, 1e-9))
    return FittedNoise(
        read,
        per_dn,
        grain,
        (float(correlation[0]), float(correlation[1]), float(correlation[2])),
        float(np.sqrt(np.median(grey2))),
        len(found.level_dn),
    )


def blocks_of(values: Array, levels: NDArray[np.uint8], covered: Mask) -> Blocks:
    """Blocks of a picture (h, w, c) whose levels (h, w, c) are in the linear range."""
    size = BLOCK_PX
    rows, columns = (n // size for n in values.shape[:2])
    kept = (slice(rows * size), slice(columns * size))

    def cut(planes: NDArray[Any]) -> NDArray[Any]:
        shaped = planes[kept].reshape(rows, size, columns, size, -1)
        return shaped.transpose(0, 2, 4, 1, 3).reshape(-1, size, size)

    channels = values.shape[2]
    free = np.repeat(~covered[..., None], channels, axis=2)
    used = np.asarray(cut(free), dtype=bool)
    level, value = np.asarray(cut(levels), dtype=float), np.asarray(cut(values), dtype=float)
    fine = ((level > _DARK_DN) & (level < _BRIGHT_DN)) | ~used
    chosen = (used.mean(axis=(1, 2)) >= _LEAST_USED) & fine.all(axis=(1, 2))
    used, level, value = used[chosen], level[chosen], value[chosen]
    if not len(used):
        return Blocks(value, used, *(np.zeros(0) for _ in range(3)))
    count = used.sum(axis=(1, 2))
    mean, own = ((v * used).sum(axis=(1, 2)) / np.maximum(count, 1) for v in (level, value))
    terms = _terms()
    design = terms[None] * used.reshape(len(used), -1, 1)
    gram = np.swapaxes(design, 1, 2) @ design
    right = np.swapaxes(design, 1, 2) @ value.reshape(len(value), -1, 1)
    smooth = (terms @ np.linalg.solve(gram, right))[..., 0].reshape(value.shape)
    return Blocks((value - smooth) * used, used, mean, own, count - terms.shape[1])


def _terms() -> Array:
    """(b b, 6) monomials up to the second degree in a block."""
    y, x = (v.ravel() for v in np.mgrid[:BLOCK_PX, :BLOCK_PX] / (BLOCK_PX - 1) * 2 - 1)
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def _quiet(blocks: Blocks) -> Blocks:
    """The quietest share of the blocks of each range of brightness."""
    kept = np.zeros(len(blocks.level_dn), dtype=bool)
    variance = blocks.variance
    for members in _ranges(blocks.level_dn):
        limit = np.quantile(variance[members], _QUIET)
        kept[members] = variance[members] <= limit
    return blocks.take(kept)


def _ranges(level: Array) -> list[NDArray[np.intp]]:
    """Members of ranges of brightness that hold equal numbers."""
    if len(level) == 0:
        return []
    return [m for m in np.array_split(np.argsort(level), min(_RANGES, len(level))) if len(m)]


def _unchanged(one: NDArray[np.uint8], other: NDArray[np.uint8], covered: Mask) -> Blocks:
    """Blocks of the difference over sqrt 2 of two pictures, where both are equal but for noise."""
    apart = (other.astype(float) - one.astype(float)) / np.sqrt(2)
    levels = np.maximum(one, other)
    levels[np.minimum(one, other) <= _DARK_DN] = 0
    found = blocks_of(apart, levels, covered)
    if len(found.level_dn) == 0:
        return found
    spread = np.sqrt(np.maximum(np.median(found.variance), _ROUNDING))
    return found.take(np.abs(found.mean_dn) < max(_CHANGED * spread / BLOCK_PX, _ALIKE_DN))


def _joined(parts: Sequence[Blocks]) -> Blocks:
    return Blocks(
        *(np.concatenate(arrays) for arrays in zip(*(vars(p).values() for p in parts), strict=True))
    )


def _line(level: Array, variance: Array) -> tuple[float, float]:
    """Variance without light and its increase per grey value, neither negative.

    The blocks of each range of brightness count by their median.
    """
    from scipy.optimize import nnls

    members = _ranges(level)
    x = np.array([np.median(level[m]) for m in members])
    y = np.array([np.median(variance[m]) for m in members])
    # The variance of a variance grows as its square.
    found, _ = nnls(np.column_stack([1 / y, x / y]), np.ones(len(y)))
    return float(found[0]), float(found[1])


def _correlation(blocks: Blocks) -> Array:
    """(3,) mean product of normalised residuals 1, 2 and 3 px apart, along rows and columns."""
    scale = np.sqrt(np.maximum(blocks.variance, _ROUNDING))
    residual = blocks.residual / scale[:, None, None]
    found = []
    for apart in _APART_PX:
        products = count = 0.0
        for axis in (1, 2):
            near = [_shifted(v, apart, axis) for v in (residual, blocks.used)]
            products += float((near[0][0] * near[0][1]).sum())
            count += float((near[1][0] & near[1][1]).sum())
        found.append(products / max(count, 1.0))
    return np.array(found)


def _shifted(values: NDArray[Any], apart: int, axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """The values and their neighbours along an axis."""
    first, second = [slice(None)] * 3, [slice(None)] * 3
    first[axis], second[axis] = slice(None, -apart), slice(apart, None)
    return values[tuple(first)], values[tuple(second)]


@cache
def _expected(grain_px: float) -> tuple[float, float, tuple[float, ...]]:
    """What blocks show of noise of a grain after the polynomial is removed.

    Returns:
        Variance over that of the noise; effective degrees of freedom of a block's variance; mean
        products of normalised residuals 1, 2 and 3 px apart.
    """
    y, x = (v.ravel() for v in np.mgrid[:BLOCK_PX, :BLOCK_PX])
    away2 = (y[:, None] - y) ** 2 + (x[:, None] - x) ** 2
    noise = np.exp(-away2 / (4 * grain_px**2)) if grain_px > 0 else np.eye(len(y))
    terms, _ = np.linalg.qr(_terms())
    left = np.eye(len(y)) - terms @ terms.T
    seen = left @ noise @ left
    freedom = len(y) - terms.shape[1]
    variance = float(np.trace(seen)) / freedom
    effective = float(np.trace(seen)) ** 2 / float((seen**2).sum())
    by_place = seen.reshape(4 * (BLOCK_PX,))
    row = np.arange(BLOCK_PX)
    products = []
    for apart in _APART_PX:
        inner = row[:-apart]
        products.append(float(by_place[row[:, None], inner, row[:, None], inner + apart].mean()))
    return variance, effective, tuple(v / variance for v in products)


def _grain(correlation: Array) -> float:
    """Grain whose expected product of neighbours is that seen; 0 for hardly any."""
    grains = np.array([0.0, *np.geomspace(0.3, 3.0, 25)])
    expected = np.array([_expected(float(g))[2][0] for g in grains])
    if correlation[0] < expected[0] + _UNCORRELATED:
        return 0.0
    return float(np.interp(correlation[0], expected, grains))
