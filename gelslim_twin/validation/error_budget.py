"""Error budget: the error in newtons by each idealisation of the paper's pipeline, without noise.

Marker positions and normal motion are the true ones, so that only the named source differs from
the truth: large strain, thickness, modulus, pose between finger and force sensor, projection.
Forces are those of the paper's operator of one layer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.design import bundle_camera, marker_heights_mm
from gelslim_force.motion.marker_motion import Compensation, MarkerView
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.validation.score import Spread, spread
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
THICKNESS_OFF = 0.05
"""Relative error of the thickness: a casting of 2 mm errs by 0.1 mm."""
MODULUS_OFF = 0.10
"""Relative error of the modulus, by the tensile test and between batches."""
POSE_OFF_DEG = 2.0
"""Rotation about x and y between the finger and the reference force sensor."""


@dataclass(frozen=True)
class Source:
    """One source of error, or several together."""

    name: str
    strained: bool = False
    thickness: float = 1.0
    modulus: float = 1.0
    pose_deg: float = 0.0
    compensation: Compensation = "exact"
    cap: bool = False


SOURCES = (
    Source("none: linear, all known"),
    Source("nonlinearity", strained=True),
    Source(f"thickness {THICKNESS_OFF:+.0%}", thickness=1 + THICKNESS_OFF),
    Source(f"modulus E {MODULUS_OFF:+.0%}", modulus=1 + MODULUS_OFF),
    Source(f"pose {POSE_OFF_DEG:g}° about x, y", pose_deg=POSE_OFF_DEG),
    Source("projection as printed", compensation="printed"),
    Source("projection ignored", compensation="none"),
    Source("ball's cap for normal motion", cap=True),
)
TOGETHER = Source(
    "the first four together", True, 1 + THICKNESS_OFF, 1 + MODULUS_OFF,
    POSE_OFF_DEG,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class BudgetRig:
    """The sensor to which the sources of error are applied."""

    bundle: Bundle

    @cached_property
    def points_mm(self) -> Array:
        """(c, 3) surface nodes."""
        return np.asarray(self.bundle.mesh.surface_mm)

    @cached_property
    def _view(self) -> MarkerView:
        camera = bundle_camera(self.bundle)
        return MarkerView(camera, camera.project(self._rest_mm), self._rest_mm[:, 2])

    @cached_property
    def _rest_mm(self) -> Array:
        markers = self.bundle.markers
        assert markers is not None
        places = np.asarray(markers.positions_mm, dtype=float)[:, :2]
        return np.column_stack([places, marker_heights_mm(self.bundle)])

    @cached_property
    def _to_markers(self) -> Callable[[Array], Array]:
        operator = marker_to_node(self.points_mm, self._rest_mm)
        return lambda values: np.asarray(operator @ values)

    def motion_mm(self, state: GelState, source: Source) -> Array:
        """Displacement (c, 3) of the nodes as the paper's pipeline would measure it."""
        true = state.displacement_mm
        w = true[:, 2]
        if source.cap and (state.touch > 0).any():
            touched = state.touch > 0
            w = np.where(touched, w - w[touched].max(), 0.0)
        at_markers = self._to_markers(true)
        places = self._view.camera.project(self._rest_mm + at_markers)
        lateral = self._view.lateral_motion(places, self._to_markers(w), source.compensation)
        assert self.bundle.markers is not None
        return np.column_stack([self.bundle.markers.sparse(lateral), w])

    def operator(self, source: Source) -> SurfaceOperator:
        """The paper's operator on the pad that the pipeline assumes."""
        mesh, gel = self.bundle.mesh, self.bundle.material
        if source.thickness != 1:
            hx, hy, hz = mesh.cell_size_mm
            x, y, z = mesh.origin_mm
            cells = np.ascontiguousarray(mesh.occupancy)
            thicker = (x, y, z * source.thickness)
            mesh = PadMesh.from_occupancy(cells, (hx, hy, hz * source.thickness), thicker)
        believed = Material(gel.youngs_modulus_mpa * source.modulus, gel.poissons_ratio,
                            gel.density_kg_m3)  # fmt: skip
        made = build_bundle(mesh, believed, self.bundle.formulation, with_stiffness=False)
        return made.surface_operator("paper")


def error_budget(
    bundle: Bundle, strained: Sequence[GelState], linear: Sequence[GelState]
) -> tuple[Spread, ...]:
    """Errors of the resultant with each source alone, and with the first four together.

    Args:
        bundle: the sensor.
        strained: states of the gel at large strain.
        linear: of a linear gel at the same poses.
    """
    rig = BudgetRig(bundle)
    return tuple(_row(rig, s, strained if s.strained else linear) for s in (*SOURCES, TOGETHER))


def _row(rig: BudgetRig, source: Source, states: Sequence[GelState]) -> Spread:
    operator = rig.operator(source)
    turn = rotation(Pose(tilt_x_deg=source.pose_deg, tilt_y_deg=source.pose_deg))
    true = np.array([s.force_n.sum(axis=0) for s in states])
    found = np.array([operator.force(rig.motion_mm(s, source)).sum(axis=0) for s in states])
    return spread(source.name, true @ turn.T, found)
