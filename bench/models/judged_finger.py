"""A finger as the tracer, the twin and Mitsuba have it, and their pictures of the same gel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import ROOT
from bench.models.dented_surfaces import Height
from bench.models.mitsuba_finger import Meshes, film_camera, finger_shapes, rendered, sheet
from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile, virtual_camera
from gelslim_cad.light.scene import light_scene
from gelslim_cad.sensor import SMOOTHING_MM
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene, Medium
from gelslim_optics.light.trace import trace_light
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from ifem_export.markers.grid import build_marker_grid

Array = NDArray[np.float64]
DESIGN = ROOT / "designs" / "gelslim2.yaml"
STEP_MM, BORDER_MM = 0.1, 1.0
TRACED_RAYS = 1 << 20


@dataclass(frozen=True, eq=False)
class JudgedFinger:
    """A finger as the tracer, the twin and Mitsuba have it.

    Without `relief` the twin draws by the slopes of the surface alone.
    """

    scene: LightScene
    camera: VirtualCamera
    relief: bool = True

    @classmethod
    def of_design(cls) -> JudgedFinger:
        """`gelslim2` with one index for all colours, no absorption, LEDs in unbroken rows."""
        d = derive(read_spec(DESIGN).spec)
        scene = light_scene(d, guide_profile(d))
        acrylic, gel = (Medium(scene.media[name].index) for name in ("acrylic", "gel"))
        half = scene.gel_x_mm[1] - 1.0
        rows = tuple(
            replace(row, x_mm=tuple(np.arange(-half, half + 0.1, row.size_mm)))
            for row in scene.sources
        )
        media = {"air": Medium(1.0), "acrylic": acrylic, "leg": acrylic, "gel": gel}
        return cls(replace(scene, media=media, sources=rows), replace(virtual_camera(d), lens=None))

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad."""
        face = self.scene.profile.edge(self.scene.face).curve
        return float(np.ptp(self.scene.gel_x_mm)), abs(face.end[0] - face.start[0])

    @cached_property
    def traced(self) -> LightResult:
        """Our trace of the untouched gel."""
        return trace_light(self.scene, TRACED_RAYS)

    @cached_property
    def twin(self) -> FrameRenderer:
        """The twin's renderer with the traced light alone: no vignetting, mottle or print."""
        bins = np.stack([self.traced.irradiance(c) for c in self.traced.colours])
        light = LightMap.from_bins(
            bins, *self.size_mm, azimuth_deg=[90, -90], elevation_deg=[25, 25],
            colour=np.eye(3)[:2], smooth_mm=SMOOTHING_MM, fans=self.traced.fans,
        )  # fmt: skip
        grid = build_marker_grid(5, 5, 1.0, 0.5)
        look = Look(shading=Shading(relief=self.relief))
        return FrameRenderer(self.camera, grid, light, Pad(*self.size_mm), look)

    def surface(self, height: Height) -> SurfaceState:
        """The gel raised by a height of x and y, which falls to 0 at the pad's border."""
        axes = [np.arange(-s / 2, s / 2 + STEP_MM / 2, STEP_MM) for s in self.size_mm]
        x, y = np.meshgrid(*axes)
        inward = np.minimum(*(s / 2 - np.abs(v) for s, v in zip(self.size_mm, (x, y), strict=True)))
        share = np.clip(inward / BORDER_MM, 0, 1)
        raised = height(x, y) * share**2 * (3 - 2 * share)
        return SurfaceState(*axes, np.stack([0 * x, 0 * x, raised], axis=2))

    def drawn(self, surface: SurfaceState, view: View) -> Array:
        """Light (h, w, 2) of the blocks of a view in the twin's picture."""
        ink = np.zeros((self.camera.image_height_px, self.camera.image_width_px), np.float32)
        found = self.twin.values(ink, surface)[..., :2].astype(float)
        b = view.block_px
        rows, columns = (len(v) // b for v in (found, found[0]))
        blocks = found[: rows * b, : columns * b].reshape(rows, b, columns, b, 2).mean(axis=(1, 3))
        return np.asarray(blocks[view.rows, view.columns])

    def judged(
        self, mi: Any, surface: SurfaceState, view: View, runs: int, samples: int, seed: int = 0
    ) -> Array:
        """The same pictures (runs, h, w, 2) by Mitsuba."""
        x, y = np.meshgrid(surface.x_mm, surface.y_mm)
        coat = np.dstack([x, y, 0 * x]) + surface.displacement_mm
        with TemporaryDirectory() as folder:
            shapes = dict(finger_shapes(self.scene, sheet(coat), Meshes(Path(folder))))
            sensor = film_camera(mi, self.camera, view.block_px, (view.rows, view.columns))
            return rendered(mi, shapes, sensor, runs, samples, seed)

    def view(self, half_mm: tuple[float, float], block_px: int) -> View:
        """The blocks that see the part of the pad within `half_mm` of its middle."""
        corners = np.array([(x, y, 0.0) for x in (-1, 1) for y in (-1, 1)]) * [*half_mm, 0.0]
        seen = self.camera.project(corners) / block_px
        (left, top), (right, bottom) = np.floor(seen.min(axis=0)), np.ceil(seen.max(axis=0))
        return View(block_px, slice(int(top), int(bottom)), slice(int(left), int(right)))


@dataclass(frozen=True)
class View:
    """A part of the picture in square blocks of pixels."""

    block_px: int
    rows: slice
    columns: slice
