"""Optics of the finger without CAD: the virtual camera, the light guide, and traced light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim_optics.camera.back_projection import HeightGrid
    from gelslim_optics.camera.lens_distortion import LensDistortion
    from gelslim_optics.camera.projection_error import projection_error_mm
    from gelslim_optics.camera.rays import ray_slope
    from gelslim_optics.camera.refraction import Layer, lateral_reach
    from gelslim_optics.camera.view_quality import blur_map, fit_homography
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_optics.guide.profile import GuideProfile
    from gelslim_optics.guide.shapes import (
        CurvedGuide,
        GelSection,
        MirrorGuide,
        curved_profile,
        mirror_profile,
    )
    from gelslim_optics.guide.tir_certificate import TirCertificate, certify_tir
    from gelslim_optics.light.light_map import LightMap
    from gelslim_optics.light.result import LightResult
    from gelslim_optics.light.scene import LightScene, Medium, Surface
    from gelslim_optics.light.source import EndRow, LedRow
    from gelslim_optics.light.trace import trace_light

__all__ = [
    "CurvedGuide",
    "EndRow",
    "GelSection",
    "GuideProfile",
    "HeightGrid",
    "Layer",
    "LedRow",
    "LensDistortion",
    "LightMap",
    "LightResult",
    "LightScene",
    "Medium",
    "MirrorGuide",
    "Surface",
    "TirCertificate",
    "VirtualCamera",
    "blur_map",
    "certify_tir",
    "curved_profile",
    "fit_homography",
    "lateral_reach",
    "mirror_profile",
    "projection_error_mm",
    "ray_slope",
    "trace_light",
]

__getattr__, __dir__ = lazy_exports(__name__)
