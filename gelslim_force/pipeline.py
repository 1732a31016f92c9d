"""Marker frames to forces: tracking, compensation, interpolation, stiffness, wrench.

Build one `ForcePipeline` per sensor and give it the frames in order. It keeps what it last found.
What is wrong with a frame is reported in its result.
"""

from __future__ import annotations

import copy
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.calibration.design import marker_heights_mm
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.normal_source import NormalReading, NormalSource
from gelslim_force.forces import frame_problems
from gelslim_force.forces.contact_motion import ContactMotion
from gelslim_force.forces.frame_clock import FrameClock
from gelslim_force.forces.frame_problems import FrameCheck
from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.gel_law import GelLaw
from gelslim_force.forces.untouched import with_untouched
from gelslim_force.forces.wrench import Wrench, WrenchNoise
from gelslim_force.forces.wrench_covariance import WrenchCovariance
from gelslim_force.frames.frame import Frame, FrameTimes
from gelslim_force.frames.upright import upright
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.presses.gel_share import GelShare
from gelslim_force.settings import PipelineSettings
from gelslim_force.tracking.drift_filter import (
    LIGHT_CHANGED,
    DriftFilter,
    FrameDrift,
    TareError,
    TareRecord,
)
from gelslim_force.tracking.marker_noise import noise_px
from gelslim_force.tracking.tracker import TrackedFrame
from gelslim_force.tracking.tracks import Tracks
from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]


