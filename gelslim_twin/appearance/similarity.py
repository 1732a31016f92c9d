"""How alike two pictures are, in figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SPREAD_PX = 1.5
_STABLE = (0.01 * 255) ** 2, (0.03 * 255) ** 2


def similarity_map(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> Array:
    """Structural similarity (h, w) around each pixel, in the mean of the channels.

    Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to
    structural similarity", IEEE Transactions on Image Processing 13 (2004): Gaussian window with
    a standard deviation of 1.5 px, K1 = 0.01, K2 = 0.03.

    Args:
        one: (h, w) or (h, w, 3) uint8.
        other: Of the same shape.

    Raises:
        ValueError: The shapes differ.
    """
    from scipy.ndimage import gaussian_filter

    if one.shape != other.shape:
        raise ValueError(f"pictures of {one.shape} and {other.shape}: must have the same shape")
    spread = (SPREAD_PX, SPREAD_PX, 0)[: one.ndim]
    a, b = one.astype(float), other.astype(float)
    mean_a, mean_b = (gaussian_filter(v, spread, truncate=3.5) for v in (a, b))
    own_a, own_b, common = (
        gaussian_filter(u * v, spread, truncate=3.5) - s * t
        for u, v, s, t in ((a, a, mean_a, mean_a), (b, b, mean_b, mean_b), (a, b, mean_a, mean_b))
    )
    first, second = _STABLE
    found = (2 * mean_a * mean_b + first) * (2 * common + second)
    found /= (mean_a**2 + mean_b**2 + first) * (own_a + own_b + second)
    return np.asarray(found if found.ndim == 2 else found.mean(axis=2))


def similarity(
    one: NDArray[np.uint8], other: NDArray[np.uint8], mask: NDArray[np.bool_] | None = None
) -> float:
    """Mean structural similarity, of the pixels of a mask (h, w) where one is given."""
    found = similarity_map(one, other)
    return float(found.mean() if mask is None else found[mask].mean())


def profile_error_dn(
    one: NDArray[np.uint8], other: NDArray[np.uint8], mask: NDArray[np.bool_]
) -> Array:
    """(c,) root mean square difference of the mean rows and columns in a mask (h, w), in grey."""
    weight = mask.astype(float)
    planes = [np.atleast_3d(v).astype(float) for v in (one, other)]
    squares = []
    for axis in (0, 1):
        size = weight.sum(axis=axis)
        used = size >= 0.2 * size.max()
        means = [(v * weight[..., None]).sum(axis=axis)[used] / size[used, None] for v in planes]
        squares.append((means[0] - means[1]) ** 2)
    return np.asarray(np.sqrt(np.concatenate(squares).mean(axis=0)))
