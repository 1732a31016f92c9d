"""The drift from frame to frame: estimated, limited, and kept as the new rest by a tare.

Drift varies slowly while nothing knocks the finger, so the estimate of a frame is combined with
that of the frames before (a Kalman filter with a random walk). A jump is taken as it is. Where a
contact leaves few markers free, the drift known before is kept, with a standard deviation that
grows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.drift import LEAST_NOISE_PX, Drift, FarField, Similarity
from gelslim_force.tracking.tracks import Tracks

Array = NDArray[np.float64]
_JUMP_SIGMAS = 5.0
_SIGNIFICANT_SIGMAS = 3.0
_UNKNOWN_PX = 10.0
_LEAK_SHAPE = np.array([0.65, 0.8, 1.1, 0.7])
"""Parts of the load's own motion of the free markers: shift x, shift y, scale and rotation. A push
spreads the markers about itself."""
_LEAST_TARE_COVERAGE = 0.8
_MOST_TARE_PX = 2.0
"""Shift beyond which the picture without contact, to which light is compared, does not fit."""
LIGHT_CHANGED = (
    "the light has changed as by something that touches the gel: take a frame without contact and "
    "in the light of the calibration, or calibrate again"
)
_CAMERA_MOVED = (
    "the picture is {what} against the rest: beyond {limit} forces are not given; if nothing "
    "touches the gel, take it as the new rest with `tare`, or calibrate again"
)


class TareError(GelslimError, ValueError):
    """A frame that cannot become the new rest; the message says why."""


@dataclass(frozen=True)
class DriftSettings:
    """How drift of the camera against the gel is treated.

    Attributes:
        correct: Whether small drift is corrected. Otherwise it is left in the motion, and enters
            the covariance of the wrench as an error.
        most_px: Largest shift since the last rest with which forces are given.
        most_scale: Largest relative change of the picture's size.
        most_rotation_deg: Largest rotation of the picture.
        walk_px: Standard deviation of the drift from one frame to the next, at the markers.
        unseen_px: Standard deviation of the drift before the first frame.
        rezero_frames: Number of frames without contact, one after the other, after which the mean
            drift becomes the new rest; None only by `ForcePipeline.tare`.

    Raises:
        ValueError: A value is impossible.
    """

    correct: bool = True
    most_px: float = 0.5
    most_scale: float = 0.003
    most_rotation_deg: float = 0.2
    walk_px: float = 1e-3
    unseen_px: float = 0.05
    rezero_frames: int | None = None

    def __post_init__(self) -> None:
        for name in ("most_px", "most_scale", "most_rotation_deg", "walk_px", "unseen_px"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ValueError(f"drift: {name} = {value!r}: must be a number >= 0")
        if self.rezero_frames is not None and self.rezero_frames < 1:
            raise ValueError(f"drift: rezero_frames = {self.rezero_frames!r}: must be >= 1")


@dataclass(frozen=True)
class TareRecord:
    """An entry of the log of new rests; all values since the calibration.

    Attributes:
        time_s: When the frame was taken.
        shift_px: Shift in x and y at the middle of the markers.
        rotation_deg: Rotation from x to y of the picture.
        scale: 1 where the picture keeps its size.
        residual_px: Root mean square of the markers' residual, per coordinate.
        automatic: Whether the pipeline took it by itself.
    """

    time_s: float
    shift_px: tuple[float, float]
    rotation_deg: float
    scale: float
    residual_px: float
    automatic: bool = False

    def summary(self) -> dict[str, Any]:
        """Plain values for a file."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class FrameDrift:
    """The drift of one frame as the forces need it.

    Attributes:
        similarity: Estimated drift since the calibration.
        positions_px: (n, 2) markers without the drift that is corrected.
        gain: (4, n, 2) part of each marker's noise in the drift that is corrected.
        basis: (n, 2, 4) motion of the markers per unit of drift.
        covariance: (4, 4) of the remaining drift (shift x, shift y, scale, rotation), beside that
            noise and what the load moves the free markers.
        leak: (4,) variances of it by what the load moves the free markers.
        problem: Why no forces can be given; empty if they can.
        untouched: Whether the markers show no contact.
        residual_px: Of the free markers; NaN where none are free.
    """

    similarity: Similarity
    positions_px: Array
    gain: Array
    basis: Array
    covariance: Array
    leak: Array
    problem: str
    untouched: bool
    residual_px: float

    def summary(self) -> Mapping[str, Any]:
        """Plain values for a file."""
        shift, found = self.similarity.shift_px, self.similarity
        return {
            "shift_px": [round(shift.real, 4), round(shift.imag, 4)],
            "rotation_deg": round(found.rotation_deg, 5),
            "scale": round(found.scale, 6),
        }


