"""A source of the normal motion for objects of unknown shape: light and markers together.

Without light, as in the pictures of a mono camera, the markers alone are used: in a tilted view
they show height.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.design import marker_heights_mm
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.normal_source import FoundForces, NormalReading
from gelslim_force.contact.shading_change import MOST_FAINT, TOO_FAINT, LostColourError
from gelslim_force.forces.finite_strain import deep_mm, law_of
from gelslim_force.frames.upright import upright
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.finer_pressure import FinerPressure
from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.fit_state import JointForces
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.light.view import LightView
from gelslim_force.joint.marker_misfit import with_misfit
from gelslim_force.joint.moved_region import MovedRegion
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.node_relief import NodeRelief
from gelslim_force.joint.off_design import OffDesign
from gelslim_force.joint.responses import Responses
from gelslim_force.joint.settings import MARKERS_ALONE, JointSettings
from gelslim_force.joint.strained_gel import StrainedGel
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.tracking.marker_noise import noise_px
from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_map import LightMap
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.compliance_change import ComplianceChange
from ifem_export.compliance.finer_response import (
    EndlessLayers,
    finer_response,
    half_step_response,
)
from ifem_export.errors import IfemError
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.surface_lattice import neighbour_matrix, surface_share_mm2

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
_FINER_TO = 1.6
"""Depth to which a linear gel is fitted at half the pitch, over that from which it is deep."""
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
    """

    def __init__(
        self, estimator: JointEstimator, reference: ReferenceLattice, unseen_mm: float = 0.0
    ) -> None:
        self.estimator, self.reference, self.unseen_mm = estimator, reference, unseen_mm
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: JointForces | None = None
        self._faint = 1.0

    @property
    def unseen_n(self) -> float:
        """Normal force that the light of the last frame may not show."""
        chosen = self.estimator.settings
        bare = self.estimator.light is None
        least = chosen.unseen_by_markers if bare else chosen.unseen_force
        return least * self.estimator.youngs_modulus_mpa * self._faint

    @property
    def most_gain(self) -> float:
        """Difference of the gain of the light from 1 beyond which something else changes it."""
        return _MOST_SIGMAS * self.estimator.settings.gain_sigma

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> JointForces | str | None:
        """Estimate the forces of a frame whose markers are at (n, 2).

        Returns:
            The forces, None without contact, or why there are no forces.
        """
        noise = noise_px(self.reference, markers_px - self.reference.positions_px)
        last, self._last = self._last, None
        try:
            frame = self.estimator.frame(image, markers_px, noise)
            self._faint = 1.0 if frame.seen is None else frame.seen.shading.faint
            if self._faint > MOST_FAINT:
                return TOO_FAINT
            found = self.estimator.estimate(frame, last)
            if found is not None and last is not None and not self._explains(found):
                # The frame before was spoiled, or showed another contact.
                found = self.estimator.estimate(frame)
        except (IfemError, LostColourError) as error:
            return str(error)
        if found is None or self._explains(found):
            self._last = found and with_misfit(self.estimator, found, markers_px, noise)
            return self._last
        return None if -found.force_n[:, 2].sum() < self.unseen_n else found

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
        )
        depth = max(0.0, -float(height.min()))
        shown = seen.shown if seen.unexplained < _NOT_OF_THE_GEL else None
        return NormalReading(
            height, np.zeros(count), seen.region, depth_mm=depth, forces=forces, shown=shown
        )


