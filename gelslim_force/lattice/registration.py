"""Registration: which dot is which marker, from the anchors of the print.

The lattice found in a frame may be shifted by whole pitches, turned or mirrored against the
print. The log-likelihood of every such motion counts dots where the print has none, sites without
a dot where the print has one, and the measured sizes against the printed ones. The best motion is
accepted only if it exceeds the second best by a margin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate

from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.growth import Lattice, LatticeError, grow_lattice
from gelslim_force.lattice.homography import seen_sites
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

LEAST_MARGIN = 4.6
"""Log-likelihood by which the best motion must exceed the second best: odds of 100 to 1."""
_MISSING, _SPURIOUS = 0.05, 0.01
_TRIED_WITH_CAMERA = 400
_MAX_CAMERA_EVIDENCE = 8.0
"""Largest log-likelihood of the camera against a motion; two anchors have as much."""
_AREA_SIGMA = 0.15
"""Standard deviation of the logarithm of a dot's area among its neighbours."""
_MAX_SIZE_EVIDENCE = 4.0
"""Limit of the evidence of one dot, whose size dirt and glare can change: odds of 55 to 1."""
Motion = tuple[int, bool, int, int]
"""Quarter turns, mirrored or not, and shift in rows and columns from lattice to print."""


@dataclass(frozen=True, eq=False)
class Registration:
    """The dots of a frame without contact by marker; m markers of the grid."""

    dots: NDArray[np.int64]
    """(m,) index into the detections; -1 for a marker that was not found."""
    centres_px: NDArray[np.float64]
    """(m, 2) centres; NaN for a marker that was not found."""
    spurious: NDArray[np.int64]
    """Detections that are not markers of the grid."""
    turns: int
    """Quarter turns of the lattice; like `mirrored` it means nothing across frames."""
    mirrored: bool
    margin: float
    """Log-likelihood above that of the second best motion."""
    residual_px: NDArray[np.float64]
    """(m,) distance from the position that the neighbours predict; NaN with too few neighbours."""
    pitch_px: float
    camera_offset_pitch: float
    """Median distance from the camera's prediction in pitches; NaN without a camera."""

    @property
    def found(self) -> NDArray[np.bool_]:
        """(m,) whether a marker was found."""
        return self.dots >= 0

    @property
    def coverage(self) -> float:
        """Share of the grid's markers that were found."""
        return float(self.found.mean())


def register(
    detections: Detections,
    grid: MarkerGrid,
    image_shape: tuple[int, ...],
    camera: VirtualCamera | None = None,
    *,
    pose_tolerance_pitch: float = 0.3,
) -> Registration:
    """Return which dot is which marker.

    Args:
        detections: The dots of a frame without contact.
        grid: The printed markers.
        image_shape: (height, width, ...) of the frame.
        camera: Its prediction counts as much as two anchors at most, because the print on a gel
            may be misplaced by a pitch. Without anchors the prediction decides alone.
        pose_tolerance_pitch: Standard deviation of the prediction, in pitches.

    Raises:
        LatticeError: No lattice is found, or two motions explain it equally well.
    """
    lattice = grow_lattice(detections)
    height, width = image_shape[:2]
    if min(lattice.shape) < 3:
        raise LatticeError(f"only a strip of {lattice.shape} dots is found; it has no direction")
    scores = _scores(lattice, detections, grid, (int(height), int(width)))
    offset = float("nan")
    if camera is not None:
        scores, offset = _with_camera(
            scores, lattice, detections, grid, camera, pose_tolerance_pitch
        )
    (best, motion), runner_up = scores[0], scores[1]
    margin = best - runner_up[0]
    if margin < LEAST_MARGIN:
        raise LatticeError(_refusal(margin, motion, runner_up[1], grid, camera))
    result = _assigned(lattice, detections, grid, motion, margin, offset)
    if result.coverage < 0.5 and len(lattice.dots) > 2 * result.found.sum():
        raise LatticeError(
            f"only {int(result.found.sum())} of {len(lattice.dots)} lattice dots fall on the "
            f"print of {len(grid)} markers: the frame shows a different print"
        )
    return result


def moved_sites(sites: NDArray[np.int64], motion: Motion) -> NDArray[np.int64]:
    """Return the sites of the print that lattice sites (k, 2) have after a motion."""
    turns, mirrored, rows, columns = motion
    a, b = sites.T
    for _ in range(turns):
        a, b = -b, a
    if mirrored:
        b = -b
    return np.column_stack([a + rows, b + columns])


def _expected(grid: MarkerGrid) -> tuple[NDArray[np.float64], ...]:
    """Tables (rows, columns) of the print: dots, large dots, sites that are omitted on purpose."""
    dots, large, omitted = (np.zeros(grid.lattice_shape) for _ in range(3))
    dots[grid.row, grid.column] = 1
    big = grid.kind == ANCHOR_LARGE
    large[grid.row[big], grid.column[big]] = 1
    omitted[tuple(grid.omitted.T)] = 1
    return dots, large, omitted


