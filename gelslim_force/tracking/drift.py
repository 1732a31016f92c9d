"""Drift of the marker picture: shift, rotation and scale where the gel is free.

Creep of the silicone, warming up and a knock move the camera against the gel. All markers then
move together, which the stiffness would take for a load on the whole surface. A similarity of the
picture, d = t + z x in complex notation, is fitted to the markers that nothing touches. Away from
a contact the motion of a bonded layer decays over about its thickness, so that those markers are
found by their residual alone: Tukey's biweight with a width that shrinks from step to step
(graduated non-convexity, A. Blake and A. Zisserman, "Visual reconstruction", 1987), from the last
known drift and, if that explains few markers, from the least squares of all.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.lattice.reference_lattice import ReferenceLattice

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_CUT_SIGMAS = 4.0
"""Largest residual of a free marker; one of 3000 is larger by noise alone."""
LEAST_NOISE_PX = 0.02
"""Errors of the dots' centres that do not vary from marker to marker as noise does."""
_UNEVEN_PX = 0.001
"""Error of a shift by fractions of a pixel, common to all dots."""
_WIDEST = 16.0
"""First width of the fit over the last one, from the last known drift."""
_WIDEST_MEDIANS = 4.0
"""First width over the median residual, from the least squares of all markers."""
_EXPLAINED = 0.2
"""Share of the markers that the last known drift must explain; otherwise another start is tried.
It is small, because a flat object moves most markers as one piece."""
_LEAST_FREE = 20
_LEAST_SHARE = 0.06
_NEIGHBOURS_MOVED = 3
"""Markers within two sites that must move too: one alone is mistaken, not touched."""
_LEAK = 0.12
"""Mean motion of the free markers by the load itself, over the width of the fit, where few of the
markers that are not touched are free. It is that of discs of 2 to 6 mm that push and shear."""


@dataclass(frozen=True)
class Similarity:
    """Shift, rotation and scale of a picture.

    Attributes:
        shift_px: Shift at the middle of the markers, x + i y.
        growth: Scale and rotation: 1 + growth is the factor of the complex plane about the middle.
    """

    shift_px: complex = 0j
    growth: complex = 0j

    @classmethod
    def of(cls, vector: Array) -> Similarity:
        """From (4,) shift x, shift y, scale and rotation, in the order of `FarField.basis`."""
        x, y, scale, turn = vector.tolist()
        return cls(complex(x, y), complex(scale, turn))

    @property
    def vector(self) -> Array:
        """(4,) shift x, shift y, and the real and imaginary part of the growth."""
        shift, growth = self.shift_px, self.growth
        return np.array([shift.real, shift.imag, growth.real, growth.imag])

    @property
    def rotation_deg(self) -> float:
        """Rotation from x to y."""
        return math.degrees(cmath.phase(1 + self.growth))

    @property
    def scale(self) -> float:
        """1 where the picture keeps its size."""
        return float(abs(1 + self.growth))

    def minus(self, other: Similarity) -> Similarity:
        """What remains of this one after another."""
        growth = (1 + self.growth) / (1 + other.growth) - 1
        return Similarity(self.shift_px - (1 + growth) * other.shift_px, growth)


@dataclass(frozen=True, eq=False)
class Drift:
    """Drift of the n markers of a frame.

    Attributes:
        similarity: As fitted to the free markers.
        free: (n,) markers that were seen and that nothing touches.
        weights: (n,) of the fit; 0 where not free.
        touched: (n,) markers that are known and that a load moves.
        leak_px: Standard deviation of the shift by what a load moves the free markers, and by
            errors that all dots have in common.
        residual_px: Root mean square of the free markers' residual, per coordinate.
    """

    similarity: Similarity
    free: Mask
    weights: Array
    touched: Mask
    leak_px: float
    residual_px: float

    @property
    def untouched(self) -> bool:
        """Whether no marker is moved by a load."""
        return not bool(self.touched.any())


