"""Marker frames to forces: tracking, compensated motion, interpolation, stiffness, wrench.

Build one `ForcePipeline` per sensor and feed it frames in order. It remembers the markers' last
places and the last forces, nothing else; what is wrong with a frame is said in its result, and
the stream goes on.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.calibration.sensor_calibration import SensorCalibration
from gelslim_force.contact.indenter_source import NormalReading
from gelslim_force.contact.normal_source import NormalSource
from gelslim_force.forces.contact_forces import ContactForces
from gelslim_force.forces.estimator import ForceEstimator
from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_force.forces.frame_clock import FrameClock
from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.wrench_noise import WrenchNoise
from gelslim_force.motion.marker_heights import marker_heights_mm
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.settings import PipelineSettings
from gelslim_force.tracking.marker_noise import noise_px
from gelslim_force.tracking.tracker import TrackedFrame
from gelslim_force.tracking.tracks import MarkerStatus
from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError
from ifem_export.markers.interpolation_matrix import FilledInterpolation
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]
_SHIFT_MM = 0.03
"""Change of the lateral motion in the contact that its normal motion need not follow."""
_MISFIT = 0.35
_UNEXPLAINED = "forces on the contact seen leave {:.0%} of the motion unexplained"
_OVERDONE = 4.0
"""Motion that sinking alone should show, over what the markers show, from which on what was seen
is no contact. Right ones stay below 2."""
_CONTRADICTED = "a contact as seen would show {:.0f} times the motion that the markers show"
_UNSEEN = "the markers move, but no contact patch is seen"


class ForcePipeline:
    """From frames to forces for one calibrated sensor.

    Args:
        bundle: the sensor.
        calibration: its camera and markers at rest.
        settings: see `PipelineSettings`.
        normal: finds the normal motion in each frame; None leaves normal forces unknown unless
            `process` is given the motion.

    Attributes:
        bundle: the sensor.
        calibration: its camera and markers at rest.

    Raises:
        IfemError: no operator keeps the budget, or the bundle has no markers.
        ValueError: the calibration belongs to another bundle.
    """

    @single_threaded
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
        self.normal = normal
        """May be set later; the patch finder of an indenter needs the pipeline's nodes."""
        self._tracker = calibration.tracker()
        reference = self._tracker.reference
        markers, points_mm = bundle.markers, np.asarray(bundle.mesh.surface_mm)
        operator = self.settings.operator(bundle)
        law = FiniteStrainForce(bundle) if self.settings.gel == "neo_hookean" else None
        self._wrench = WrenchNoise.of(operator, points_mm)
        self._motion = SurfaceMotion(
            MarkerView(
                calibration.camera,
                reference.positions_px,
                marker_heights_mm(bundle)[reference.markers],
            ),
            reference.markers,
            markers.sparse if self.settings.interpolation == "sparse" else markers.thin_plate,
            points_mm,
            self.settings.compensation,
        )
        mesh, chosen = bundle.mesh, self.settings.force
        self._forces = ContactForces(
            ForceEstimator(mesh, operator, chosen, law, self._motion),
            ForceEstimator(mesh, self.settings.compliance(bundle), chosen, law),
        )
        self._forces.prepare()
        self._index = 0
        self._last_force: Array | None = None
        self._last_lateral: Array | None = None
        self._kept_gains: tuple[bytes, Array] | None = None

    @property
    def points_mm(self) -> Array:
        """(c, 3) surface nodes at rest."""
        return self._forces.straight.points_mm

    @property
    def operator_name(self) -> str:
        """Rung in use."""
        return self._forces.straight.operator.name

    def reset(self) -> None:
        """Forget all motion and count frames from 0."""
        self._tracker.reset()
        self._index, self._last_force, self._last_lateral = 0, None, None

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
        clock = FrameClock()
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
        reading, motion = self._motions(image, tracks.positions_px, normal_mm, clock)
        if reading is not None and not reading.known:
            problems = (*problems, reading.problem)
        known = reading is not None and reading.known
        try:
            interpolation, displacement = self._motion.of_nodes(motion, reading)
            clock.stage("interpolate")
            noise = self._noise_px(tracks.displacement_px)
            touched = reading.touched if reading is not None and known else None
            field = self._forces.estimate(displacement, touched, self._last_force, noise)
            clock.stage("force")
            if field.misfit > _MISFIT and self._motion.moved(motion):
                problems = (*problems, _UNEXPLAINED.format(field.misfit))
            covariance = self._covariance(interpolation, motion, noise, reading)
            wrench = self._wrench.wrench(field.force_n, covariance)
            clock.stage("wrench")
        except IfemError as error:
            return self._numbered(
                time_s, tracks=tracks, stage_ms=clock.stages, problems=(*problems, str(error))
            )
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
            extra=_findings(field, reading),
        )

    def _numbered(self, time_s: float | None, **found: Any) -> FrameResult:
        index, self._index = self._index, self._index + 1
        return FrameResult(index, float(index) if time_s is None else time_s, **found)

    def _misfit(self, image: Any) -> str:
        camera = self.calibration.camera
        size = (camera.image_height_px, camera.image_width_px)
        if not isinstance(image, np.ndarray) or image.shape[:2] != size:
            got = type(image).__name__
            if isinstance(image, np.ndarray) and image.ndim >= 2:
                got = f"{image.shape[1]} x {image.shape[0]} px"
            return f"frame of {got}: this sensor's are {size[1]} x {size[0]} px"
        return ""

    def _motions(
        self, image: NDArray[np.uint8], places_px: Array, given: ArrayLike | None, clock: FrameClock
    ) -> tuple[NormalReading | None, Array]:
        """Normal motion, and the motion (n, 3) of the reference's markers."""
        motion_of = self._motion.of_markers
        if given is not None or self.normal is None:
            reading = None if given is None else self._given(given)
            motion = motion_of(places_px, reading)
            clock.stage("displace")
            return reading, motion
        seen = self.normal.look(image, places_px)
        clock.stage("look")
        reading = self.normal.motion(seen, self._last_lateral)
        clock.stage("normal")
        motion = motion_of(places_px, reading)
        clock.stage("displace")
        if seen is None and self._motion.moved(motion):
            # Nothing shows, yet the gel moves: no force at all would be a false statement.
            return replace(reading, problem=_UNSEEN), motion_of(places_px, None)
        overdone = self._motion.overdone(motion, reading)
        if overdone > _OVERDONE:
            doubtful = replace(reading, problem=_CONTRADICTED.format(overdone))
            return doubtful, motion_of(places_px, None)
        lateral = self._motion.of_touched(motion, reading)
        used, self._last_lateral = self._last_lateral, lateral
        before = 0.0 if used is None else used
        if lateral is not None and np.hypot(*(lateral - before)) > _SHIFT_MM:
            reading = self.normal.motion(seen, lateral)
            clock.stage("normal")
            motion = motion_of(places_px, reading)
            clock.stage("displace")
        return reading, motion

    def _given(self, normal_mm: ArrayLike) -> NormalReading:
        w = np.asarray(normal_mm, dtype=float)
        count = len(self.points_mm)
        if w.shape != (count,) or not np.isfinite(w).all():
            raise ValueError(f"normal motion of shape {w.shape}: must be ({count},) and finite")
        return NormalReading(w, np.zeros(count), None)

    def _noise_px(self, displacement_px: Array) -> float:
        if self.settings.noise_px is not None:
            return self.settings.noise_px
        return noise_px(self._tracker.reference, displacement_px)

    def _covariance(
        self,
        interpolation: FilledInterpolation,
        motion: Array,
        noise: float,
        reading: NormalReading | None,
    ) -> Array:
        gains = self._gains(interpolation)
        seen = np.isfinite(motion[:, 0])
        spread = self._motion.covariance_mm2(seen, noise)
        if reading is not None and reading.known:
            return self._wrench.covariance(gains, spread, reading.sigma_mm)
        unseen = self._motion.apparent_motion(motion, self.settings.unknown_normal_mm)
        return self._wrench.covariance(gains, spread, lateral_sigma_mm=unseen)

    def _gains(self, interpolation: FilledInterpolation) -> Array:
        """Wrench per motion of each marker; made anew only where other markers are lost."""
        lost = interpolation.lost.tobytes()
        if self._kept_gains is None or self._kept_gains[0] != lost:
            self._kept_gains = lost, self._wrench.gains(interpolation)
        return self._kept_gains[1]


def _findings(field: ForceField, reading: NormalReading | None) -> dict[str, Any]:
    found: dict[str, Any] = {} if reading is None else {"normal": reading.summary()}
    if field.low_pass_mm is not None:
        found["low_pass_mm"] = [round(float(width), 4) for width in field.low_pass_mm]
    return found


def _complaints(tracked: TrackedFrame) -> tuple[str, ...]:
    problems = []
    if tracked.slipped:
        problems.append("the anchors contradict the lattice: it may be off by a pitch")
    lost = tracked.tracks.count(MarkerStatus.LOST)
    if lost:
        problems.append(f"{lost} of {len(tracked.tracks)} markers are lost")
    return tuple(problems)