class DriftFilter:
    """Follows the drift of one sensor through frames in order.

    Args:
        reference: The n markers at rest.
        settings: Limits and choices.

    Attributes:
        field: The fit of a frame's drift.
        log: The rests taken since the calibration, oldest first.
        loaded: (n,) markers known to be touched, which say nothing of the drift; None if unknown.
    """

    loaded: NDArray[np.bool_] | None

    def __init__(self, reference: ReferenceLattice, settings: DriftSettings) -> None:
        self._reference, self._settings = reference, settings
        self.field = FarField(reference)
        self._unit = np.array([1.0, 1.0, *(1 / self.field.arm_px**2,) * 2])
        self._leaking = self._unit * _LEAK_SHAPE**2
        self._walk = np.diag(self._spread(settings.walk_px))
        self._jump = _JUMP_SIGMAS**2, self._spread(_UNKNOWN_PX)
        self.log: tuple[TareRecord, ...] = ()
        self._rest, self._told = Similarity(), 0
        self.reset()

    def reset(self) -> None:
        """Forget the motion since the last rest; the rests are kept."""
        self._drift = self._rest
        self._covariance = np.diag(self._spread(self._settings.unseen_px))
        self._bias_px = 0.0
        self._still: list[Similarity] = []
        self.loaded = None

    def copy(self) -> DriftFilter:
        """Another filter that starts from the same rest."""
        other = DriftFilter(self._reference, self._settings)
        other.log, other._rest = self.log, self._rest
        other.reset()
        return other

    def findings(self, frame: FrameDrift) -> dict[str, Any]:
        """The drift of a frame, and the rests taken since the last one, as plain values."""
        found: dict[str, Any] = {"drift": frame.summary()}
        if self._told < len(self.log):
            found["rests"] = [record.summary() for record in self.log[self._told :]]
        self._told = len(self.log)
        return found

    def update(self, tracks: Tracks, noise_px: float) -> FrameDrift:
        """Estimate the drift of the next frame.

        Args:
            tracks: The n markers in the frame.
            noise_px: Standard deviation of one coordinate of a marker.
        """
        noise = max(noise_px, LEAST_NOISE_PX)
        seen = tracks.tracked if self.loaded is None else tracks.tracked & ~self.loaded
        found = self.field.fitted(tracks.displacement_px, seen, noise, self._drift)
        self._covariance = self._covariance + self._walk
        if found is None:
            self._still = []
            return self._found(tracks, None, np.zeros((4, len(tracks), 2)), self._covariance)
        from gelslim_force.tracking.drift_filter_kernel import combined, left_over

        solution = self.field.solution(found).reshape(4, -1)
        share, vector = combined(
            self._drift.vector,
            self._covariance,
            self._leak(self._bias_px),
            found.similarity.vector,
            solution,
            (noise**2, self._leak(found.leak_px)),
            self._jump,
        )
        self._drift = Similarity.of(vector)
        gain = share @ solution
        # The load moves the free markers in the same way in every frame: no mean takes it off.
        weight = (share[0, 0] + share[1, 1]) / 2
        self._bias_px = weight * found.leak_px + (1 - weight) * self._bias_px
        self._covariance = left_over(self._covariance, share)
        remaining = self._covariance
        self._covariance = remaining + noise**2 * (gain @ gain.T)
        return self._found(tracks, found, gain.reshape(4, -1, 2), remaining)

    def _remaining(self) -> Array:
        """(4, 4) covariance of the drift by the frames before and by the load's own motion."""
        found = self._covariance.copy()
        found.flat[::5] += self._leak(self._bias_px)
        return found

    def tare(self, frame: FrameDrift, tracks: Tracks, time_s: float) -> TareRecord:
        """Take the drift of a frame as the new rest.

        Raises:
            TareError: Something touches the gel, too few markers are seen, or the camera has moved
                too far.
        """
        if tracks.coverage < _LEAST_TARE_COVERAGE:
            raise TareError(
                f"{tracks.coverage:.0%} of the markers are seen and at least "
                f"{_LEAST_TARE_COVERAGE:.0%} are needed: clean the gel and light all of it"
            )
        if not frame.untouched:
            raise TareError(
                "something touches the gel, or the picture is not that of the calibration: the "
                "markers do not move together; take a frame without contact, or calibrate again"
            )
        shift = abs(frame.similarity.shift_px)
        if shift > _MOST_TARE_PX:
            raise TareError(
                f"the picture is shifted by {shift:.1f} px since the calibration, at most "
                f"{_MOST_TARE_PX:g} px can be a rest: calibrate again"
            )
        return self._keep(frame.similarity, frame.residual_px, time_s, automatic=False)

    def rezero(self, frame: FrameDrift, time_s: float) -> None:
        """Take the mean drift as the new rest after enough frames without contact, if asked for."""
        count = self._settings.rezero_frames
        if count is None:
            return
        self._still = [*self._still, frame.similarity] if frame.untouched else []
        if len(self._still) < count:
            return
        mean = Similarity.of(np.mean([s.vector for s in self._still], axis=0))
        self._still = []
        if abs(mean.shift_px) <= _MOST_TARE_PX:
            self._keep(mean, frame.residual_px, time_s, automatic=True)

    def _keep(
        self, rest: Similarity, residual_px: float, time_s: float, *, automatic: bool
    ) -> TareRecord:
        self._rest = rest
        shift = rest.shift_px
        record = TareRecord(
            time_s=float(time_s),
            shift_px=(shift.real, shift.imag),
            rotation_deg=rest.rotation_deg,
            scale=rest.scale,
            residual_px=residual_px,
            automatic=automatic,
        )
        self.log = (*self.log, record)
        return record

    def _found(
        self, tracks: Tracks, found: Drift | None, gain: Array, covariance: Array
    ) -> FrameDrift:
        since = self._drift.vector - self._rest.vector
        share = self._significance(since)
        left = (1 - share) * since
        return FrameDrift(
            similarity=self._drift,
            positions_px=self.field.without(
                tracks.positions_px, Similarity.of(self._drift.vector - left)
            ),
            gain=share * gain,
            basis=self.field.basis,
            covariance=covariance + left[:, None] * left,
            leak=self._leak(self._bias_px),
            problem=self._excess(),
            untouched=found is not None and found.untouched and not np.any(self.loaded),
            residual_px=float("nan") if found is None else found.residual_px,
        )

    def _significance(self, since: Array) -> float:
        """Share of a drift (4,) that is corrected: none within its deviation, all if beyond it.

        So that a load that moves the free markers a little loses nothing to the correction.
        """
        if not self._settings.correct:
            return 0.0
        from gelslim_force.tracking.drift_filter_kernel import squared_sigmas

        squared = squared_sigmas(self._remaining(), since)
        return max(0.0, 1 - _SIGNIFICANT_SIGMAS**2 / squared) if squared > 0 else 0.0

    def _excess(self) -> str:
        """Why the drift since the last rest is too large; empty if it is not."""
        since, limits = self._drift.minus(self._rest), self._settings
        if abs(since.shift_px) > limits.most_px:
            return _CAMERA_MOVED.format(
                what=f"shifted by {abs(since.shift_px):.2g} px", limit=f"{limits.most_px:g} px"
            )
        if abs(since.scale - 1) > limits.most_scale:
            return _CAMERA_MOVED.format(
                what=f"scaled by {since.scale:.4f}", limit=f"{limits.most_scale:.1%}"
            )
        if abs(since.rotation_deg) > limits.most_rotation_deg:
            return _CAMERA_MOVED.format(
                what=f"rotated by {since.rotation_deg:.2f}°",
                limit=f"{limits.most_rotation_deg:g}°",
            )
        return ""

    def _spread(self, sigma_px: float) -> Array:
        """(4,) variances of a drift that moves the markers by about `sigma_px`."""
        return np.asarray(self._unit * sigma_px**2)

    def _leak(self, sigma_px: float) -> Array:
        """(4,) variances by what the load itself moves the free markers."""
        return np.asarray(self._leaking * sigma_px**2)
