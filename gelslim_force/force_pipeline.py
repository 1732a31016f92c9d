"""Marker frames to forces: tracking, compensated motion, interpolation, stiffness, wrench.

Build one `ForcePipeline` per sensor and feed it frames in order. It remembers the markers' last
places and the last forces, nothing else; what is wrong with a frame is said in its result, and
the stream goes on.
"""

from __future__ import annotations

import time
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.finite_strain_force import FiniteStrainForce
from gelslim_force.force_estimator import ForceEstimator
from gelslim_force.frame_result import FrameResult
from gelslim_force.marker_motion import MarkerView
from gelslim_force.marker_noise import node_noise_n_per_px, noise_px
from gelslim_force.pipeline_settings import PipelineSettings
from gelslim_force.sensor_calibration import SensorCalibration
from gelslim_force.single_thread import single_threaded
from gelslim_force.tracker import TrackedFrame
from gelslim_force.tracks import MarkerStatus
from gelslim_force.wrench_noise import WrenchNoise
from ifem_export.bundle import Bundle
from ifem_export.errors import IfemError
from ifem_export.interpolation import marker_to_node
from ifem_export.marker_interpolation import FilledInterpolation

Array = NDArray[np.float64]
_CONTACT_SIGMAS = 5.0


class NormalMotionLike(Protocol):
    """What a normal model says of one frame."""

    @property
    def w_mm(self) -> Array:
        """(c,) motion of the surface nodes along z, negative for a press."""

    @property
    def sigma_mm(self) -> Array:
        """(c,) standard deviation."""

    @property
    def touched(self) -> NDArray[np.bool_] | None:
        """(c,) nodes in contact, None where the model does not tell."""


class NormalSource(Protocol):
    """Finds the normal motion in a frame; None where it cannot tell."""

    def motion(self, image: NDArray[np.uint8]) -> NormalMotionLike | None:
        """Normal motion of the surface nodes for a frame (h, w, 3)."""


