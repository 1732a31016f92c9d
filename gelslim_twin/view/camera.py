"""The camera of a plan: perspective, and what of refraction and lens the plan keeps."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gelslim_twin.plan import Plan

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera


def plan_camera(plan: Plan, record: Mapping[str, Any]) -> VirtualCamera:
    """The camera of a bundle's `record` with the optical effects of `plan`.

    Raises ValueError for a plan that has no camera, or for a record that is none.
    """
    chosen = {choice.effect: choice for choice in plan.included}
    if "perspective" not in chosen:
        raise ValueError(f"the plan of {plan.scene} has no camera: it observes no picture")
    camera: VirtualCamera = import_module(chosen["perspective"].implementation).apply(record)
    for name in ("refraction", "lens_distortion"):
        if name in chosen:
            module = import_module(chosen[name].implementation)
            camera = module.apply(camera, record, **dict(chosen[name].rung_parameters))
    return camera
