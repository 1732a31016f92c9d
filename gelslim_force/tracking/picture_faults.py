"""Faults of the picture's rows and columns: frozen ones, and a picture of two parts.

A camera that loses data repeats the last row, or goes on with another part of the picture. The
latter leaves a sharp edge across the whole picture. It also moves all markers on one side of a line
by the same vector, within one pitch; the motion of a gel falls off over its thickness instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.lattice.reference_lattice import ReferenceLattice

Array = NDArray[np.float64]
_LONGEST_RUN = 1.6
"""Equal rows one after the other, over the pitch: so many always meet dots."""
_SAMPLES = 128
"""Pixels of a row that are looked at."""
_PARTS = 8
"""Parts of a row, of which most must be sharp."""
_SHARPEST = 1.8
"""Sharpness of one line over that of the fourth sharpest: pictures of gels have lines alike, and
those compressed in blocks have many sharp ones."""
_LEAST_SHARP = 15
"""Bend of the grey values, summed over the colours, below which no line is sharp."""
_MOST_STRAIN, _FEW_STRAINED = 0.5, 4
"""Motion of a marker against its neighbour, over their distance, and pairs that may exceed it."""
_LEAST_JUMP = 0.06
"""Motion of one part against the other, over the pitch."""
_LEAST_EXPLAINED = 0.9
"""Share of the motion of the lines of markers that a jump explains."""
_LEAST_STEEP = 0.8
"""Share of the jump that happens between two lines of markers."""
_LEAST_LINES, _LEAST_IN_LINE = 5, 4
_LARGEST_GROWTH, _FEW_GROWN = 0.08, 2
"""Change of the logarithm of the dots' size in most of a line, against that of all, and lines with
such a change: contacts change single dots by more and lines by a quarter of this."""
_FROZEN = (
    "{count} {lines} of the picture are the same: the camera, its cable or its driver has a fault"
)
_EDGE = (
    "a sharp edge crosses the whole picture along one of its {lines}: the camera has lost a part "
    "of the frame, or something covers it"
)
_STRAINED = (
    "{count} neighbouring markers have moved against each other by more than half of their "
    "distance, which the gel cannot do: the picture shows something else, or is torn"
)
_OTHER_SIZES = (
    "whole lines of dots have other sizes than at rest: the picture consists of parts that do not "
    "belong together, or shows another part of the gel"
)
_TORN = (
    "the picture consists of two parts that are {jump:.1f} px apart: the camera has lost a part of "
    "the frame"
)


@dataclass(frozen=True, eq=False)
class PictureFaults:
    """Looks for faults in the pictures of one sensor.

    Attributes:
        reference: The n markers at rest.
    """

    reference: ReferenceLattice

    def broken(self, image: NDArray[np.uint8]) -> str:
        """What is wrong with the rows or columns of a picture (h, w) or (h, w, 3).

        Empty if nothing is.
        """
        (left, top), (right, bottom) = self._box
        part: Any = image[top:bottom, left:right]
        for lines, turned in (("rows", part), ("columns", part.swapaxes(0, 1))):
            some = _grey(turned[:, :: max(1, turned.shape[1] // _SAMPLES)])
            count = _longest_run(some)
            if count > _LONGEST_RUN * self._pitch_px:
                return _FROZEN.format(count=count, lines=lines)
            if _sharpest(some) > _SHARPEST:
                return _EDGE.format(lines=lines)
        return ""

    def torn(self, displacement_px: Array, growth: Array) -> str:
        """Why the markers are those of a picture in two parts; empty if they are not.

        Args:
            displacement_px: (n, 2) motion of the markers; NaN for those not seen.
            growth: (n,) logarithm of the size of their dots over that at rest; NaN likewise.
        """
        count = self._strained(displacement_px)
        if count > _FEW_STRAINED:
            return _STRAINED.format(count=count)
        usual = float(np.nanmedian(growth)) if np.isfinite(growth).any() else 0.0
        for lines in self._lines:
            off = np.abs(_medians(growth, lines) - usual)
            if (off > _LARGEST_GROWTH).sum() >= _FEW_GROWN:
                return _OTHER_SIZES
            x, y = (_medians(displacement_px[:, k], lines) for k in (0, 1))
            motion = np.column_stack([x, y])
            jump = _jump_px(motion[np.isfinite(x)])
            if jump > _LEAST_JUMP * self._pitch_px:
                return _TORN.format(jump=jump)
        return ""

    def _strained(self, displacement_px: Array) -> int:
        """Number of pairs of direct neighbours that moved against each other too far."""
        near = self.reference.neighbours[:, :4]
        apart = displacement_px[near] - displacement_px[:, None]
        far = np.square(apart).sum(axis=2) > (_MOST_STRAIN * self._pitch_px) ** 2
        return int((far & (near >= 0)).sum()) // 2

    @cached_property
    def _pitch_px(self) -> float:
        return float(np.median(self.reference.pitch_px))

    @cached_property
    def _box(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Corners of the part of the picture that has markers."""
        places = self.reference.positions_px
        first, last = places.min(axis=0).astype(int), places.max(axis=0).astype(int) + 1
        return (first[0], first[1]), (last[0], last[1])

    @cached_property
    def _lines(self) -> tuple[NDArray[np.int64], ...]:
        """For both axes of the lattice (lines, markers of a line) indices, -1 for none."""
        return tuple(_table(self.reference.sites, axis) for axis in (0, 1))


