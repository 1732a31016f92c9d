"""Motion of the gel where no marker is seen, and where a contact could hide.

The motion of a bonded layer varies over its thickness T. Around a gap it is therefore taken for a
random field of the correlation (1 + √3 r/T) exp(-√3 r/T) (Matérn's, of order 3/2: C. E. Rasmussen
and C. K. I. Williams, "Gaussian processes for machine learning", 2006, section 4.2), whose size is
that of the motion seen around the gap. Its mean, given the markers seen, keeps within their motion
and falls to zero inside the gap, and its covariance grows there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_WIDEST = 1.3
"""Distance of a marker that is not seen from the nearest one seen, over the thickness, beyond which
a contact could hide: the motion around it decays over the thickness."""
_REACH = 2.5
"""Distance, over the thickness, up to which markers tell of the motion in a gap."""
_UNSEEN = 0.02
"""Motion in a gap that markers around it do not show, and depth, over the thickness."""
_HIDDEN = (
    "the markers are not seen over {:.1f} mm of the gel: a contact could hide there, and forces "
    "are not given; clear the camera's view of the gel"
)


@dataclass(frozen=True, eq=False)
class FilledMotion:
    """Motion of all n markers, of which m were not seen.

    Attributes:
        motion_mm: (n, 3), filled in x and y.
        unseen: (m,) indices of the markers not seen.
        covariance_mm2: (m, m) of their motion along x, and the same along y.
    """

    motion_mm: Array
    unseen: NDArray[np.intp]
    covariance_mm2: Array


@dataclass(frozen=True, eq=False)
class UnseenMotion:
    """Gaps among the n followed markers of one sensor.

    Attributes:
        places_mm: (n, 2) markers at rest.
        points_mm: (c, 2) surface nodes at rest.
        thickness_mm: Of the gel.
    """

    places_mm: Array
    points_mm: Array
    thickness_mm: float

    def problem(self, seen: Mask) -> str:
        """Why markers seen (n,) leave too much of the gel unseen; empty if they do not."""
        if seen.all():
            return ""
        if not seen.any():
            return _HIDDEN.format(np.ptp(self.places_mm, axis=0).max())
        widest = float(self._apart[np.ix_(~seen, seen)].min(axis=1).max())
        return _HIDDEN.format(2 * widest) if widest > _WIDEST * self.thickness_mm else ""

    def hidden_mm(self, seen: Mask) -> Array:
        """(c,) depth that markers seen (n,) do not show at the nodes; 0 where they do.

        It counts as common to all nodes. The depth in a gap is correlated as the motion is, so that
        far parts of a gap, and other gaps, are independent: the common depth is that whose sum has
        the same deviation.
        """
        if seen.all():
            return np.zeros(len(self.points_mm))
        hidden = np.flatnonzero(~seen)
        common = np.sqrt(float(self._alike[np.ix_(hidden, hidden)].mean()))
        return np.where(self.nodes(~seen), common * _UNSEEN * self.thickness_mm, 0.0)

    def nodes(self, markers: Mask) -> Mask:
        """(c,) nodes to which one of the chosen markers (n,) is the nearest."""
        return np.asarray(markers[self._nearest])

    def filled(self, motion_mm: Array, seen: Mask, noise_mm: float) -> FilledMotion:
        """Fill in the lateral motion of markers that were not seen.

        Args:
            motion_mm: (n, 3) of the markers.
            seen: (n,) those whose motion is known.
            noise_mm: Standard deviation of their motion.
        """
        unseen = np.flatnonzero(~seen)
        if not len(unseen) or not seen.any():
            return FilledMotion(motion_mm, unseen[:0], np.zeros((0, 0)))
        about = self._apart[unseen].min(axis=0) < _REACH * self.thickness_mm
        near = np.flatnonzero(seen & about)
        known = motion_mm[near, :2]
        unseen_mm = _UNSEEN * self.thickness_mm
        size = float(np.mean(np.square(known))) + unseen_mm**2 if len(near) else unseen_mm**2
        alike = self._alike[unseen]
        prior = size * alike[:, unseen]
        found = motion_mm.copy()
        if not len(near):
            found[unseen, :2] = 0.0
            return FilledMotion(found, unseen, prior)
        own = size * self._alike[np.ix_(near, near)]
        own.flat[:: len(near) + 1] += noise_mm**2 + 1e-9 * size
        cross = size * alike[:, near]
        solved = np.linalg.solve(own, np.column_stack([known, cross.T]))
        found[unseen, :2] = cross @ solved[:, :2]
        left = prior - cross @ solved[:, 2:]
        return FilledMotion(found, unseen, (left + left.T) / 2)

    @cached_property
    def _apart(self) -> Array:
        """(n, n) distances of the markers."""
        gap = self.places_mm[:, None] - self.places_mm[None]
        return np.asarray(np.hypot(gap[..., 0], gap[..., 1]))

    @cached_property
    def _nearest(self) -> NDArray[np.intp]:
        """(c,) the marker nearest to each node."""
        gap = self.points_mm[:, None] - self.places_mm[None]
        return np.asarray(np.argmin(np.square(gap).sum(axis=2), axis=1))

    @cached_property
    def _alike(self) -> Array:
        """(n, n) correlation of the motion of the markers."""
        ratio = np.sqrt(3) * self._apart / self.thickness_mm
        return np.asarray((1 + ratio) * np.exp(-ratio))
