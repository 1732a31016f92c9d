"""How the noise of the light depends on how much of it there is.

Where a response curve has removed the shot noise of bright pixels, the noise is the same at all
grey values, and the error of a logarithm is proportional to 1 over the level. A linear camera keeps
the shot noise: its square grows with the level. A frame tells which it is by the noise of its
brighter and its darker bins.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Layers = NDArray[np.floating]
_LEAST_RATIO = 1.3
"""Least ratio of the noise of the brighter half of the bins to that of the darker half, both
relative to even noise, for shot noise to be assumed."""
_ROWS, _LEAST_BINS = 8, 40
"""One row of bins in this many is used, and at least so many bins are needed."""


@dataclass(frozen=True, eq=False)
class NoiseLaw:
    """Noise of logarithms of light in bins, up to factors.

    Attributes:
        even: (c, rows, columns) standard deviations by noise that is the same at all levels.
        shot: (c, rows, columns) squares of those by shot noise over those of `even`.
    """

    even: NDArray[np.float32]
    shot: NDArray[np.float32]

    @classmethod
    def of(cls, levels: NDArray[np.float32]) -> NoiseLaw:
        """Of combinations of channels by their levels (c, rows, columns), above 0."""
        even, shot = _combined(1 / np.square(levels)), _combined(1 / levels)
        return cls(np.sqrt(even), shot / even)

    def growth(self, change: Layers, noise: Layers, valid: NDArray[np.bool_]) -> Layers | None:
        """Factors (c, rows, columns) on the noise of a frame, None where it is even.

        Args:
            change: (c, rows, columns) of the light.
            noise: (c, rows, columns) its standard deviations by even noise.
            valid: (rows, columns) bins to use.
        """
        some = valid[::_ROWS]
        rows, columns = np.nonzero(some[:, :-2] & some[:, 1:-1] & some[:, 2:])
        rows *= _ROWS
        if len(rows) < _LEAST_BINS:
            return None
        found = None
        for k, (layer, sigma, shot) in enumerate(zip(change, noise, self.shot, strict=True)):
            # Second differences: a contact changes the light smoothly.
            ends = layer[rows, columns] + layer[rows, columns + 2]
            off = np.abs(ends - 2 * layer[rows, columns + 1]) / sigma[rows, columns + 1]
            even, grown = _fitted(off, shot[rows, columns + 1])
            if grown > 0:
                found = np.ones_like(self.shot) if found is None else found
                found[k] = np.sqrt(even + grown * shot)
        return found


def _fitted(off: Layers, shot: Layers) -> tuple[float, float]:
    """Parts of even and of shot noise in the square of a noise; 1 and 0 without shot noise.

    Args:
        off: (n,) sizes of second differences over that noise.
        shot: (n,) by how much the square of shot noise grows over that of even noise.
    """
    from gelslim_force.contact.baseline_kernel import upper_median

    bright = shot > upper_median(shot)
    if not bright.any():
        return 1.0, 0.0
    above, below, usual = (upper_median(part) ** 2 for part in (off[bright], off[~bright], off))
    far, near = upper_median(shot[bright]), upper_median(shot[~bright])
    if usual == 0 or above < _LEAST_RATIO**2 * below or far <= near:
        return 1.0, 0.0
    grown = min((above - below) / (far - near), above / far)
    return max(above - grown * far, 0.0) / usual, grown / usual


def _combined(squares: NDArray[Any]) -> NDArray[np.float32]:
    """Squares of log R/G, log brightness, and of further channels minus brightness."""
    if len(squares) == 1:
        return squares
    both = squares[:1] + squares[1:2]
    return np.concatenate([both, both / 4, squares[2:] + both / 4])