def _table(sites: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    at = sites - sites.min(axis=0)
    table = np.full(tuple(at.max(axis=0) + 1), -1, dtype=np.int64)
    table[tuple(at.T)] = np.arange(len(sites))
    return table if axis == 0 else np.ascontiguousarray(table.T)


def _medians(values: Array, lines: NDArray[np.int64]) -> Array:
    """(lines,) lower medians of values (n,); NaN for lines with few values that are not NaN."""
    ranked = np.sort(np.where(lines >= 0, values[lines], np.nan), axis=1)
    count = np.isfinite(ranked).sum(axis=1)
    middle = ranked[np.arange(len(lines)), np.maximum(count - 1, 0) // 2]
    return np.where(count >= _LEAST_IN_LINE, middle, np.nan)


def _grey(part: Any) -> Any:
    """Sum of the colours of a part (h, w) or (h, w, 3) of a picture."""
    if part.ndim == 2 or part.shape[2] < 3:
        return part.reshape(*part.shape[:2], -1)[..., 0].astype(np.int16)
    return part[..., 0].astype(np.int16) + part[..., 1] + part[..., 2]


def _longest_run(rows: Any) -> int:
    """Number of equal rows one after the other."""
    same = (rows[1:] == rows[:-1]).all(axis=1)
    ends = np.flatnonzero(~np.concatenate([[False], same, [False]]))
    return int(np.diff(ends).max())


def _sharpest(rows: Any) -> float:
    """How sharp the sharpest row is, over most of its length, against the fourth sharpest."""
    steps = np.diff(rows, axis=0)
    bends = np.abs(2 * steps[1:-1] - steps[:-2] - steps[2:])
    length = bends.shape[1] // _PARTS
    parts = bends[:, : length * _PARTS].reshape(len(bends), _PARTS, length).sum(axis=2)
    ranked = np.sort(np.sort(parts, axis=1)[:, _PARTS // 3])
    return float(ranked[-1] / max(ranked[-4], _LEAST_SHARP * length))


def _jump_px(motion: Array) -> float:
    """How far two parts of lines (k, 2) are apart that move as one each; 0 if there is one part."""
    count = len(motion)
    if count < _LEAST_LINES:
        return 0.0
    before = np.arange(1, count)[:, None]
    sums = np.cumsum(motion, axis=0)
    first, second = sums[:-1] / before, (sums[-1] - sums[:-1]) / (count - before)
    between = before[:, 0] * (count - before[:, 0]) / count * np.square(second - first).sum(axis=1)
    split = int(np.argmax(between))
    jump = second[split] - first[split]
    size = float(np.hypot(*jump))
    spread = float(np.square(motion - sums[-1] / count).sum())
    steep = float((motion[split + 1] - motion[split]) @ jump) / max(size, 1e-12) ** 2
    if between[split] < _LEAST_EXPLAINED * spread or steep < _LEAST_STEEP:
        return 0.0
    return size
