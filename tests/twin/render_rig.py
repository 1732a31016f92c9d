"""Camera, print, light and pressed surfaces for the rendering tests."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera, reflect_point
from gelslim_optics.light.light_map import LightMap, red_green_sides
from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
from gelslim_twin.render.look import Look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from ifem_export.markers.grid import build_marker_grid

Array = NDArray[np.float64]
PAD = Pad(22.0, 21.0, 1.0)
GRID = build_marker_grid(19, 18, 1.1, 0.45)
AXIS_X, AXIS_Y = np.linspace(-11, 11, 45), np.linspace(-10.5, 10.5, 43)


def finger_camera(tilt_deg: float = 30.0, height_mm: float = 22.0, lens=None) -> VirtualCamera:
    """VGA camera tilted from the gel's normal, looking at the gel's middle: strong keystone."""
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
        lens=lens,
    )


CAMERA = finger_camera()


def coarse(camera: VirtualCamera) -> VirtualCamera:
    """The same view on a quarter of the pixels."""
    return replace(
        camera,
        focal_px=camera.focal_px / 2,
        image_width_px=camera.image_width_px // 2,
        image_height_px=camera.image_height_px // 2,
    )


def light(decay_mm: float = 15.0, elevation_deg: float = 25.0) -> LightMap:
    return red_green_sides(22.0, 21.0, decay_mm=decay_mm, elevation_deg=elevation_deg)


def renderer(look: Look | None = None, **other) -> FrameRenderer:
    values = {"camera": CAMERA, "grid": GRID, "light": light(), "pad": PAD, "look": look or Look()}
    return FrameRenderer(**(values | other))


def dent(depth_mm: float = 0.5, x_mm: float = 1.0, y_mm: float = 2.0) -> SurfaceState:
    """A smooth dent, the gel drawn towards its middle."""
    x, y = np.meshgrid(AXIS_X, AXIS_Y)
    r2 = ((x - x_mm) ** 2 + (y - y_mm) ** 2) / 3.0**2
    z = -depth_mm * np.exp(-r2)
    u = -0.3 * depth_mm * np.exp(-r2) * np.stack([x - x_mm, y - y_mm]) / 3.0
    return SurfaceState(AXIS_X, AXIS_Y, np.stack([*u, z], axis=2))


def moved(shift_mm: tuple[float, float, float]) -> SurfaceState:
    u = np.broadcast_to(np.array(shift_mm), (len(AXIS_Y), len(AXIS_X), 3))
    return SurfaceState(AXIS_X, AXIS_Y, u)


def detected_error(frame: RenderedFrame, **settings: float) -> Array:
    """Found minus true centre (m, 2) in px of all dots drawn; fails where one is not found."""
    truth = frame.centres_px[frame.drawn]
    sizes = DetectorSettings.for_diameters(frame.diameter_px[frame.drawn])
    chosen = DetectorSettings(sizes.smallest_diameter_px, sizes.largest_diameter_px, **settings)
    found = Detector(chosen).detect(frame.image)
    apart, nearest = cKDTree(found.centres_px).query(truth)
    assert apart.max() < 1.5
    assert len(np.unique(nearest)) == len(truth)
    return found.centres_px[nearest] - truth


def rms(errors: Array) -> float:
    """Root mean square per axis."""
    return float(np.sqrt(np.mean(errors**2)))
