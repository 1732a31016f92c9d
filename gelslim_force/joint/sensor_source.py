"""Makes the source of forces of objects of unknown shape for one calibrated sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.design import marker_heights_mm
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.forces.finite_strain import deep_mm, law_of
from gelslim_force.frames.upright import upright
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.finer_pressure import FinerPressure
from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.light.view import LightView
from gelslim_force.joint.moved_region import MovedRegion
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.node_relief import NodeRelief
from gelslim_force.joint.off_design import OffDesign
from gelslim_force.joint.responses import Responses
from gelslim_force.joint.settings import MARKERS_ALONE, JointSettings
from gelslim_force.joint.strained_gel import StrainedGel
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.layer.beyond_mesh import (
    EndlessLayers,
    NearMotion,
    finer_response,
    half_step_response,
)
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_optics.light.light_map import LightMap
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.compliance_change import ComplianceChange
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.surface_lattice import neighbour_matrix, surface_share_mm2

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]


def unknown_shape(
    bundle: Bundle,
    calibration: Calibration,
    reference: NDArray[np.uint8] | None,
    *,
    gel: str,
    settings: JointSettings | None = None,
    light: LightCalibration | None = None,
    more: Sequence[tuple[Bundle, float]] = (),
) -> UnknownShape:
    """Make the source for one calibrated sensor.

    Args:
        bundle: The sensor, with markers and light.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact; None for forces from the markers alone.
        gel: Law of the gel as in `PipelineSettings`. With `auto` a frame that the law at large
            strain does not explain has the forces of a linear gel.
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
    to_markers, by_height = marker_to_node(points_mm, view.rest_mm), view.by_height()
    seen = None
    if reference is not None:
        seen = _light_view(bundle, calibration, reference, lattice, (chosen.gamma, light))
    layers, compliance = EndlessLayers.of(bundle), SurfaceCompliance(bundle, skin=skin)
    finer = None if seen is None else _finer_pressure(layers, lattice)
    discs = NearMotion.of(layers, _disc_mm(calibration, view))
    estimator = JointEstimator(
        points_mm,
        surface_share_mm2(bundle.mesh),
        neighbour_matrix(points_mm, cell_mm),
        lattice,
        Responses(compliance, to_markers, by_height, (discs, view.rest_mm[:, :2])),
        view,
        to_markers,
        lattice.interpolation(view.rest_mm) - to_markers,
        lattice.nearest_node(view.rest_mm[:, :2]),
        by_height,
        seen,
        bundle.material.youngs_modulus_mpa,
        chosen,
        relief=None if seen is None else NodeRelief.of(_traced(bundle), lattice),
        finer=None if finer is None else finer.surface,
        pressure=finer if chosen.finer_pressure else None,
    )
    estimator = replace(estimator, off_design=_off_design(bundle, estimator, calibration, more))
    if seen is None:
        estimator = replace(estimator, moved=_moved_region(estimator))
    strained = estimator if gel == "linear" else _strained(bundle, gel, estimator)
    least = chosen.unseen_by_markers if seen is None else chosen.unseen_force
    unseen_n = least * bundle.material.youngs_modulus_mpa
    return UnknownShape(
        strained,
        followed,
        unseen_n / layer_stiffness_n_mm(bundle),
        estimator if gel == "auto" else None,
    )


def _strained(bundle: Bundle, gel: str, linear: JointEstimator) -> JointEstimator:
    """The estimator of a linear gel with the law at large strain."""
    return replace(
        linear,
        strained=StrainedGel.of(bundle, deep_mm(bundle) if gel == "auto" else 0.0),
        deep_mm=deep_mm(bundle),
    )


def _finer_pressure(layers: EndlessLayers, lattice: NodeLattice) -> FinerPressure:
    surface = FinerSurface.of(lattice, finer_response(layers))
    return FinerPressure.of(surface, half_step_response(layers))


def _cell_share(bundle: Bundle) -> float:
    """Side of a cell over the thickness of the gel."""
    x, y, z = bundle.mesh.cell_size_mm
    return (x + y) / (2 * z * bundle.mesh.layers)


def _traced(bundle: Bundle) -> LightMap:
    return LightMap.from_arrays(bundle.light)


def _moved_region(estimator: JointEstimator) -> MovedRegion:
    return MovedRegion(
        estimator.responses,
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
    camera: tuple[float, LightCalibration | None],
) -> LightView:
    """The bins of the pictures; `camera` is the exponent and the light as built."""
    return LightView(
        calibration.camera,
        upright(reference, calibration.camera),
        calibration.reference.positions_px,
        _radii_px(calibration),
        lattice,
        _traced(bundle),
        *camera,
    )


def _radii_px(calibration: Calibration) -> Array:
    """(n,) of the dots of the followed markers."""
    radius_px = 2 * np.sqrt(np.abs(calibration.dots.moments_px2).max(axis=1))
    followed = np.searchsorted(calibration.markers, calibration.reference.markers)
    return np.asarray(radius_px[followed])


def _disc_mm(calibration: Calibration, view: MarkerView) -> float:
    """Radius of most dots: the mean motion of a dot is what its centre shows."""
    return float(np.median(_radii_px(calibration) * view.mean_mm_per_px))


def layer_stiffness_n_mm(bundle: Bundle) -> float:
    """Normal force of a wide bonded layer per mm by which its whole surface sinks."""
    mesh, gel = bundle.mesh, bundle.material
    ratio = gel.poissons_ratio
    modulus = gel.youngs_modulus_mpa * (1 - ratio) / ((1 + ratio) * (1 - 2 * ratio))
    thickness_mm = mesh.layers * mesh.cell_size_mm[2]
    return float(modulus * surface_share_mm2(mesh).sum() / thickness_mm)
