"""Which sites around a seen lattice would lie in the picture, had they a dot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_RIM_PX = 6.0


def seen_sites(
    sites: NDArray[np.int64], points_px: NDArray[np.float64], reach: int, shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Return the sites in view, (rows + 2 reach, columns + 2 reach), site (0, 0) at (reach, reach).

    A homography through the sites (k, 2) seen at `points_px` (k, 2) predicts the others; within
    6 px of the rim of the picture (height, width) nothing is expected.
    """
    rows, columns = sites.max(axis=0) + 1
    table = np.argwhere(np.ones((rows + 2 * reach, columns + 2 * reach), dtype=bool)) - reach
    matrix = fit_homography(sites.astype(float), points_px)
    image = np.column_stack([table, np.ones(len(table))]) @ matrix.T
    depth = image[:, 2]
    ahead = depth > 1e-3 * np.median(np.column_stack([sites, np.ones(len(sites))]) @ matrix[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = image[:, 0] / depth, image[:, 1] / depth
    seen = ahead & (x > _RIM_PX) & (y > _RIM_PX)
    seen &= (x < shape[1] - 1 - _RIM_PX) & (y < shape[0] - 1 - _RIM_PX)
    return seen.reshape(rows + 2 * reach, columns + 2 * reach)


def fit_homography(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) homography from points (k, 2) to points (k, 2), depth positive on them.

    Direct linear transform with normalised coordinates (R. Hartley, "In defense of the
    eight-point algorithm", IEEE TPAMI 19, 1997), algebraic least squares.
    """
    from_, to = _normaliser(source), _normaliser(target)
    s = np.column_stack([source, np.ones(len(source))]) @ from_.T
    t = np.column_stack([target, np.ones(len(target))]) @ to.T
    zero = np.zeros_like(s)
    system = np.vstack(
        [
            np.hstack([s, zero, -t[:, :1] * s]),
            np.hstack([zero, s, -t[:, 1:2] * s]),
        ]
    )
    solution = np.linalg.eigh(system.T @ system)[1][:, 0].reshape(3, 3)
    matrix = np.linalg.inv(to) @ solution @ from_
    depth = np.column_stack([source, np.ones(len(source))]) @ matrix[2]
    result: NDArray[np.float64] = matrix * np.sign(np.median(depth))
    return result


def _normaliser(points: NDArray[np.float64]) -> NDArray[np.float64]:
    middle = points.mean(axis=0)
    size = float(np.sqrt(2) / max(np.hypot(*(points - middle).T).mean(), 1e-12))
    return np.array([[size, 0, -size * middle[0]], [0, size, -size * middle[1]], [0, 0, 1.0]])
