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

from gelslim_force.detection.detection import as_planes
from gelslim_force.lattice.reference_lattice import ReferenceLattice

Array = NDArray[np.float64]
_LONGEST_RUN = 1.6
"""Equal rows one after the other, over the pitch: so many always meet dots."""
_SAMPLES = 128
"""Pixels of a row that are looked at."""
_SHARPEST, _RANK = 2.5, 4
"""Sharpness of one line over that of the fourth sharpest: pictures of gels have lines alike, and
those compressed in blocks have many sharp ones. Dots in line with the pixels reach 1.8 without any
noise; pictures in two parts have 4 to 30."""
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
_STRAIN_SHOWN = 2.0
"""Largest growth of dots over the strain between the lines beside them, which is a mean over two
pitches: contacts strain the gel at their rim within one."""
_MOST_OUTSIDE = 0.1
"""Motion of the outer lines of markers over their distance where strain explains sizes."""
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

        Empty if nothing is. Raises ValueError if the array is no picture.
        """
        from gelslim_force.tracking.line_kernel import longest_run

        for words, lines in self._lines_of(as_planes(image)).items():
            count = longest_run(lines)
            if count > _LONGEST_RUN * self._pitch_px:
                return _FROZEN.format(count=count, lines=words)
            if _sharpest(lines) > _SHARPEST:
                return _EDGE.format(lines=words)
        return ""

    def torn(self, displacement_px: Array, growth: Array) -> str:
        """Why the markers are those of a picture in two parts; empty if they are not.

        Args:
            displacement_px: (n, 2) motion of the markers; NaN for those not seen.
            growth: (n,) logarithm of the size of their dots over that at rest; NaN likewise.
        """
        from gelslim_force.tracking.median_kernel import line_medians, median
        from gelslim_force.tracking.tear_kernel import strained

        limit_px = _MOST_STRAIN * self._pitch_px
        count = strained(displacement_px, self.reference.neighbours, limit_px)
        if count > _FEW_STRAINED:
            return _STRAINED.format(count=count)
        usual = median(growth)
        for lines in self._lines:
            sizes, motion = np.empty((len(lines), 1)), np.empty((len(lines), 2))
            line_medians(growth[:, None], lines, _LEAST_IN_LINE, sizes)
            line_medians(displacement_px, lines, _LEAST_IN_LINE, motion)
            other = sizes[:, 0] - usual
            if _many_grown(other) and _many_grown(_unstrained(other, motion, self._apart(lines))):
                return _OTHER_SIZES
            jump = _jump_px(motion[np.isfinite(motion[:, 0])])
            if jump > _LEAST_JUMP * self._pitch_px:
                return _TORN.format(jump=jump)
        return ""

    def _apart(self, lines: NDArray[np.int64]) -> Array:
        """(2,) from a line of markers to the next, perpendicular to both, in px."""
        places = self.reference.positions_px
        ends = [places[line[line >= 0]] for line in lines if (line >= 0).sum() > 1]
        along = np.sum([end[-1] - end[0] for end in ends], axis=0)
        across = np.array([-along[1], along[0]]) / np.hypot(*along)
        step = (ends[-1].mean(axis=0) - ends[0].mean(axis=0)) @ across / max(len(ends) - 1, 1)
        return np.asarray(step * across)

    def _lines_of(self, planes: NDArray[np.uint8]) -> dict[str, Any]:
        """Rows and columns of the part of a picture (h, w, c) that has markers, by their name."""
        from gelslim_force.tracking import line_kernel as lk

        left, top, right, bottom = self._box(*planes.shape[:2])
        across, down = right - left, bottom - top
        steps = max(1, across // _SAMPLES), max(1, down // _SAMPLES)
        rows = np.empty((-(-across // steps[0]), down), dtype=np.int16)
        columns = np.empty((-(-down // steps[1]), across), dtype=np.int16)
        lk.rows(planes, left, top, steps[0], rows)
        lk.columns(planes, left, top, steps[1], columns)
        return {"rows": rows, "columns": columns}

    def _box(self, height: int, width: int) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of the part of the picture that has markers."""
        (left, top), (right, bottom) = self._corners
        return max(left, 0), max(top, 0), min(right, width), min(bottom, height)

    @cached_property
    def _pitch_px(self) -> float:
        return float(np.median(self.reference.pitch_px))

    @cached_property
    def _corners(self) -> tuple[list[int], list[int]]:
        """First and last corner of the markers, the latter excluded."""
        places = self.reference.positions_px
        first, last = places.min(axis=0).astype(int), places.max(axis=0).astype(int) + 1
        return first.tolist(), last.tolist()

    @cached_property
    def _lines(self) -> tuple[NDArray[np.int64], ...]:
        """For both axes of the lattice (lines, markers of a line) indices, -1 for none."""
        return tuple(_table(self.reference.sites, axis) for axis in (0, 1))


def _table(sites: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    at = sites - sites.min(axis=0)
    table = np.full(tuple(at.max(axis=0) + 1), -1, dtype=np.int64)
    table[tuple(at.T)] = np.arange(len(sites))
    return table if axis == 0 else np.ascontiguousarray(table.T)


def _sharpest(lines: Any) -> float:
    """How sharp the sharpest line is, over most of its length, against the fourth sharpest."""
    from gelslim_force.tracking import line_kernel as lk

    sharp = np.empty(max(lines.shape[1] - 3, 0), dtype=np.int32)
    if len(sharp) < _RANK:
        return 0.0
    lk.sharpness(lines, sharp)
    ranked = np.partition(sharp, (-_RANK, -1))
    return float(ranked[-1] / max(ranked[-_RANK], _LEAST_SHARP * (len(lines) // lk.PARTS)))


def _many_grown(growth: Array) -> bool:
    return bool(np.count_nonzero(np.abs(growth) > _LARGEST_GROWTH) >= _FEW_GROWN)


def _unstrained(growth: Array, motion: Array, apart: Array) -> Array:
    """Growth (k,) of the dots of lines beyond what their motion (k, 2) apart explains.

    Where neighbouring lines move away from each other by a share of their distance `apart` (2,),
    dots between them grow by about that share; NaN where it is not known. A gel is bonded: its
    outer lines stay, where those of a picture in two parts do not.
    """
    if len(motion) < _LEAST_LINES:
        return growth
    share = motion @ apart / (apart @ apart)
    known = np.flatnonzero(np.isfinite(share))
    if len(known) < 2 or np.abs(share[known[[0, -1]]]).max() > _MOST_OUTSIDE:
        return growth
    strain = _STRAIN_SHOWN * np.gradient(np.interp(np.arange(len(share)), known, share[known]))
    return growth - np.clip(growth, np.minimum(strain, 0.0), np.maximum(strain, 0.0))


def _jump_px(motion: Array) -> float:
    """How far two parts of lines (k, 2) are apart that move as one each; 0 if there is one part."""
    from gelslim_force.tracking import tear_kernel as tk

    if len(motion) < _LEAST_LINES:
        return 0.0
    explained, steep, size = tk.jump(motion)
    return size if explained >= _LEAST_EXPLAINED and steep >= _LEAST_STEEP else 0.0