class ForcePipeline:
    """From frames to forces for one calibrated sensor.

    Args:
        bundle: The sensor.
        calibration: Its camera, and its markers at rest.
        settings: Choices of the pipeline; the defaults if None.
        normal: Finds the normal motion in each frame. Without it normal forces are unknown, unless
            `process` is given the motion.
        gel: What the uncertain gel adds to the covariance of the wrench; by default nothing.

    Attributes:
        bundle, calibration, settings, normal, gel: As given, or the defaults.

    Raises:
        IfemError: No operator keeps the budget, or the bundle has no markers.
        CalibrationError: The calibration belongs to another bundle.
    """

    @single_threaded
    def __init__(
        self,
        bundle: Bundle,
        calibration: Calibration,
        settings: PipelineSettings | None = None,
        normal: NormalSource | None = None,
        gel: GelShare | None = None,
    ) -> None:
        if bundle.markers is None:
            raise IfemError("the bundle has no markers: rebuild it with marker positions")
        calibration.require_bundle(bundle)
        self.bundle, self.calibration = bundle, calibration
        self.settings = settings or PipelineSettings()
        self.normal, self.gel = normal, gel
        self._tracker = calibration.tracker()
        reference = self._tracker.reference
        markers, points_mm = bundle.markers, np.asarray(bundle.mesh.surface_mm)
        operator = self.settings.operator(bundle)
        self._wrench = WrenchNoise.of(operator, points_mm, self.settings.adjoint(bundle, operator))
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
        self._check = FrameCheck.of(bundle, calibration, self._motion, self.settings.least_coverage)
        self._contact = ContactMotion(self._motion, self._check.unseen, normal)
        self._forces = self.settings.contact_forces(bundle, operator, self._motion)
        self._forces.prepare()
        self._prepare_edge()
        self._drift = DriftFilter(reference, self.settings.drift)
        self._covariance = WrenchCovariance(
            self._wrench, self._motion, self._drift.field, self.settings.unknown_normal_mm
        )
        self.reset()

    @property
    def points_mm(self) -> Array:
        """(c, 3) surface nodes at rest."""
        return self._forces.direct.points_mm

    @property
    def rests(self) -> tuple[TareRecord, ...]:
        """The rests taken since the calibration, oldest first."""
        return self._drift.log

    @property
    def operator_name(self) -> str:
        """Name of the surface operator in use."""
        return self._forces.direct.operator.name

    @property
    def gel_law(self) -> GelLaw:
        """Law of the gel, and why it is not the one of the settings if it is another."""
        return GelLaw.of(self.bundle, self.settings.gel, depth_seen=self.normal is not None)

    def with_normal(self, normal: NormalSource | None) -> ForcePipeline:
        """A pipeline of the sensor with another normal source, at rest; it shares the operators."""
        other = copy.copy(self)
        other.normal, other._tracker = normal, self.calibration.tracker()
        other._contact = ContactMotion(self._motion, self._check.unseen, normal)
        other._drift = self._drift.copy()
        other._prepare_edge()
        other.reset()
        return other

    @single_threaded
    def prepare(self) -> None:
        """Compute now what the first contact at each place would wait for: some seconds."""
        self._contact.prepare()

    def reset(self) -> None:
        """Forget all motion and count frames from 0."""
        self._tracker.reset()
        self._drift.reset()
        self._index = 0
        self._last_force: Array | None = None
        self._contact.reset()

    def _prepare_edge(self) -> None:
        """Columns near the edge, for a source that says where the gel is touched."""
        if self.normal is not None and not isinstance(self.normal, UnknownShape):
            self._forces.prepare_edge()

    def unreadable(
        self, problem: str, *, time_s: float | None = None, stamp_s: float | None = None
    ) -> FrameResult:
        """Result of a frame that could not be read; it is counted as a frame."""
        return self._numbered(FrameTimes(time_s, stamp_s), problems=(problem,))

    @single_threaded
    def process(
        self,
        frame: Frame | NDArray[np.uint8],
        *,
        time_s: float | None = None,
        stamp_s: float | None = None,
        normal_mm: ArrayLike | None = None,
        normal_sigma_mm: ArrayLike = 0.0,
    ) -> FrameResult:
        """Estimate the forces of the next frame.

        Args:
            frame: A frame of a source, or a picture (h, w) or (h, w, 3) uint8; of a camera in
                portrait also as the camera gives it, on its side.
            time_s: When it was taken. By default the frame's own time; for a picture, the number
                of frames so far.
            stamp_s: The same in seconds since 1970 (UTC), to merge results with other logs. By
                default the frame's own stamp; unknown for a picture.
            normal_mm: (c,) motion of the surface nodes along z in mm, negative where the gel is
                pressed in. It takes the place of the normal source.
            normal_sigma_mm: Standard deviation of `normal_mm`: of all nodes where the gel is
                pressed in, or (c,) of each node. Their errors are taken to be fully correlated.

        Returns:
            What the frame gave. Nothing is raised for the content of a frame: see
            `FrameResult.problems`.

        Raises:
            ValueError: `normal_mm` or `normal_sigma_mm` has another shape or is not finite, a
                deviation is negative, or `time_s` or `stamp_s` is no time.
        """
        clock = FrameClock()
        times = FrameTimes.of(frame, time_s, stamp_s)
        if isinstance(frame, Frame) and frame.image is None:
            return self._numbered(times, problems=(frame.problem,))
        image: Any = frame.image if isinstance(frame, Frame) else frame
        try:
            image, tracked = self._followed(image)
        except ValueError as error:
            return self._numbered(times, problems=(str(error),))
        clock.stage("track")
        problems, tracks = tracked.problems, tracked.tracks
        refused, noise, drift = self._drifted(tracked)
        clock.stage("drift")
        numbered = partial(self._numbered, times, tracks=tracks, stage_ms=clock.stages)
        if drift is None:
            return numbered(problems=(*problems, refused))
        size = len(self.points_mm)
        given = None if normal_mm is None else NormalReading.given(size, normal_mm, normal_sigma_mm)
        reading, motion = self._contact.of(image, drift, tracks.tracked, given, clock)
        self._drift.loaded = self._motion.loaded(reading)
        if reading is not None and not reading.known:
            problems = (*problems, reading.problem)
        try:
            field, wrench = self._forces_of(motion, tracks.tracked, reading, noise, drift, clock)
        except IfemError as error:
            return numbered(problems=(*problems, str(error)))
        if self._motion.moved(motion):
            problems = (*problems, *frame_problems.misfit_problem(field.misfit))
        known = reading is not None and reading.known
        self._last_force = field.force_n if known else None
        self._drift.rezero(drift, self._index if times.time_s is None else times.time_s)
        return numbered(
            marker_displacement_mm=motion,
            field=field,
            wrench=self._with_gel(wrench, field, reading),
            normal_known=known,
            problems=problems,
            extra=self._remarks(reading, field, drift),
        )

    @single_threaded
    def tare(self, frame: Frame | NDArray[np.uint8], *, time_s: float | None = None) -> TareRecord:
        """Take a frame of the untouched gel as the new rest; it is not counted as a frame.

        Args:
            frame: As for `process`.
            time_s: When it was taken; by default as for `process`.

        Returns:
            The drift since the calibration, which is also appended to `rests`.

        Raises:
            TareError: The frame cannot be read, too few markers are seen, something touches the
                gel, or the camera has moved too far.
        """
        time_s = FrameTimes.of(frame, time_s, None).time_s
        image: Any = frame.image if isinstance(frame, Frame) else frame
        try:
            image, tracked = self._followed(image)
        except ValueError as error:
            raise TareError(str(error)) from error
        problem = self._check.refusal(tracked)
        if problem:
            raise TareError(problem)
        # A normal source looks at this frame; the frame before may have been touched.
        self._drift.loaded = self._drift.loaded if self.normal is None else None
        drift = self._drift.update(tracked.tracks, self._noise_px(tracked.tracks))
        if self.normal is not None and self.normal.look(image, drift.positions_px) is not None:
            raise TareError(LIGHT_CHANGED)
        return self._drift.tare(drift, tracked.tracks, self._index if time_s is None else time_s)

    def _followed(self, image: Any) -> tuple[NDArray[np.uint8], TrackedFrame]:
        """The picture upright, and its markers. Raises ValueError for what is no picture."""
        image = upright(image, self.calibration.camera)
        problem = frame_problems.size_problem(image, self.calibration.camera)
        problem = problem or self._check.faults.broken(image)
        if problem:
            raise ValueError(problem)
        return image, self._check.whole.of(self._tracker.update(image))

    def _drifted(self, tracked: TrackedFrame) -> tuple[str, float, FrameDrift | None]:
        """Why a frame gives no forces, noise of its markers in px, and drift; None if refused."""
        refusal = self._check.refusal(tracked)
        if refusal:
            self._tracker.undo()
            return refusal, 0.0, None
        noise = self._noise_px(tracked.tracks)
        drift = self._drift.update(tracked.tracks, noise)
        refusal = drift.problem or self._check.moved(tracked.tracks)
        return refusal, noise, None if refusal else drift

    def _with_gel(self, wrench: Wrench, field: ForceField, reading: NormalReading | None) -> Wrench:
        """The wrench with what is not known of the gel in its covariance."""
        wrench = with_untouched(wrench, reading, self._check.unseen.thickness_mm)
        if self.gel is None:
            return wrench
        return self.gel.added(wrench, field.displacement_mm, reading, field.by_linear_law)

    def _remarks(
        self, reading: NormalReading | None, field: ForceField, drift: FrameDrift
    ) -> dict[str, Any]:
        """What a result says beside its forces."""
        return {
            **({} if reading is None else {"normal": reading.summary()}),
            **field.summary(),
            "gel": self.gel_law.at(field.displacement_mm, field.by_linear_law),
            **self._drift.findings(drift),
        }

    def _numbered(self, times: FrameTimes, **found: Any) -> FrameResult:
        index, self._index = self._index, self._index + 1
        time_s = float(index) if times.time_s is None else times.time_s
        found |= {"stamp_s": times.stamp_s, "sensor_s": times.sensor_s}
        return FrameResult(index, time_s, **found)

    def _noise_px(self, tracks: Tracks) -> float:
        if self.settings.noise_px is not None:
            return self.settings.noise_px
        return noise_px(self._tracker.reference, tracks.displacement_px)

    def _forces_of(
        self,
        motion: Array,
        tracked: NDArray[np.bool_],
        reading: NormalReading | None,
        noise: float,
        drift: FrameDrift,
        clock: FrameClock,
    ) -> tuple[ForceField, Wrench]:
        """Force field and wrench for a motion (n, 3) of the markers. Raises IfemError."""
        if reading is not None and reading.known and reading.forces is not None:
            forces = reading.forces
            covariance = self._covariance.of_forces(reading, noise, drift)
            wrench = self._wrench.wrench(forces.force_n, covariance)
            field = self._forces.direct.field_of(
                forces.force_n,
                forces.displacement_mm,
                reading.touched,
                by_linear_law=forces.by_linear_law,
            )
            return field, wrench
        noise_mm = noise * self._motion.view.usual_mm_per_px
        filled = self._check.unseen.filled(motion, tracked, noise_mm)
        interpolation, displacement = self._motion.of_nodes(filled.motion_mm, reading)
        clock.stage("interpolate")
        touched = reading.touched if reading is not None and reading.known else None
        field = self._forces.estimate(displacement, touched, self._last_force, noise)
        clock.stage("force")
        covariance = self._covariance.of_motion(interpolation, filled, noise, reading, drift)
        wrench = self._wrench.wrench(field.force_n, covariance)
        clock.stage("wrench")
        return field, wrench