class ForcePipeline:
    """From frames to forces for one calibrated sensor.

    Args:
        bundle: the sensor.
        calibration: its camera and markers at rest.
        settings: see `PipelineSettings`.
        normal: finds the normal motion in each frame; None leaves normal forces unknown unless
            `process` is given the motion.

    Raises:
        IfemError: no operator keeps the budget, or the bundle has no markers.
        ValueError: the calibration belongs to another bundle.
    """

    def __init__(
        self,
        bundle: Bundle,
        calibration: SensorCalibration,
        settings: PipelineSettings | None = None,
        normal: NormalSource | None = None,
    ) -> None:
        if bundle.markers is None:
            raise IfemError("the bundle has no markers: rebuild it with marker positions")
        calibration.require_bundle(bundle)
        self.bundle, self.calibration = bundle, calibration
        self.settings = settings or PipelineSettings()
        self._normal = normal
        self._tracker = calibration.tracker()
        reference = self._tracker.reference
        self._view = MarkerView(calibration.camera, reference.places_px)
        self._markers = reference.markers
        self._count = len(bundle.markers.positions_mm)
        operator = self.settings.operator(bundle)
        law = FiniteStrainForce(bundle) if self.settings.gel == "neo_hookean" else None
        self._estimator = ForceEstimator(bundle.mesh, operator, self.settings.force, law)
        self._fitter = ForceEstimator(
            bundle.mesh, self.settings.compliance(bundle), self.settings.force
        )
        self._wrench = WrenchNoise.of(operator, self.points_mm)
        self._index = 0
        self._last_force: Array | None = None
        self._kept_gains: tuple[bytes, Array] | None = None

    @property
    def points_mm(self) -> Array:
        """(c, 3) surface nodes at rest."""
        return self._estimator.points_mm

    @property
    def operator_name(self) -> str:
        """Rung in use."""
        return self._estimator.operator.name

    def reset(self) -> None:
        """Forget all motion and count frames from 0."""
        self._tracker.reset()
        self._index = 0
        self._last_force: Array | None = None

    def unreadable(self, problem: str, *, time_s: float | None = None) -> FrameResult:
        """Result of a frame that never arrived whole; it counts, and the stream goes on."""
        return self._numbered(time_s, problems=(problem,))

    @single_threaded
    def process(
        self,
        image: NDArray[np.uint8],
        *,
        time_s: float | None = None,
        normal_mm: ArrayLike | None = None,
    ) -> FrameResult:
        """Forces of the next frame.

        Args:
            image: (h, w) or (h, w, 3) uint8.
            time_s: when it was taken; frames count in units of 1 s without.
            normal_mm: (c,) motion of the surface nodes along z, from a depth map, in place of
                the normal source.

        Never raises for the frame's content: see `FrameResult.problems`.
        """
        clock = _Clock()
        problem = self._misfit(image)
        if problem:
            return self._numbered(time_s, problems=(problem,))
        try:
            tracked = self._tracker.update(image)
        except ValueError as error:
            return self._numbered(time_s, problems=(str(error),))
        clock.stage("track")
        problems = _complaints(tracked)
        tracks = tracked.tracks
        if tracks.coverage < self.settings.least_coverage:
            short = (
                f"{tracks.coverage:.0%} of the markers are seen: under "
                f"{self.settings.least_coverage:.0%} forces are not given"
            )
            return self._numbered(
                time_s, tracks=tracks, stage_ms=clock.stages, problems=(*problems, short)
            )
        normal, touched, sigma, extra = self._normal_motion(image, normal_mm)
        clock.stage("normal")
        motion = self._marker_motion(tracks.places_px, normal)
        clock.stage("displace")
        try:
            to_nodes, displacement = self._at_nodes(motion, normal)
            clock.stage("interpolate")
            noise = self._noise_px(tracks.displacement_px)
            estimator = self._fitter if self._is_masked(touched, normal) else self._estimator
            least = _CONTACT_SIGMAS * noise * self._restlessness
            field = estimator.estimate(displacement, touched, self._last_force, least)
            clock.stage("force")
            wrench = self._wrench.wrench(
                field.force_n, self._covariance(to_nodes, tracks.known, noise, sigma)
            )
            clock.stage("wrench")
        except IfemError as error:
            return self._numbered(
                time_s, tracks=tracks, stage_ms=clock.stages, problems=(*problems, str(error))
            )
        known = normal is not None
        self._last_force = field.force_n if known else None
        return self._numbered(
            time_s,
            tracks=tracks,
            marker_displacement_mm=motion,
            field=field,
            wrench=wrench,
            normal_known=known,
            stage_ms=clock.stages,
            problems=problems,
            extra=extra,
        )

    def _numbered(self, time_s: float | None, **found: Any) -> FrameResult:
        index, self._index = self._index, self._index + 1
        return FrameResult(index, float(index) if time_s is None else time_s, **found)

    def _misfit(self, image: Any) -> str:
        camera = self.calibration.camera
        size = (camera.image_height_px, camera.image_width_px)
        if not isinstance(image, np.ndarray) or image.shape[:2] != size:
            got = getattr(image, "shape", type(image).__name__)
            return f"frame of shape {got}: this sensor's are {size[1]} x {size[0]} px"
        return ""

    def _normal_motion(
        self, image: NDArray[np.uint8], given: ArrayLike | None
    ) -> tuple[Array | None, NDArray[np.bool_] | None, Array | None, dict[str, Any]]:
        if given is not None:
            w = np.asarray(given, dtype=float)
            if w.shape != (len(self.points_mm),) or not np.isfinite(w).all():
                raise ValueError(
                    f"normal motion of shape {w.shape}: must be ({len(self.points_mm)},), finite"
                )
            return w, None, None, {}
        found = None if self._normal is None else self._normal.motion(image)
        if found is None:
            return None, None, None, {}
        return found.w_mm, found.touched, found.sigma_mm, {"normal": found}

    def _marker_motion(self, places_px: Array, normal: Array | None) -> Array:
        """(n, 3) of the reference's markers."""
        at_markers = 0.0 if normal is None else self._nodes_to_markers @ normal
        lateral = self._view.lateral_motion(places_px, at_markers, self.settings.compensation)
        height = np.full(len(lateral), np.nan) if normal is None else np.asarray(at_markers)
        return np.column_stack([lateral, height])

    def _at_nodes(self, motion: Array, normal: Array | None) -> tuple[FilledInterpolation, Array]:
        values = np.full((self._count, 2), np.nan)
        values[self._markers] = motion[:, :2]
        operator = self._interpolation.with_missing(np.isnan(values).any(axis=1))
        u = np.empty((len(self.points_mm), 3))
        u[:, :2] = operator(values)
        u[:, 2] = np.nan if normal is None else normal
        return operator, u

    def _is_masked(self, touched: Any, normal: Any) -> bool:
        method = self.settings.force.method
        return touched is not None and normal is not None and method in ("auto", "masked")

    def _noise_px(self, displacement_px: Array) -> float:
        if self.settings.noise_px is not None:
            return self.settings.noise_px
        found = noise_px(self._tracker.reference, displacement_px)
        return found if np.isfinite(found) else 0.0

    def _covariance(
        self,
        interpolation: FilledInterpolation,
        known: NDArray[np.bool_],
        noise: float,
        sigma: Array | None,
    ) -> Array:
        spread = np.zeros((self._count, 2, 2))
        scale = self._view.mm_per_px
        spread[self._markers] = noise**2 * scale @ scale.transpose(0, 2, 1)
        spread[self._markers[~known]] = 0.0
        gains = self._gains(interpolation)
        return self._wrench.covariance(gains, spread, sigma)

    def _gains(self, interpolation: FilledInterpolation) -> Array:
        """Wrench per motion of each marker; made anew only where other markers are lost."""
        lost = interpolation.lost.tobytes()
        if self._kept_gains is None or self._kept_gains[0] != lost:
            self._kept_gains = lost, self._wrench.gains(interpolation)
        return self._kept_gains[1]

    @cached_property
    def _interpolation(self) -> FilledInterpolation:
        markers = self.bundle.markers
        assert markers is not None
        return markers.sparse if self.settings.interpolation == "sparse" else markers.thin_plate

    @cached_property
    def _nodes_to_markers(self) -> Any:
        """(n, c) bilinear."""
        return marker_to_node(self.points_mm, self._view.rest_mm)

    @cached_property
    def _restlessness(self) -> Array:
        """(c,) N per px at each node."""
        scale = np.zeros((self._count, 2, 2))
        scale[self._markers] = self._view.mm_per_px
        law = _LowPassed(self._estimator) if self._low_passed else self._estimator.operator
        return node_noise_n_per_px(law, self._interpolation, scale)

    @property
    def _low_passed(self) -> bool:
        return self.settings.force.method in ("auto", "low_pass")


class _LowPassed:
    """The estimator's linear operator with its low-pass."""

    def __init__(self, estimator: ForceEstimator) -> None:
        self._estimator = estimator

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Low-passed forces (c, 3)."""
        return np.asarray(self._estimator.spread @ self._estimator.operator.force(displacement_mm))


class _Clock:
    """Time per stage of one frame, ms."""

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}
        self._last = time.perf_counter()

    def stage(self, name: str) -> None:
        """Close a stage."""
        now = time.perf_counter()
        self.stages[name] = (now - self._last) * 1000
        self._last = now


def _complaints(tracked: TrackedFrame) -> tuple[str, ...]:
    problems = []
    if tracked.slipped:
        problems.append("the anchors contradict the lattice: it may be off by a pitch")
    lost = tracked.tracks.count(MarkerStatus.LOST)
    if lost:
        problems.append(f"{lost} of {len(tracked.tracks)} markers are lost")
    return tuple(problems)
