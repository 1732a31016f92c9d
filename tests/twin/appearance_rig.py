"""A drawn sensor whose look is hidden from the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from render_rig import CAMERA, PAD, coarse, light

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.light.light_map import LightMap
from gelslim_twin.appearance.fit_look import RestPicture
from gelslim_twin.render.blemishes import Dirt
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
from gelslim_twin.render.image_sensor import Exposure, SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.print_faults import MarkerPrint
from gelslim_twin.render.shading import Shading
from gelslim_twin.scene.built_look import BuiltLook
from ifem_export.markers.grid import MarkerGrid, build_marker_grid

Array = NDArray[np.float64]
VIEW = coarse(CAMERA)
PRINT = build_marker_grid(12, 11, 1.7, 0.75)
GAMMA = 1.8


@dataclass(frozen=True)
class Hidden:
    """What the fit has to find.

    Attributes:
        contrast: Share of light that ink absorbs.
        blur_px: Standard deviation of the point spread.
        read_dn: Noise without light in linear grey values.
        electrons_per_dn: Electrons for a linear grey value.
        grain_px: Correlation of the noise.
        red_along, green_level: Logarithm of the red light at the tip over that of the design, and
            of the green light everywhere.
    """

    contrast: float = 0.62
    blur_px: float = 1.1
    read_dn: float = 1.0
    electrons_per_dn: float = 35.0
    grain_px: float = 0.0
    red_along: float = 0.4
    green_level: float = -0.3

    def light(self, design: LightMap) -> LightMap:
        """The light as built."""
        irradiance = design.irradiance.copy()
        irradiance[..., 0] *= np.exp(self.red_along * design.x_mm / (PAD.length_mm / 2))
        irradiance[..., 1] *= np.exp(self.green_level)
        return replace(design, irradiance=irradiance)

    def renderer(self, design: LightMap, *, noise: bool = True, seed: int = 3) -> FrameRenderer:
        """Draws the built sensor."""
        look = Look(
            level_dn=70.0,
            contrast=self.contrast,
            marker_print=MarkerPrint(0.02, 1.0, 0.0, seed),
            shading=Shading(),
            dirt=Dirt(6, 2, seed=seed),
            defocus=Defocus(0.0, 1.0, self.blur_px),
            exposure=Exposure(gamma=GAMMA),
            sensor_noise=SensorNoise(self.read_dn, self.electrons_per_dn, seed, self.grain_px)
            if noise
            else None,
        )
        return FrameRenderer(VIEW, PRINT, self.light(design), PAD, look)


def design_light() -> LightMap:
    """Red light from one side and green light from the other."""
    return light()


def seen_at_rest(frame: RenderedFrame, design: LightMap, grid: MarkerGrid = PRINT) -> RestPicture:
    """The frame with its dots as the detector finds them."""
    sizes = frame.diameter_px[frame.drawn]
    found = Detector(DetectorSettings.for_diameters(sizes)).detect(frame.image)
    found = found.take(np.flatnonzero(found.trustworthy))
    apart = np.hypot(*(found.centres_px[:, None] - frame.centres_px[None]).transpose(2, 0, 1))
    apart[:, ~frame.drawn] = np.inf
    markers, near = apart.argmin(axis=1), apart.min(axis=1) < 1.5
    found, markers = found.take(np.flatnonzero(near)), markers[near]
    return RestPicture(
        picture=frame.image,
        camera=VIEW,
        camera_record=dict(VIEW.to_record()),
        markers=markers,
        places_mm=VIEW.backproject(found.centres_px, 0.0),
        centres_px=found.centres_px,
        moments_px2=found.moments_px2,
        missing=np.setdiff1d(np.flatnonzero(frame.drawn), markers),
        pitch_px=18.0,
        light=design,
        pad=PAD,
        geometry_hash="drawn",
    )


def plain_look(channels: int) -> BuiltLook:
    """Light and shading of the design, without dots."""
    gain = np.zeros((channels, 6))
    gain[:, 0] = 1.0
    return BuiltLook(
        "drawn", dict(VIEW.to_record()), 1.0, 60.0, np.zeros((channels, 10)), gain,
        np.full(channels, 0.5), 0.0, 0.0, 100.0, 0.0, np.zeros((240, 320, 3), dtype=np.uint8),
        np.zeros(0, dtype=np.int64), np.zeros((0, 4)), np.zeros(0), np.zeros(0),
        np.zeros(0, dtype=np.int64),
    )  # fmt: skip
