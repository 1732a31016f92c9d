"""Sensors, presses with known forces and drawn frames for the benches of the force pipeline.

The truth of a press comes from the pad at half the pitch with eight layers, not from the mesh that
the pipeline uses; dots are drawn by exact area under strong keystone, in traced light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import ROOT
from gelslim_cad.dimensions import derive
from gelslim_cad.sensor import pad_light
from gelslim_cad.spec.reader import read_spec
from gelslim_force.contact.indenter import Sphere
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera, reflect_point
from gelslim_optics.light.light_map import LightMap, light_arrays
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
from gelslim_twin.render.image_sensor import SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import MarkerGrid, build_marker_grid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import lumped, measure_ladder, refined
from ifem_export.operators.surface_operator import surface_operator

Array = NDArray[np.float64]
LENGTH_MM, WIDTH_MM, CORNER_MM, THICKNESS_MM = 22.0, 20.5, 1.0, 2.0
GEL = Material(0.147, 0.3223, 1000.0)
NORMAL_N, SHEAR_N = 1.0, (0.3, -0.2)
PLACE_MM, RADIUS_MM = (1.0, -1.0), 3.0
SEED = 20190521
DESIGN = ROOT / "designs" / "gelslim2.yaml"
FRAMES_LOOK = Look(
    shading=Shading(), defocus=Defocus(0.0, 22.0, 0.5), sensor_noise=SensorNoise(2.0, seed=SEED)
)


@cache
def guide_light() -> LightMap:
    """Light of the guide of `gelslim2` for a pad of this size, as a generator traces it."""
    spec = read_spec(DESIGN).spec
    size = {"length_mm": LENGTH_MM, "width_mm": WIDTH_MM}
    parts = {
        "gel": spec.design.gel.model_copy(update=size),
        "markers": spec.design.markers.model_copy(update={"rows": None, "columns": None}),
    }
    design = spec.design.model_copy(update=parts)
    return pad_light(derive(spec.model_copy(update={"design": design})))


def finger_camera(tilt_deg: float = 30.0, height_mm: float = 22.0) -> VirtualCamera:
    """VGA camera tilted from the gel's normal: dots differ two-fold in size across the picture."""
    tilt, mirror_angle = math.radians(tilt_deg), math.radians(32)
    mirror = np.array([-2.0, 0.0, -14.3])
    normal = np.array([-math.sin(mirror_angle), 0.0, math.cos(mirror_angle)])
    virtual = np.array([-(height_mm + 3.1) * math.tan(tilt), 0.0, -4.5 - height_mm])
    return VirtualCamera.from_fold(
        camera_mm=reflect_point(virtual, mirror, normal),
        pitch_rad=math.pi / 2 - 2 * mirror_angle - tilt,
        mirror_point_mm=mirror,
        mirror_angle_rad=mirror_angle,
        focal_px=640.0,
        image_width_px=640,
        image_height_px=480,
        window_bottom_z_mm=-4.5,
        layers=(Layer(2.5, 1.4906), Layer(2.0, 1.41)),
    )


@dataclass(frozen=True, eq=False)
class Press:
    """Full press: forces (c, 3) and motion (c, 3) of the bundle's surface nodes, motion (k, 3) of
    the markers, and the surface's state to draw; `sphere` fits the gel's shape in the contact."""

    force_n: Array
    nodes_mm: Array
    markers_mm: Array
    state: SurfaceState
    sphere: Sphere
    touched: NDArray[np.bool_]

    def at(self, share: float) -> SurfaceState:
        """State at a share of the press."""
        return replace(self.state, displacement_mm=share * self.state.displacement_mm)


@dataclass(frozen=True, eq=False)
class Rig:
    """One sensor with its frames."""

    grid: MarkerGrid
    mesh: PadMesh
    camera: VirtualCamera

    @cached_property
    def bundle(self) -> Bundle:
        """As `gelslim bundle` makes it: ladder measured, balanced rung chosen."""
        ladder = measure_ladder(self.mesh, GEL, "bbar")
        grid = self.grid
        return build_bundle(
            self.mesh,
            GEL,
            "bbar",
            marker_positions_mm=grid.positions_mm,
            marker_arrays=grid.labels,
            camera=self.camera.to_record(),
            light=light_arrays(guide_light()),
            with_stiffness=False,
            ladder=ladder,
            operator=ladder.balanced().label,
        )

    @cached_property
    def press(self) -> Press:
        """A push with shear on a disc, as Hertz's pressure, from a much finer mesh."""
        fine = refined(self.mesh)
        points = np.asarray(fine.surface_mm)
        away = np.hypot(points[:, 0] - PLACE_MM[0], points[:, 1] - PLACE_MM[1])
        shape = np.sqrt(np.maximum(1 - (away / RADIUS_MM) ** 2, 0.0))
        force = (shape / shape.sum())[:, None] * np.array([*SHEAR_N, -NORMAL_N])
        moved = surface_operator(fine, GEL, "bbar", "pcg").displacement(force)
        state = SurfaceState.from_nodes(points, moved)
        nodes = np.asarray(self.mesh.surface_mm)[:, :2]
        inside = away < 0.9 * RADIUS_MM
        curve = np.polyfit(away[inside] ** 2, moved[inside, 2], 1)[0]
        return Press(
            force_n=lumped(force, fine, self.mesh),
            nodes_mm=state.at(nodes),
            markers_mm=state.at(self.grid.positions_mm),
            state=state,
            sphere=Sphere(round(float(0.5 / curve), 2)),
            touched=np.hypot(*(nodes - PLACE_MM).T) < RADIUS_MM,
        )

    def renderer(self, look: Look = FRAMES_LOOK) -> FrameRenderer:
        """Draws this sensor's frames."""
        pad = Pad(LENGTH_MM, WIDTH_MM, CORNER_MM)
        return FrameRenderer(self.camera, self.grid, guide_light(), pad, look)

    def stream(self, count: int, look: Look = FRAMES_LOOK) -> list[RenderedFrame]:
        """Frames from rest to the full press and back, each with noise of its own; the first is
        the reference."""
        draw = self.renderer(look)
        return [draw.frame(self.press.at(s), number=k) for k, s in enumerate(shares(count))]


def shares(count: int) -> Array:
    """Share of the press in each of `count` frames: a smooth push and release."""
    return np.asarray(0.5 - 0.5 * np.cos(2 * np.pi * np.arange(count) / count))


def small_rig() -> Rig:
    """342 dots of 0.45 mm on a pitch of 1.1 mm, cells of about 0.75 mm."""
    return _rig(19, 18, 1.1, 0.45, (29, 27, 4))


def large_rig() -> Rig:
    """506 dots of 0.4 mm on a pitch of 0.9 mm, cells of about 0.5 mm (as a 42 x 40 pad)."""
    return _rig(23, 22, 0.9, 0.4, (42, 39, 4))


def _rig(
    rows: int, columns: int, pitch_mm: float, diameter_mm: float, cells: tuple[int, int, int]
) -> Rig:
    outline = RoundedRectangle(LENGTH_MM, WIDTH_MM, CORNER_MM)
    mesh, _ = build_pad_mesh(outline, THICKNESS_MM, cells=cells)
    grid = build_marker_grid(rows, columns, pitch_mm, diameter_mm)
    return Rig(grid, mesh, finger_camera())
