"""Which of the tracked dots are seen whole.

Something that covers a part of the picture cuts the dots at its rim, and the centre of what is left
of a dot is another one. Such a dot has another size or shape than at rest, or it stands beside dots
that are not seen at all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracker import TrackedFrame

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_LARGEST_CHANGE = 0.4
"""Of the logarithm of a dot's size against most others, and of its longer over its shorter axis:
strain and tilt of the gel seldom change them by more."""
_COVERED = 0.15
"""Of the logarithm of a dot's size against the dots around it: dirt over a part of it, whose centre
is then off by up to half a pixel. A press to 30 % of the thickness changes it by up to 0.08, noise
by 0.05."""
_NEXT, _LEAST_MISSING = 8, 5
"""Neighbours of a marker one site away, and how many are missing, with all others, inside a gap.
Gaps of single dots are wear of the print, which leaves the dots beside them whole."""
_WORN = 0.05
"""Share of such single dots from which wide gaps are taken for wear too."""


@dataclass(frozen=True, eq=False)
class WholeDots:
    """Finds the dots that are seen whole.

    Attributes:
        reference: The n markers at rest.
        rest_px2: (n, 3) second moments (xx, xy, yy) of their dots.
    """

    reference: ReferenceLattice
    rest_px2: Array

    def of(self, tracked: TrackedFrame) -> TrackedFrame:
        """The frame with the dots that are tracked but not whole taken for rejected."""
        growth, stretch = self.changes(tracked)
        seen = tracked.tracks.tracked
        if not seen.any():
            return tracked
        with np.errstate(invalid="ignore"):
            change = np.maximum(np.abs(growth - np.nanmedian(growth)), stretch)
            whole = change < _LARGEST_CHANGE
            covered = np.abs(growth - self._around(growth)) > _COVERED
        whole &= ~self._beside_gap(whole) & ~covered
        cut = seen & ~whole
        return replace(tracked, tracks=tracked.tracks.without(cut)) if cut.any() else tracked

    def changes(self, tracked: TrackedFrame) -> tuple[Array, Array]:
        """Logarithms (n,) of size and stretch of the dots over those at rest; NaN if not seen."""
        seen = np.flatnonzero(tracked.tracks.tracked)
        now, rest = tracked.detections.moments_px2[tracked.tracks.dots[seen]], self.rest_px2[seen]
        # The eigenvalues of now / rest follow from the determinants and the mixed product.
        mixed = now[:, 0] * rest[:, 2] + now[:, 2] * rest[:, 0] - 2 * now[:, 1] * rest[:, 1]
        product = np.maximum(_determinant(now) / _determinant(rest), 1e-12)
        ratio = mixed / (2 * _determinant(rest)) / np.sqrt(product)
        growth, stretch = (np.full(len(self.reference), np.nan) for _ in range(2))
        growth[seen], stretch[seen] = np.log(product) / 2, np.arccosh(np.maximum(ratio, 1.0))
        return growth, stretch

    def _around(self, growth: Array) -> Array:
        """(n,) median of the growth of the dots around each."""
        near = self.reference.neighbours
        around = np.where(near >= 0, growth[near], growth[:, None])
        around = np.where(np.isnan(around), growth[:, None], around)
        around.sort(axis=1)
        middle = around.shape[1] // 2
        return np.asarray((around[:, middle - 1] + around[:, middle]) / 2)

    def _beside_gap(self, whole: Mask) -> Mask:
        """(n,) markers within two sites of the inside of a gap."""
        near = self.reference.neighbours
        next_to = near[:, :_NEXT]
        missing = ((next_to >= 0) & ~whole[next_to]).sum(axis=1)
        there = (next_to >= 0).sum(axis=1)
        if (~whole & (missing < there / 2)).mean() > _WORN:
            return np.zeros_like(whole)
        inside = ~whole & (missing == there) & (missing >= _LEAST_MISSING)
        return np.asarray(((near >= 0) & inside[near]).any(axis=1))


def _determinant(moments: Array) -> Array:
    return np.asarray(moments[:, 0] * moments[:, 2] - moments[:, 1] ** 2)
