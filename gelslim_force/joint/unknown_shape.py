"""A source of the normal motion for objects of unknown shape: light and markers together.

Without light, as in the pictures of a mono camera, the markers alone are used: in a tilted view
they show height.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.normal_source import FoundForces, NormalReading
from gelslim_force.contact.shading_change import MOST_FAINT, TOO_FAINT, LostColourError
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.fit_state import FrameData, JointForces
from gelslim_force.joint.markers.misfit import with_hidden, with_misfit
from gelslim_force.joint.rounds import Steps, finished
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.drift_filter import FrameDrift
from gelslim_force.tracking.marker_noise import noise_px
from ifem_export.errors import IfemError
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.operators.solver import ConvergenceError

Array = NDArray[np.float64]
LARGEST_UNEXPLAINED = 0.7
_NOT_OF_THE_GEL = 0.45
"""Share of the change of light that forces leave unexplained from which light around lost markers
may be that of something before the gel, such as a finger."""
_UNEXPLAINED = "forces on the contact seen leave {:.0%} of the change of the light unexplained"
_UNCERTAIN = (
    "the markers alone show the normal force as {:.2g} N with a standard deviation of {:.2g} N, "
    "which is more than {:.0%} of it: it is unknown"
)
_MOST_SIGMAS = 4
_OTHER_GAIN = (
    "the light changes {:.1f} times as much as the contact explains, and more than 1 ± {:.1f} is "
    "not expected: something else changes it, or the light has to be calibrated"
)


class UnknownShape:
    """Finds forces and motion of each frame; `NormalSource` for `ForcePipeline`.

    It keeps the forces of the last frame, from which the next estimate starts.

    Attributes:
        estimator: Does the work.
        reference: Lattice of the followed markers.
        unseen_mm: Standard deviation of the height where no contact is seen.
        without_strain: Takes its place where the gel's law at large strain explains no motion; None
            where there is no such law, or no other is allowed.
    """

    def __init__(
        self,
        estimator: JointEstimator,
        reference: ReferenceLattice,
        unseen_mm: float = 0.0,
        without_strain: JointEstimator | None = None,
    ) -> None:
        self.estimator, self.reference, self.unseen_mm = estimator, reference, unseen_mm
        self.without_strain = without_strain
        self.reset()

    def prepare(self) -> None:
        """Compute what all nodes do to markers and light, so that no frame waits for it."""
        self.estimator.responses.prepare()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: JointForces | None = None
        self._faint = 1.0

    @property
    def unseen_n(self) -> float:
        """Normal force that the light of the last frame may not show."""
        return self._usually_unseen_n * self._faint

    @property
    def _usually_unseen_n(self) -> float:
        chosen = self.estimator.settings
        bare = self.estimator.light is None
        least = chosen.unseen_by_markers if bare else chosen.unseen_force
        return least * self.estimator.youngs_modulus_mpa

    @property
    def most_gain(self) -> float:
        """Difference of the gain of the light from 1 beyond which something else changes it."""
        return _MOST_SIGMAS * self.estimator.settings.gain_sigma

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> JointForces | str | None:
        """Estimate the forces of a frame whose markers are at (n, 2).

        Returns:
            The forces, None without contact, or why there are no forces.
        """
        return finished(self.looking(image, markers_px))

    def look_corrected(
        self, image: NDArray[np.uint8], drift: FrameDrift
    ) -> JointForces | str | None:
        """`look` at a frame whose markers are corrected for a drift."""
        return finished(self.looking(image, drift.positions_px, drift))

    def looking(
        self, image: NDArray[np.uint8], markers_px: Array, drift: FrameDrift | None = None
    ) -> Steps[JointForces | str | None]:
        """`look`, which stops before each solution; no other frame is looked at before it ends."""
        noise = noise_px(self.reference, markers_px - self.reference.positions_px)
        last, self._last = self._last, None
        try:
            frame = self.estimator.frame(image, markers_px, noise, drift)
            self._faint = 1.0 if frame.seen is None else frame.seen.shading.faint
            if self._faint > MOST_FAINT:
                return TOO_FAINT
            found = yield from self._estimate(frame, last)
            if found is not None and last is not None and not self._explains(found):
                # The frame before was spoiled, or showed another contact.
                found = yield from self._estimate(frame)
        except (IfemError, LostColourError) as error:
            return str(error)
        if found is None or self._explains(found):
            if found is not None:
                found = with_misfit(self.estimator, found, frame)
                more_n = self.unseen_n - self._usually_unseen_n
                found = with_hidden(self.estimator, found, more_n)
            self._last = found
            return found
        return None if -found.force_n[:, 2].sum() < self.unseen_n else found

    def _estimate(
        self, frame: FrameData, last: JointForces | None = None
    ) -> Steps[JointForces | None]:
        """Forces of a frame, by a linear gel where no motion at large strain explains it."""
        try:
            return (yield from self.estimator.steps(frame, last))
        except (FiniteStrainError, ConvergenceError):
            if self.without_strain is None:
                raise
        found = yield from self.without_strain.steps(frame)
        return found and replace(found, by_linear_law=True)

    def _explains(self, found: JointForces) -> bool:
        """Whether forces explain the change of the light, with a gain that is expected."""
        return found.unexplained <= LARGEST_UNEXPLAINED and abs(found.gain - 1) <= self.most_gain

    def motion(
        self, seen: JointForces | str | None, lateral_mm: Array | None = None
    ) -> NormalReading:
        """Motion and forces of what `look` saw; zero without contact."""
        count = len(self.estimator.points_mm)
        if isinstance(seen, str):
            return NormalReading.unknown(count, seen)
        if seen is None:
            return NormalReading.unseen(count, self.unseen_n, self.unseen_mm * self._faint)
        if seen.unexplained > LARGEST_UNEXPLAINED:
            return NormalReading.unknown(count, _UNEXPLAINED.format(seen.unexplained))
        normal_n, most = abs(float(seen.force_n[:, 2].sum())), self.estimator.settings.most_sigma
        sigma_n = float(np.sqrt(seen.covariance[2, 2]))
        if self.estimator.light is None and sigma_n > most * normal_n:
            return NormalReading.unknown(count, _UNCERTAIN.format(normal_n, sigma_n, most))
        if abs(seen.gain - 1) > self.most_gain:
            return NormalReading.unknown(count, _OTHER_GAIN.format(seen.gain, self.most_gain))
        height = seen.displacement_mm[:, 2]
        forces = FoundForces(
            seen.force_n,
            seen.displacement_mm,
            seen.covariance,
            seen.by_marker,
            seen.gain,
            seen.unexplained,
            seen.by_gel,
            seen.by_linear_law,
        )
        depth = max(0.0, -float(height.min()))
        shown = seen.shown if seen.unexplained < _NOT_OF_THE_GEL else None
        return NormalReading(
            height, np.zeros(count), seen.region, depth_mm=depth, forces=forces, shown=shown
        )
