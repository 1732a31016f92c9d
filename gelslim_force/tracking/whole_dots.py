"""Which of the tracked dots are seen whole.

Something that covers a part of the picture cuts the dots at its rim, and the centre of what is left
of a dot is another one. Such a dot has another size or shape than the gel gives it, or it stands
beside dots that are not seen at all. The gel strains the dots as it moves the markers around them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.read_only import read_only
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracker import TrackedFrame

Array = NDArray[np.float64]
_LARGEST_CHANGE = 0.4
"""Of the logarithm of a dot's size against most others, and of its longer over its shorter axis,
beyond those of the strain: where small balls shear the gel until they slip it is 0.25."""
_COVERED = 0.15
"""Of the logarithm of a dot's size against the dots around it: dirt over a part of it, whose centre
is then off by up to half a pixel. By noise it is 0.05. Strain that varies from dot to dot gives up
to 0.15 under balls and 0.4 under rings and rims, at 30 % of the thickness; the largest strain that
the motion of the markers shows around a dot is therefore added to the limit."""
_NEXT, _LEAST_MISSING = 8, 5
"""Neighbours of a marker one site away, and how many are missing, with all others, inside a gap.
Gaps of single dots are wear of the print, which leaves the dots beside them whole."""
_CUT, _CUT_OVER_USUAL, _LEAST_LOST = 0.08, 4.0, 2
"""Change of size or shape by which something out of focus cuts a dot beside others that it hides,
which moves its centre by a pixel, also over that of most dots, and how many of the eight neighbours
it has to hide. Dirt that covers a part of single dots does not count."""
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
        from gelslim_force.tracking import whole_kernel as wk
        from gelslim_force.tracking.median_kernel import median

        seen, near = tracked.tracks.tracked, self.reference.neighbours
        if not seen.any():
            return tracked
        covered, beside, lost = (np.empty_like(seen) for _ in range(3))
        change, whole = np.full(len(seen), np.nan), np.zeros_like(seen)
        # Blur hides a part of the strain, and strain varies between the markers: a dot has to
        # agree with one of the two only.
        expected = self._strained(tracked)
        limits = np.empty(len(seen))
        wk.strain_about(expected, self.rest_px2, near, limits)
        limits += _COVERED
        for growth, stretch in (self.changes(tracked), self._changes(tracked, expected)):
            # Comparisons with the NaN of a dot that is not seen are false: it is not whole.
            now = np.maximum(np.abs(growth - median(growth)), stretch)
            wk.far_from_neighbours(growth, near, limits, covered)
            whole |= (now < _LARGEST_CHANGE) & ~covered
            change = np.fmin(change, now)
        wk.beside_gap(whole, near, _NEXT, _LEAST_MISSING, _WORN, beside)
        wk.beside_lost(seen, near, _NEXT, _LEAST_LOST, lost)
        changed = change > max(_CUT, _CUT_OVER_USUAL * median(change))
        cut = seen & (~whole | beside | (changed & lost))
        return replace(tracked, tracks=tracked.tracks.without(cut)) if cut.any() else tracked

    def changes(self, tracked: TrackedFrame) -> tuple[Array, Array]:
        """Logarithms (n,) of size and stretch of the dots over those at rest; NaN if not seen."""
        return self._changes(tracked, self.rest_px2)

    def beyond_strain(self, tracked: TrackedFrame) -> tuple[Array, Array]:
        """The same over the dots at rest with the strain that the markers around them show."""
        return self._changes(tracked, self._strained(tracked))

    def _strained(self, tracked: TrackedFrame) -> Array:
        """Second moments (n, 3) of the dots at rest with the strain of the markers around them."""
        from gelslim_force.tracking.whole_kernel import strained

        expected = np.empty_like(self.rest_px2)
        places, near = self.reference.positions_px, self.reference.neighbours
        motion = read_only(tracked.tracks.displacement_px)
        strained(places, motion, near, _NEXT, self.rest_px2, expected)
        return expected

    def _changes(self, tracked: TrackedFrame, moments_px2: Array) -> tuple[Array, Array]:
        from gelslim_force.tracking.whole_kernel import changes

        growth, stretch = np.empty(len(self.reference)), np.empty(len(self.reference))
        moments = tracked.detections.moments_px2
        changes(tracked.tracks.dots, moments, moments_px2, growth, stretch)
        return growth, stretch
