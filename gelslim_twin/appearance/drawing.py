"""A renderer that draws with the look of a built sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.appearance.channel_light import channel_light
from gelslim_twin.render.look import Look
from gelslim_twin.render.photographed import PhotographedGel
from gelslim_twin.render.printed_dots import PrintedDots
from gelslim_twin.render.surroundings import Pad, Sight

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.frame_renderer import FrameRenderer
    from gelslim_twin.render.surface_state import DomedTop
    from gelslim_twin.scene.built_look import BuiltLook
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_SATURATED_DN = 250
"""Grey value of the bare gel from which on it may be a reflection."""
_REFLECTS = 1.5
"""Light of a reflection, at least, over the smooth light there."""


def rest_effects(look: BuiltLook, seed: int = 0) -> Look:
    """Effects that a picture at rest of this sensor shows, with the values of its look."""
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.image_sensor import Exposure, SensorNoise
    from gelslim_twin.render.look import lens_of
    from gelslim_twin.render.shading import Shading

    lens = lens_of(look.camera)
    return Look(
        level_dn=look.level_dn,
        contrast=float(look.contrast.max()),
        shading=Shading(),
        defocus=Defocus(lens["aperture_mm"], lens["focus_mm"], look.blur_px),
        exposure=Exposure(gamma=look.gamma),
        sensor_noise=SensorNoise(look.read_dn, look.electrons_per_dn, seed, look.grain_px),
    )


def look_renderer(
    look: BuiltLook,
    camera: VirtualCamera,
    grid: MarkerGrid,
    light: LightMap,
    pad: Pad,
    effects: Look,
    top: DomedTop | None = None,
) -> FrameRenderer:
    """A renderer of a sensor with its look.

    Args:
        look: The look.
        camera: The camera as built, with the optical effects to draw.
        grid: The print as designed.
        light: Light of the design.
        pad: Outline of the gel.
        effects: What else to draw, see `rest_effects`.
        top: The crowned surface at rest, if any.
    """
    from gelslim_twin.render.frame_renderer import FrameRenderer

    own = channel_light(look, light, (pad.length_mm, pad.width_mm))
    seen = photographed(look, camera, grid, pad, own)
    mono = look.bare.ndim == 2
    return FrameRenderer(camera, grid, own, pad, effects, top, mono, seen)


def photographed(
    look: BuiltLook, camera: VirtualCamera, grid: MarkerGrid, pad: Pad, own: LightMap
) -> PhotographedGel:
    """The untouched gel of a look, whose smooth light is `own`.

    What lies beside the gel, and what saturates the camera where the smooth light is much weaker,
    is a reflection: neither the slope of the gel nor its ink changes it.
    """
    grey = np.atleast_3d(look.bare)
    linear = 255 * (grey / 255.0) ** look.gamma
    places = Sight.of(camera).rest_mm
    on_pad = pad.beyond_mm(places[..., 0], places[..., 1]) < 0
    smooth = look.level_dn * own.at(places[..., 0], places[..., 1])
    coat = on_pad[..., None] & ((grey < _SATURATED_DN) | (linear < _REFLECTS * smooth))
    irradiance = np.where(coat, linear / look.level_dn, 0.0)
    glare = np.where(coat, 0.0, linear)
    contrast = np.broadcast_to(look.contrast, 3)
    return PhotographedGel(
        built_dots(look, grid),
        np.ascontiguousarray(irradiance, dtype=np.float32),
        np.ascontiguousarray(np.broadcast_to(glare, (*glare.shape[:2], 3)), dtype=np.float32),
        contrast / max(float(contrast.max()), 1e-12),
    )


def built_dots(look: BuiltLook, grid: MarkerGrid) -> PrintedDots:
    """The print: dots as seen, those out of the picture as designed, missing ones left out."""
    dots = PrintedDots.nominal(grid)
    centres, axes = dots.centres_mm.copy(), dots.semi_axes_mm.copy()
    turn, present = dots.turn_rad.copy(), dots.present.copy()
    centres[look.markers], axes[look.markers] = look.dots_mm[:, :2], look.dots_mm[:, 2:]
    turn[look.markers] = look.turn_rad
    present[look.missing] = False
    opacity = dots.opacity.copy()
    opacity[look.markers] = look.opacity
    return replace(
        dots,
        centres_mm=centres,
        semi_axes_mm=axes,
        turn_rad=turn,
        present=present,
        opacity=opacity,
    )
