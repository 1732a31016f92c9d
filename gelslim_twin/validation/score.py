"""Errors of estimates: of one frame, of many, and of a whole validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.forces.frame_result import FrameResult
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.validation.experiment import FRICTION, Experiment

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
NEAR = 0.15
"""Relative error within which the paper counts a frame as right."""
SHEARED = 0.2
"""Smallest ratio of shear to normal force for which directions are compared."""
PAPER_N = (0.244, 0.201, 0.322)
"""Standard deviations in x, y and z that Ma, Donlon, Dong and Rodriguez (ICRA 2019) measured."""
PAPER_RELATIVE = 0.15
"""Of the true force, as they state it."""
MEDIANS = (
    "field_error", "outside_share", "centre_error_mm", "direction_error_deg", "milliseconds",
)  # fmt: skip
"""Errors of single frames of which a summary gives the median."""


@dataclass(frozen=True)
class Score:
    """Errors of one chain on one frame; NaN where the chain gives no value."""

    test: int
    frame: int
    chain: str
    true_n: tuple[float, float, float]
    found_n: tuple[float, float, float]
    field_error: float
    """Relative L2 error of the nodal forces that the chain gives."""
    outside_share: float
    """Share of the tangential force on nodes outside the true contact region."""
    centre_error_mm: float
    """Distance of the centres of pressure."""
    direction_error_deg: float
    """Angle between the shear resultants; NaN where there is little shear."""
    marker_error_mm: float
    """Root mean square error of the markers' motion in the plane."""
    sigma_n: tuple[float, float, float]
    """Standard deviation that the chain reports."""
    milliseconds: float
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class Spread:
    """Statistics of a chain over many frames, as in the paper."""

    name: str
    frames: int
    without: tuple[int, ...]
    """Number of frames without a force along x, y, z."""
    deviation_n: tuple[float, float, float]
    """Standard deviation of found minus true, about its mean."""
    bias_n: tuple[float, float, float]
    """Mean of found minus true."""
    relative: float
    """Root mean square of the error over that of the true force, of the components given."""
    within: float
    """Share of the frames whose error is at most 15 % of the true force, of components given."""
    field_error: float = float("nan")
    outside_share: float = float("nan")
    centre_error_mm: float = float("nan")
    direction_error_deg: float = float("nan")
    milliseconds: float = float("nan")


def spread(name: str, true_n: Array, found_n: Array) -> Spread:
    """Statistics of resultants (n, 3); a component that no frame gives stays NaN."""
    off = found_n - true_n
    known = np.isfinite(off)
    size = float(np.sqrt((true_n[known] ** 2).sum()))
    kept = [off[known[:, k], k] for k in range(3)]
    return Spread(
        name,
        len(found_n),
        tuple(int(n) for n in (~known).sum(axis=0)),
        _three([e.std() if len(e) else np.nan for e in kept]),
        _three([e.mean() if len(e) else np.nan for e in kept]),
        float(np.sqrt((off[known] ** 2).sum()) / size) if size > 0 else float("nan"),
        _within(true_n, np.where(known, off, 0.0), known),
    )


def _within(true_n: Array, off_n: Array, known: NDArray[np.bool_]) -> float:
    size = np.linalg.norm(np.where(known, true_n, 0.0), axis=1)
    near = np.linalg.norm(off_n, axis=1) <= NEAR * size
    return float((near & known.any(axis=1)).mean())


def summary(name: str, scores: Sequence[Score]) -> Spread:
    """Statistics of one chain; errors of the field are medians over the frames."""
    true, found = (np.array([getattr(s, a) for s in scores]) for a in ("true_n", "found_n"))
    table = np.array([[getattr(s, n) for n in MEDIANS] for s in scores])
    medians: dict[str, Any] = {
        n: float(np.median(values[np.isfinite(values)])) if np.isfinite(values).any() else np.nan
        for n, values in zip(MEDIANS, table.T, strict=True)
    }
    return replace(spread(name, true, found), **medians)