def _scores(
    lattice: Lattice, detections: Detections, grid: MarkerGrid, shape: tuple[int, int]
) -> list[tuple[float, Motion]]:
    """All motions with their log-likelihoods, the best first."""
    dots, large, _ = _expected(grid)
    reach = max(grid.lattice_shape)
    log_seen = np.log(1 - _MISSING) - np.log(_SPURIOUS)
    log_unseen = np.log(_MISSING)
    evidence = _size_evidence(lattice, detections, grid)
    found: list[tuple[float, Motion]] = []
    for mirrored in (False, True):
        for turns in range(4):
            sites = moved_sites(lattice.sites, (turns, mirrored, 0, 0))
            origin = sites.min(axis=0)
            local = sites - origin
            visible = seen_sites(local, detections.centres_px[lattice.dots], reach, shape)
            gain = np.where(visible, log_unseen, 0.0)
            at = tuple((local + reach).T)
            gain[at] = log_seen
            size = np.zeros_like(gain)
            size[at] = evidence
            score = correlate(gain, dots, method="fft") + correlate(size, large, method="fft")
            for flat in np.argsort(score, axis=None)[::-1][:50]:
                r, c = np.unravel_index(flat, score.shape)
                # correlate(a, b)[r, c] puts the first site of b on the site r - (rows - 1) of a.
                shift_r = -(int(r) - (dots.shape[0] - 1)) + reach - int(origin[0])
                shift_c = -(int(c) - (dots.shape[1] - 1)) + reach - int(origin[1])
                found.append((float(score[r, c]), (turns, mirrored, shift_r, shift_c)))
    found.sort(key=lambda item: -item[0])
    return found


def _size_evidence(
    lattice: Lattice, detections: Detections, grid: MarkerGrid
) -> NDArray[np.float64]:
    """Return log P(area | large anchor) - log P(area | regular dot) of each lattice dot (k,).

    Areas are compared with the median of the 5 x 5 neighbours, which removes the effect of
    perspective. All are zero for a print without large anchors.
    """
    large = grid.kind == ANCHOR_LARGE
    if not large.any():
        return np.zeros(len(lattice.dots))
    rise = 2 * np.log(np.median(grid.diameter_mm[large]) / np.median(grid.diameter_mm[~large]))
    area = np.log(detections.area_px[lattice.dots])
    table = np.full(tuple(np.array(lattice.shape) + 4), np.nan)
    table[tuple((lattice.sites + 2).T)] = area
    windows = np.lib.stride_tricks.sliding_window_view(table, (5, 5))
    usual = np.nanmedian(windows[tuple(lattice.sites.T)].reshape(len(area), -1), axis=1)
    off = area - usual
    evidence = (off**2 - (off - rise) ** 2) / (2 * _AREA_SIGMA**2)
    clipped: NDArray[np.float64] = np.clip(evidence, -_MAX_SIZE_EVIDENCE, _MAX_SIZE_EVIDENCE)
    return clipped


def _with_camera(
    scores: list[tuple[float, Motion]],
    lattice: Lattice,
    detections: Detections,
    grid: MarkerGrid,
    camera: VirtualCamera,
    tolerance: float,
) -> tuple[list[tuple[float, Motion]], float]:
    """Add the log-likelihood of the median offset from the camera's prediction to each motion.

    Returns also the offset of the best motion in pitches.
    """
    points = detections.centres_px[lattice.dots]
    rows, columns = grid.lattice_shape
    every = np.argwhere(np.ones((rows, columns), dtype=bool))
    flat = np.column_stack([grid.sites_mm(every), np.zeros(len(every))])
    predicted = camera.project(flat).reshape(rows, columns, 2)
    out: list[tuple[float, float, Motion]] = []
    for score, motion in scores[:_TRIED_WITH_CAMERA]:
        sites = moved_sites(lattice.sites, motion)
        inside = np.all((sites >= 0) & (sites < [rows, columns]), axis=1)
        if inside.sum() < 4:
            continue
        offset = points[inside] - predicted[tuple(sites[inside].T)]
        off = float(np.median(np.hypot(*offset.T))) / lattice.pitch_px
        out.append((score - min(0.5 * (off / tolerance) ** 2, _MAX_CAMERA_EVIDENCE), off, motion))
    if len(out) < 2:
        raise LatticeError("the lattice is far from where the camera's model predicts the markers")
    out.sort(key=lambda item: -item[0])
    return [(score, motion) for score, _, motion in out], out[0][1]


def _assigned(
    lattice: Lattice,
    detections: Detections,
    grid: MarkerGrid,
    motion: Motion,
    margin: float,
    offset: float,
) -> Registration:
    sites = moved_sites(lattice.sites, motion)
    inside = np.all((sites >= 0) & (sites < np.array(grid.lattice_shape)), axis=1)
    marker = np.full(len(sites), -1)
    marker[inside] = grid.index_map[tuple(sites[inside].T)]
    dots = np.full(len(grid), -1, dtype=np.int64)
    residual = np.full(len(grid), np.nan)
    hit = marker >= 0
    dots[marker[hit]] = lattice.dots[hit]
    residual[marker[hit]] = lattice.residual_px[hit]
    centres = np.full((len(grid), 2), np.nan)
    centres[dots >= 0] = detections.centres_px[dots[dots >= 0]]
    return Registration(
        dots=dots,
        centres_px=centres,
        spurious=np.setdiff1d(np.arange(len(detections)), dots),
        turns=motion[0],
        mirrored=motion[1],
        margin=margin,
        residual_px=residual,
        pitch_px=lattice.pitch_px,
        camera_offset_pitch=offset,
    )


def _refusal(
    margin: float,
    best: Motion,
    second: Motion,
    grid: MarkerGrid,
    camera: VirtualCamera | None,
) -> str:
    shift = (second[2] - best[2], second[3] - best[3])
    other = (
        f"a shift by {shift[0]} rows and {shift[1]} columns"
        if second[:2] == best[:2]
        else "a turn or mirror image"
    )
    remedy = "make more anchors visible (light, dirt, field of view)"
    if len(grid.anchor_sites) == 0:
        remedy = "print anchors (spec: markers.anchors)"
        if camera is None:
            remedy += " or give the camera"
    return (
        f"cannot tell which dot is which: {other} explains the frame nearly as well "
        f"(log-likelihood margin {margin:.2f}, needed {LEAST_MARGIN:g}); {remedy}"
    )
