"""Presses of known force on designs, for forces of objects of which nothing is known.

The truth is a pad of half the pitch with eight layers and the exact layer near the forces. Pictures
are drawn with the directions of light at each place and the shadows that dents cast; the light is
that of the bundle, or one with LEDs off their places, from a trace of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pressed_samples import FinePad

import gelslim
from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.sensor import SMOOTHING_MM
from gelslim_cad.spec.reader import read_spec
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.trace import trace_light
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.image_sensor import Exposure, SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import refined
from ifem_export.operators.surface_operator import surface_operator

Array = NDArray[np.float64]
DESIGNS = Path(__file__).parents[2] / "designs"
RAYS, OFFSET_MM, GAP_MM = 1 << 17, 0.15, 0.1
GAMMA_SIGMA, GAMMA_MOST = 0.2, 0.3
"""Standard deviation of the logarithm of the camera's response, which the pipeline takes as 1, and
its largest size: a steeper response makes dim light too dark to be used."""
LEAST_N = 0.2
"""Normal force of a press."""
_INSIDE_MM = 4.0
_LOOK = Look(
    shading=Shading(pixel_step=2),
    defocus=Defocus(0.0, 1.0, still_px=0.7),
    sensor_noise=SensorNoise(1.5, 40.0, 3),
)


@dataclass(frozen=True)
class Scores:
    """Of the presses that gave forces.

    Attributes:
        presses: Number of all presses.
        normal: (n,) relative error of the normal force.
        shear: (n,) error of the shear over the normal force.
        score: (n, 3) errors over their standard deviations.
    """

    presses: int
    normal: Array
    shear: Array
    score: Array


@dataclass(frozen=True, eq=False)
class DesignedSensor:
    """A finger of a spec, as its pictures are drawn and as a pipeline takes it.

    Attributes:
        path: Of the spec.
        in_place: Whether the LEDs are where the design has them.
    """

    path: Path
    in_place: bool = False

    @cached_property
    def bundle(self) -> Bundle:
        """As `gelslim bundle` makes it, without times."""
        return gelslim.make_bundle(self.path, measure=False).bundle

    @cached_property
    def pad(self) -> FinePad:
        """That the truth is of."""
        gel, mesh = self.bundle.material, refined(self.bundle.mesh)
        return FinePad(mesh, gel, surface_operator(mesh, gel, "bbar", "pcg"))

    @cached_property
    def light(self) -> LightMap:
        """The light that is drawn."""
        known = LightMap.from_arrays(self.bundle.light)
        if self.in_place:
            return known
        d = derive(read_spec(self.path).spec)
        scene = light_scene(d, guide_profile(d))
        rows = [
            replace(row, offset_mm=sign * OFFSET_MM, gap_mm=row.gap_mm + GAP_MM)
            for row, sign in zip(scene.sources, (1, -1), strict=True)
        ]
        found = trace_light(replace(scene, sources=tuple(rows)), RAYS, seed=1)
        return LightMap.from_bins(
            np.stack([found.irradiance(colour) for colour in found.colours]),
            *TwinSensor(self.bundle).size_mm,
            azimuth_deg=known.azimuth_deg,
            elevation_deg=known.elevation_deg,
            colour=known.colour,
            smooth_mm=SMOOTHING_MM,
            fans=found.fans,
        )

    @cached_property
    def renderer(self) -> FrameRenderer:
        """Of the camera of the bundle."""
        sensor = TwinSensor(self.bundle)
        pad = Pad(*sensor.size_mm, sensor.corner_radius_mm, mottle=0.01, vignetting=0.2, seed=3)
        camera = VirtualCamera.from_record(self.bundle.camera)
        return FrameRenderer(camera, sensor.grid, self.light, pad, _LOOK)

    def picture(self, moved_mm: Array | None, number: int, gamma: float = 1.0) -> NDArray[np.uint8]:
        """Of a motion (n, 3) of the pad's surface; None for the untouched gel."""
        state = SurfaceState.at_rest(*TwinSensor(self.bundle).size_mm)
        if moved_mm is not None:
            state = SurfaceState.from_nodes(self.pad.points_mm, moved_mm)
        drawn = self.renderer.with_look(replace(_LOOK, exposure=Exposure(gamma=gamma)))
        return drawn.frame(state, number=number).image

    def presses(self, count: int) -> Iterator[tuple[Array, Array, float]]:
        """Force (3,), motion (n, 3) of the surface, and response of the camera of each press."""
        half = np.abs(self.pad.points_mm[:, :2]).max(axis=0)
        rng, young = np.random.default_rng(61), self.bundle.material.youngs_modulus_mpa
        while count > 0:
            middle = rng.uniform(-1, 1, 2) * (half - _INSIDE_MM)
            traction = _traction(self.pad.points_mm[:, :2] - middle, rng)
            force = traction * self.pad.cell_mm2 * young
            gamma = rng.normal(0, GAMMA_SIGMA)
            if -force[:, 2].sum() >= LEAST_N:
                count -= 1
                response = float(np.exp(np.clip(gamma, -GAMMA_MOST, GAMMA_MOST)))
                yield force.sum(axis=0), self.pad.displacement(force), response

    def scores(self, count: int) -> Scores:
        """Of the forces of presses of which nothing is known; the gel is as designed.

        Each press has a camera whose response is not that which the pipeline assumes.
        """
        found = [self._score(*press, number) for number, press in enumerate(self.presses(count), 1)]
        given = np.array([score for score in found if score is not None]).reshape(-1, 5)
        return Scores(count, given[:, 0], given[:, 1], given[:, 2:])

    def _score(
        self, force_n: Array, moved_mm: Array, gamma: float, number: int
    ) -> tuple[float, ...] | None:
        """Errors of normal force and shear, and three scores; None where no force was given."""
        rest = self.picture(None, 0, gamma)
        calibration = calibrate(self.bundle, rest)
        source = unknown_shape(
            self.bundle, calibration, rest, gel="linear", settings=JointSettings(gamma=1.0)
        )
        linear = PipelineSettings(gel="linear")
        pipeline = ForcePipeline(self.bundle, calibration, linear, source)
        found = pipeline.process(self.picture(moved_mm, number, gamma))
        if found.wrench is None or not found.normal_known:
            return None
        off, push = found.wrench.force_n - force_n, -force_n[2]
        score = off / found.wrench.standard_deviation[:3]
        return -off[2] / push, float(np.hypot(off[0], off[1]) / push), *score


def _traction(away_mm: Array, rng: np.random.Generator) -> Array:
    """Tractions (n, 3) over Young's modulus about a point: one or two patches with shear."""
    total = np.zeros((len(away_mm), 3))
    for number in range(1 if rng.random() < 0.7 else 2):
        angle = rng.uniform(0, np.pi)
        x, y = (away_mm - 5.0 * number * np.array([np.cos(angle), np.sin(angle)])).T
        along = x * np.cos(angle) + y * np.sin(angle)
        across = y * np.cos(angle) - x * np.sin(angle)
        half = rng.uniform(1.3, 3.5), rng.uniform(1.3, 2.5)
        inside = np.maximum(1 - (along / half[0]) ** 2 - (across / half[1]) ** 2, 0)
        pressure = rng.uniform(0.03, 0.2) * inside ** rng.choice([0.25, 0.5, 1.0])
        size, turn, twist = rng.uniform(0, 0.5), rng.uniform(0, 2 * np.pi), rng.uniform(-0.1, 0.1)
        total[:, 0] += pressure * (size * np.cos(turn) - twist * y)
        total[:, 1] += pressure * (size * np.sin(turn) + twist * x)
        total[:, 2] -= pressure
    return total
