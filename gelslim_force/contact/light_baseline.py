"""The change of light where nothing touches the gel: its level, its trend over the pad, its noise.

Lamps that age or warm up change the level of a colour, and one that moves a little changes its
fall-off over the pad. Both are slow over the pad and leave the steps at a contact as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Layers = NDArray[np.floating]
Mask = NDArray[np.bool_]
_SAMPLE = 1500
_LEAST_TREND = 0.5
"""Difference of the medians of two halves of the pad, over the spread, from which a trend is taken
off. A contact of a tenth of the pad makes an eighth, noise a ninth."""
_THINNED = 3
_ROUNDS = 6
_LEAST_SPREAD = 1e-4
ROBUST = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def without_baseline(change: Layers, valid: Mask, noise_level: Layers) -> Layers:
    """Take the median over the pad, and a plane where there is one, off each layer in place.

    Args:
        change: (c, rows, columns); it becomes 0 where not valid.
        valid: (rows, columns) bins to use.
        noise_level: (c, rows, columns) standard deviations up to a factor per layer.

    Returns:
        (c, rows, columns) standard deviation of each bin; infinite without valid bins.
    """
    used = np.flatnonzero(valid)
    if not len(used):
        change[:] = 0.0
        return np.full_like(change, np.inf)
    some = used[:: max(1, len(used) // _SAMPLE)]
    seen, scale = (a.reshape(len(change), -1)[:, some] for a in (change, noise_level))
    middle, spread = _middle_and_spread(seen, scale)
    steep = _has_trend(seen, spread, scale, np.divmod(some, valid.shape[1]))
    if steep.any():
        places = _places(valid.shape, some)
        plane = _planes(seen[steep], scale[steep], places).astype(change.dtype)
        # Two axes of the picture instead of a place for each of its bins.
        y, x = (np.linspace(-1, 1, n, dtype=change.dtype) for n in valid.shape)
        change[steep] -= plane[:, 1, None, None] * x + plane[:, 2, None, None] * y[:, None]
        seen = change.reshape(len(change), -1)[:, some]
        middle, spread = _middle_and_spread(seen, scale)
    change -= middle[:, :, None]
    change *= valid
    return np.maximum(spread[:, :, None] * noise_level, _LEAST_SPREAD)


def _middle_and_spread(seen: Layers, scale: Layers) -> tuple[Layers, Layers]:
    """(c, 1) medians of rows (c, n), and standard deviations over those of `scale`."""
    from gelslim_force.contact.baseline_kernel import middle_and_spread

    middle, spread = np.empty((2, len(seen), 1), dtype=seen.dtype)
    middle_and_spread(seen, scale, ROBUST, middle, spread)
    return middle, spread


def _places(shape: tuple[int, ...], some: NDArray[np.intp]) -> NDArray[np.float64]:
    """(3, n) one, and columns and rows from -1 to 1, of bins by their numbers."""
    row, column = np.divmod(some, shape[1])
    across, down = (2 * k / (n - 1) - 1 for k, n in ((column, shape[1]), (row, shape[0])))
    return np.stack([np.ones(len(some)), across, down])


def _has_trend(
    seen: Layers, spread: Layers, scale: Layers, places: tuple[NDArray[np.intp], ...]
) -> Mask:
    """(c,) layers whose medians in opposite halves of the pad differ, by a part of the bins.

    Args:
        seen: (c, n).
        spread: (c, 1) standard deviation over `scale`.
        scale: (c, n).
        places: Rows and columns (n,) of the bins.
    """
    from gelslim_force.contact.baseline_kernel import halves_differ

    found = np.zeros(len(seen), dtype=bool)
    thin = slice(None, None, _THINNED)
    some, scale = (np.ascontiguousarray(a[:, thin]) for a in (seen, scale))
    for place in places:
        halves_differ(some, spread, scale, place[thin], _LEAST_TREND, found)
    return found


def _planes(seen: Layers, scale: Layers, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(c, 3) planes with the least sum of absolute residuals, which a contact hardly tilts.

    By least squares whose weights are the inverse residuals (E. J. Schlossmacher, "An iterative
    technique for absolute deviations curve fitting", J. Am. Stat. Assoc. 68, 1973).
    """
    weight = 1 / np.square(scale.astype(float))
    least = 1e-3 * np.ptp(seen, axis=1, keepdims=True) / scale
    for _ in range(_ROUNDS):
        gram = np.einsum("cn,in,jn->cij", weight, places, places, optimize=True)
        pull = np.einsum("cn,in,cn->ci", weight, places, seen, optimize=True)
        plane = np.linalg.solve(gram + 1e-12 * np.trace(gram[0]) * np.eye(3), pull[..., None])
        left = np.abs(seen - plane[..., 0] @ places) / scale
        weight = 1 / (np.maximum(left, least) * np.square(scale))
    return np.asarray(plane[..., 0])
