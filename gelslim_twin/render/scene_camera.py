"""The camera of a scene, with those of refraction and lens distortion that the plan keeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.planning.plan import Plan

Rays = Literal["exact", "paraxial"]


def plan_camera(plan: Plan, record: Mapping[str, Any]) -> VirtualCamera:
    """The camera of a bundle's `record` with the optical effects of `plan`.

    Raises ValueError for a plan that observes no picture, or for an invalid camera record.
    """
    chosen = {choice.effect: dict(choice.rung_parameters) for choice in plan.included}
    if "perspective" not in chosen:
        raise ValueError(f"the plan of {plan.scene} has no camera: it observes no picture")
    full = VirtualCamera.from_record(record)
    camera = _pinhole(full)
    if "refraction" in chosen:
        camera = refracting(camera, full.layers, **chosen["refraction"])
    return replace(camera, lens=full.lens) if "lens_distortion" in chosen else camera


def _pinhole(camera: VirtualCamera) -> VirtualCamera:
    """The same camera with every layer as air and a perfect lens."""
    return replace(camera, layers=_as_air(camera.layers), lens=None)


def refracting(
    camera: VirtualCamera, layers: tuple[Layer, ...], rays: Rays = "exact"
) -> VirtualCamera:
    """`camera` looking through `layers`.

    `exact` refracts every ray. `paraxial` keeps the rays straight and moves the camera nearer by
    the apparent shift of the gel, the sum of h (1 - 1/n), which is exact for rays along the normal.
    """
    if rays == "exact":
        return replace(camera, layers=layers)
    shift = sum(v.thickness_mm * (1 - 1 / v.index) for v in layers)
    position = np.asarray(camera.position_mm) + np.array([0.0, 0.0, shift])
    return replace(camera, layers=_as_air(layers), position_mm=position)


def _as_air(layers: tuple[Layer, ...]) -> tuple[Layer, ...]:
    return tuple(Layer(layer.thickness_mm, 1.0) for layer in layers)