def field_errors(
    points_mm: Array, truth: GelState, found_n: Array
) -> tuple[float, float, float, float]:
    """Field error, share outside, centre error in mm and direction error in degrees.

    `found_n` (c, 3), NaN in components that are not known.
    """
    known = np.isfinite(found_n)
    true = np.where(known, truth.force_n, 0.0)
    found = np.where(known, found_n, 0.0)
    size = np.linalg.norm(true)
    error = float(np.linalg.norm(found - true) / size) if size > 0 else float("nan")
    tangential = np.hypot(found[:, 0], found[:, 1])
    whole = tangential.sum()
    outside = float(tangential[truth.touch == 0].sum() / whole) if whole > 0 else float("nan")
    centres = [_centre(points_mm, f) for f in (truth.force_n, found)]
    apart = float(np.hypot(*(centres[1] - centres[0])))
    return error, outside, apart, _turn(truth.force_n.sum(axis=0), found.sum(axis=0))


def score(
    test: int,
    frame: int,
    chain: str,
    points_mm: Array,
    truth: GelState,
    result: FrameResult,
    marker_error_mm: float,
) -> Score:
    """The score of one result."""
    nan = float("nan")
    found, sigma = np.full(3, nan), np.full(3, nan)
    errors = nan, nan, nan, nan
    if result.wrench is not None and result.field is not None:
        found, sigma = result.wrench.force_n, result.wrench.standard_deviation[:3]
        errors = field_errors(points_mm, truth, result.field.force_n)
    return Score(
        test=test,
        frame=frame,
        chain=chain,
        true_n=_three(truth.force_n.sum(axis=0)),
        found_n=_three(found),
        field_error=errors[0],
        outside_share=errors[1],
        centre_error_mm=errors[2],
        direction_error_deg=errors[3],
        marker_error_mm=marker_error_mm,
        sigma_n=_three(sigma),
        milliseconds=sum(result.stage_ms.values()),
        problems=result.problems,
    )


def _centre(points_mm: Array, force_n: Array) -> Array:
    push = np.maximum(-force_n[:, 2], 0.0)
    total = push.sum()
    return np.asarray(push @ points_mm[:, :2] / total) if total > 0 else np.full(2, np.nan)


def _turn(true_n: Array, found_n: Array) -> float:
    if np.hypot(*true_n[:2]) < SHEARED * abs(true_n[2]) or not found_n[:2].any():
        return float("nan")
    a, b = (np.arctan2(f[1], f[0]) for f in (true_n, found_n))
    return float(abs(np.degrees((b - a + np.pi) % (2 * np.pi) - np.pi)))


def _three(values: ArrayLike) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in np.asarray(values))
    return x, y, z


@dataclass(frozen=True, eq=False)
class Sample:
    """One frame with its true state and the results of the chains, for figures."""

    name: str
    image: Image
    truth: GelState
    results: Mapping[str, FrameResult]


@dataclass(frozen=True, eq=False)
class Validation:
    """The result of a validation.

    Attributes:
        truth: Which model made the frames, and how it differs from that of the pipeline.
        experiment: The ball and its slides.
        scores: Every chain on every frame of the slides.
        chains: Statistics of each chain over the slides.
        budget: Errors of the resultant by source.
        others: Scores of the last frame of the other contacts.
        samples: Last frame of each contact.
        points_mm: Surface nodes (c, 3) in mm.
        calibration: Calibration of the rendered reference frame.
    """

    truth: str
    experiment: Experiment
    scores: tuple[Score, ...]
    chains: tuple[Spread, ...]
    budget: tuple[Spread, ...]
    others: Mapping[str, tuple[Score, ...]]
    samples: tuple[Sample, ...]
    points_mm: NDArray[np.float64]
    calibration: Calibration
    operator: str = ""
    """Label of the force operator that a budget chose; empty without a budget."""
    remarks: tuple[str, ...] = ()
    """What lies outside the calibrated range of that choice."""

    def to_record(self) -> dict[str, Any]:
        """The values as they are written to JSON."""
        return {
            "format": "gelslim-validation/1",
            "truth": self.truth,
            "paper": {"deviation_n": PAPER_N, "relative": PAPER_RELATIVE},
            "experiment": {
                "ball_radius_mm": self.experiment.ball.radius_mm,
                "friction": FRICTION,
                "slides": [asdict(test) for test in self.experiment.tests],
            },
            "chains": [asdict(s) for s in self.chains],
            "budget": [asdict(s) for s in self.budget],
            "frames": [asdict(s) for s in self.scores],
            "other_contacts": {n: [asdict(s) for s in v] for n, v in self.others.items()},
            **({"operator": self.operator} if self.operator else {}),
        }
