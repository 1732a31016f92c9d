"""Camera and look of the frames of a plan: the optical effects that it keeps, and their values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.effects.circumstances import EffectParameters
from gelslim_twin.effects.dot_contrast import DrawingParameters

if TYPE_CHECKING:
    from gelslim_twin.planning.plan import Plan
    from gelslim_twin.render.blemishes import Dirt, Specular
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.image_sensor import Compression, Exposure, MotionBlur, SensorNoise
    from gelslim_twin.render.print_faults import MarkerPrint
    from gelslim_twin.render.shading import Shading

Rays = Literal["exact", "paraxial"]


@dataclass(frozen=True)
class Look:
    """Parameters of the effects; None leaves an effect out.

    `level_dn` is the grey value of unit irradiance in a lamp's own colour. With the default, three
    times the mean light just saturates; saturation would move the centres of dots. `contrast` is
    the share of light that ink absorbs.
    """

    level_dn: float = 80.0
    contrast: float = 0.8
    marker_print: MarkerPrint | None = None
    shading: Shading | None = None
    dirt: Dirt | None = None
    defocus: Defocus | None = None
    specular: Specular | None = None
    motion_blur: MotionBlur | None = None
    exposure: Exposure | None = None
    sensor_noise: SensorNoise | None = None
    compression: Compression | None = None


FACTORIES: Mapping[str, str] = {
    "marker_print": "MarkerPrint",
    "shading": "Shading",
    "dirt": "Dirt",
    "defocus": "Defocus",
    "specular": "Specular",
    "motion_blur": "MotionBlur",
    "exposure": "Exposure",
    "sensor_noise": "noise_of_electrons",
    "compression": "Compression",
}
"""For each field of `Look` the class or function in the module of the effect that makes it."""


def plan_look(
    plan: Plan,
    parameters: Mapping[str, EffectParameters],
    camera_record: Mapping[str, Any],
    seed: int,
) -> Look:
    """The look of the frames of a plan.

    Args:
        plan: of a scene with pictures; only its effects are imported.
        parameters: of every effect by name, `scene.effects.parameters()`.
        camera_record: the bundle's, for aperture and focus.
        seed: of everything random.
    """
    drawing = parameters["drawing"]
    assert isinstance(drawing, DrawingParameters)
    context = {"seed": seed, **lens_of(camera_record)}
    made: dict[str, Any] = {}
    for choice in plan.included:
        if choice.effect not in FACTORIES:
            continue
        make = getattr(import_module(choice.implementation), FACTORIES[choice.effect])
        known = {n: v for n, v in context.items() if n in signature(make).parameters}
        given = parameters[choice.effect].model_dump(exclude={"use"})
        made[choice.effect] = make(**known, **given, **dict(choice.rung_parameters))
    return Look(level_dn=drawing.level_dn, contrast=drawing.contrast, **made)


def lens_of(camera_record: Mapping[str, Any]) -> dict[str, float]:
    """Aperture and focus distance of a bundle's camera; a pinhole where one is not known."""
    aperture, focus = (float(camera_record.get(n) or 0.0) for n in ("aperture_mm", "focus_mm"))
    return {"aperture_mm": aperture if focus else 0.0, "focus_mm": focus or 1.0}


def sensor_look(aperture_mm: float, focus_mm: float, seed: int = 0) -> Look:
    """The look of a used sensor with a small Bayer camera, for validation.

    The blur in focus is 0.7 px and a grey value stands for about 40 electrons; ink and response
    are those of published frames. Compression depends on how frames are sent and is left out.
    Each effect draws from its own stream of `seed`.
    """
    from gelslim_twin.render.blemishes import Dirt, Specular
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.image_sensor import Exposure, MotionBlur, SensorNoise
    from gelslim_twin.render.print_faults import MarkerPrint
    from gelslim_twin.render.shading import Shading

    return Look(
        contrast=0.85,
        marker_print=MarkerPrint(0.02, 0.4, 1.0, seed),
        shading=Shading(),
        dirt=Dirt(12, 4, seed=seed),
        defocus=Defocus(aperture_mm, focus_mm, still_px=0.7),
        specular=Specular(6, brightness_percent=200 / 2.55, seed=seed),
        motion_blur=MotionBlur(),
        exposure=Exposure(gamma=1.8),
        sensor_noise=SensorNoise(1.5, 40.0, seed),
    )


def plan_camera(plan: Plan, record: Mapping[str, Any]) -> VirtualCamera:
    """The camera of a bundle's `record` with the optical effects of `plan`.

    Raises ValueError for an invalid camera record.
    """
    chosen = {choice.effect: dict(choice.rung_parameters) for choice in plan.included}
    full = VirtualCamera.from_record(record)
    camera = replace(full, layers=_as_air(full.layers), lens=None)
    if "refraction" in chosen:
        camera = refracting(camera, full.layers, **chosen["refraction"])
    return replace(camera, lens=full.lens) if "lens_distortion" in chosen else camera


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