class FarField:
    """Fits the drift of frames of one sensor.

    Args:
        reference: The n markers at rest.
    """

    def __init__(self, reference: ReferenceLattice) -> None:
        places = reference.positions_px
        self._middle = places.mean(axis=0)
        self._arms = places - self._middle
        self._near = reference.neighbours

    @cached_property
    def basis(self) -> Array:
        """(n, 2, 4) motion in px per unit of shift x, shift y, scale and rotation."""
        x, y = self._arms.T
        one, none = np.ones_like(x), np.zeros_like(x)
        return np.stack(
            [np.column_stack([one, none, x, -y]), np.column_stack([none, one, y, x])], axis=1
        )

    @cached_property
    def arm_px(self) -> float:
        """Root mean square distance of the markers from their middle."""
        return float(np.sqrt((self._arms**2).sum(axis=1).mean()))

    def motion_px(self, similarity: Similarity) -> Array:
        """(n, 2) motion of the markers at rest."""
        return np.asarray(self.basis @ similarity.vector)

    def without(self, positions_px: Array, similarity: Similarity) -> Array:
        """Positions (n, 2) as they would be without the drift; NaN stays NaN."""
        back = 1 / (1 + similarity.growth)
        arms = positions_px - (self._middle + similarity.vector[:2])
        turn = np.array([[back.real, back.imag], [-back.imag, back.real]])
        return np.asarray(self._middle + arms @ turn)

    def fitted(
        self, displacement_px: Array, tracked: Mask, noise_px: float, start: Similarity
    ) -> Drift | None:
        """Fit the drift of a frame.

        Args:
            displacement_px: (n, 2) motion of the markers from rest; NaN where unknown.
            tracked: (n,) markers that were seen.
            noise_px: Standard deviation of one coordinate of a marker.
            start: The last known drift.

        Returns:
            The drift; None where too few markers are free.
        """
        from gelslim_force.tracking import drift_kernel as dk

        motion, arms = np.asarray(displacement_px), self._arms
        seen = np.asarray(tracked & np.isfinite(motion[:, 0] + motion[:, 1]))
        if seen.sum() < _LEAST_FREE:
            return None
        width = _CUT_SIGMAS * max(noise_px, LEAST_NOISE_PX)
        fit = start.vector
        far = dk.descend(motion, arms, seen, width, _WIDEST * width, _LEAST_FREE, fit)
        if far > 1 - _EXPLAINED:
            other, off = fit.copy(), np.empty(len(seen))
            dk.least_squares(motion, arms, seen.astype(float), other)
            dk.residuals(motion, arms, seen, other, off)
            widest = _WIDEST_MEDIANS * float(np.median(off[seen]))
            if dk.descend(motion, arms, seen, width, widest, _LEAST_FREE, other) < far:
                fit = other
        return self._free_fit(motion, seen, width, fit)

    def _free_fit(self, motion: Array, seen: Mask, width: float, fit: Array) -> Drift | None:
        """Least squares of the markers that are free by a first fit (4,)."""
        from gelslim_force.tracking import drift_kernel as dk

        off, weights = np.empty(len(seen)), np.empty(len(seen))
        free, touched = np.empty_like(seen), np.empty_like(seen)
        dk.residuals(motion, self._arms, seen, fit, off)
        rim = dk.free_markers(off, self._near, width, _NEIGHBOURS_MOVED, touched, free)
        count = int(free.sum())
        if count < max(_LEAST_FREE, _LEAST_SHARE * len(seen)):
            return None
        off[~free] = np.nan
        dk.biweights(off, 2 * width, weights)
        dk.least_squares(motion, self._arms, weights, fit)
        dk.residuals(motion, self._arms, free, fit, off)
        return Drift(
            similarity=Similarity.of(fit),
            free=free,
            weights=weights,
            touched=touched,
            leak_px=math.hypot(_LEAK * width * rim / (rim + count), _UNEVEN_PX),
            residual_px=float(np.sqrt((off[free] ** 2).mean() / 2)),
        )

    def solution(self, drift: Drift) -> Array:
        """(4, n, 2) by which the fit depends on the motion of each marker, its weights fixed."""
        from gelslim_force.tracking import drift_kernel as dk

        found = np.empty((4, *self._arms.shape))
        dk.solution(self._arms, drift.weights, found)
        return found