def unknown_shape(
    bundle: Bundle,
    calibration: Calibration,
    reference: NDArray[np.uint8] | None,
    *,
    gel: str = "linear",
    settings: JointSettings | None = None,
    light: LightCalibration | None = None,
    more: Sequence[tuple[Bundle, float]] = (),
) -> UnknownShape:
    """Make the source for one calibrated sensor.

    Args:
        bundle: The sensor, with markers and light.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact; None for forces from the markers alone.
        gel: Law of the gel as in `PipelineSettings`.
        settings: What is assumed; the defaults if None.
        light: The light as built; see `JointSettings.with_light`.
        more: The sensor with more of each uncertain parameter of its gel, and how much more, as
            `BuiltGel` has them: what the forces change by these is then in `JointForces.by_gel`.

    Returns:
        The source.

    Raises:
        ValueError: The reference is dark or of another size.
        MeshError: The pad has too many surface nodes.
    """
    gel = law_of(bundle, gel)
    chosen = settings or (MARKERS_ALONE if reference is None else JointSettings())
    if reference is not None:
        chosen = chosen.on_mesh(_cell_share(bundle))
    if light is not None:
        chosen = chosen.with_light(light)
    followed, skin = calibration.reference, bundle.membranes
    points_mm = np.asarray(bundle.mesh.surface_mm)
    cell_mm = np.asarray(bundle.mesh.cell_size_mm[:2])
    lattice = NodeLattice.of(points_mm, cell_mm)
    heights_mm = marker_heights_mm(bundle)[followed.markers]
    view = MarkerView(calibration.camera, followed.positions_px, heights_mm)
    to_markers = marker_to_node(points_mm, view.rest_mm)
    seen = None
    if reference is not None:
        seen = _light_view(bundle, calibration, reference, lattice, light)
    # A linear gel is too soft by more than shadows matter, and they make up for a part of it.
    finer = None if seen is None else _finer_pressure(bundle, lattice)
    bare = seen is None or gel == "linear"
    estimator = JointEstimator(
        points_mm,
        surface_share_mm2(bundle.mesh),
        neighbour_matrix(points_mm, cell_mm),
        lattice,
        Responses(SurfaceCompliance(bundle, skin=skin), to_markers),
        view,
        to_markers,
        lattice.interpolation(view.rest_mm) - to_markers,
        lattice.nearest_node(view.rest_mm[:, :2]),
        view.by_height(),
        seen,
        None if seen is None else LightLaw.of(_traced(bundle), chosen.gamma),
        bundle.material.youngs_modulus_mpa,
        chosen,
        strained=_strained(bundle, gel),
        relief=None if bare else NodeRelief.of(_traced(bundle), lattice, deep_mm(bundle)),
        deep_mm=math.inf if gel == "linear" else deep_mm(bundle),
        finer=None if finer is None else finer.surface,
        pressure=finer if chosen.finer_pressure else None,
        # What a linear gel has wrong in deep contacts is not to be found between the nodes.
        finer_to_mm=_FINER_TO * deep_mm(bundle) if gel == "linear" else math.inf,
    )
    estimator = replace(estimator, off_design=_off_design(bundle, estimator, calibration, more))
    if seen is None:
        estimator = replace(estimator, moved=_moved_region(estimator))
    least = chosen.unseen_by_markers if seen is None else chosen.unseen_force
    unseen_n = least * bundle.material.youngs_modulus_mpa
    return UnknownShape(estimator, followed, unseen_n / layer_stiffness_n_mm(bundle))


def _strained(bundle: Bundle, gel: str) -> StrainedGel | None:
    if gel == "linear":
        return None
    return StrainedGel.of(bundle, deep_mm(bundle) if gel == "auto" else 0.0)


def _finer_pressure(bundle: Bundle, lattice: NodeLattice) -> FinerPressure:
    layers = EndlessLayers.of(bundle)
    surface = FinerSurface.of(lattice, finer_response(bundle, layers))
    return FinerPressure.of(surface, half_step_response(bundle, layers))


def _cell_share(bundle: Bundle) -> float:
    """Side of a cell over the thickness of the gel."""
    x, y, z = bundle.mesh.cell_size_mm
    return (x + y) / (2 * z * bundle.mesh.layers)


def _traced(bundle: Bundle) -> LightMap:
    return LightMap.from_arrays(bundle.light)


def _moved_region(estimator: JointEstimator) -> MovedRegion:
    return MovedRegion(
        estimator.responses,
        estimator.by_height,
        estimator.area_mm2,
        estimator.neighbours,
        estimator.lattice,
        estimator.youngs_modulus_mpa,
    )


def _off_design(
    bundle: Bundle,
    estimator: JointEstimator,
    calibration: Calibration,
    more: Sequence[tuple[Bundle, float]],
) -> OffDesign:
    deviation = calibration.deviation
    return OffDesign(
        ComplianceChange.of(bundle, more) if more else None,
        estimator.nodes_to_markers,
        estimator.by_height,
        0.0 if deviation is None else deviation.lean_sigma_mm_per_mm,
    )


def _light_view(
    bundle: Bundle,
    calibration: Calibration,
    reference: NDArray[np.uint8],
    lattice: NodeLattice,
    light: LightCalibration | None,
) -> LightView:
    followed = calibration.reference
    radius_px = 2 * np.sqrt(np.abs(calibration.dots.moments_px2).max(axis=1))
    return LightView(
        calibration.camera,
        upright(reference, calibration.camera),
        followed.positions_px,
        radius_px[np.searchsorted(calibration.markers, followed.markers)],
        lattice,
        _traced(bundle),
        light,
    )


def layer_stiffness_n_mm(bundle: Bundle) -> float:
    """Normal force of a wide bonded layer per mm by which its whole surface sinks."""
    mesh, gel = bundle.mesh, bundle.material
    ratio = gel.poissons_ratio
    modulus = gel.youngs_modulus_mpa * (1 - ratio) / ((1 + ratio) * (1 - 2 * ratio))
    thickness_mm = mesh.layers * mesh.cell_size_mm[2]
    return float(modulus * surface_share_mm2(mesh).sum() / thickness_mm)
