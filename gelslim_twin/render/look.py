"""The look of frames: which effects are rendered, with which parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gelslim_twin.effects.circumstances import EffectParameters
from gelslim_twin.effects.dot_contrast import DrawingParameters

if TYPE_CHECKING:
    from gelslim_twin.planning.plan import Plan
    from gelslim_twin.render.compression import Compression
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.dirt import Dirt
    from gelslim_twin.render.exposure import Exposure
    from gelslim_twin.render.motion_blur import MotionBlur
    from gelslim_twin.render.print_faults import PrintFaults
    from gelslim_twin.render.sensor_noise import SensorNoise
    from gelslim_twin.render.shading import Shading
    from gelslim_twin.render.specular import Specular


@dataclass(frozen=True)
class Look:
    """Parameters of the effects; None leaves an effect out, and its module is not imported.

    `level_dn` is the grey value of unit irradiance in a lamp's own colour. With the default, three
    times the mean light just saturates; saturation would move the centres of dots. `contrast` is
    the share of light that ink absorbs. With `samples` 0 the coverage of pixels is exact, with
    n > 0 it is taken from n x n samples. Raises ValueError for values out of range.
    """

    level_dn: float = 80.0
    contrast: float = 0.8
    samples: int = 0
    shading: Shading | None = None
    defocus: Defocus | None = None
    motion_blur: MotionBlur | None = None
    exposure: Exposure | None = None
    noise: SensorNoise | None = None
    print_faults: PrintFaults | None = None
    dirt: Dirt | None = None
    specular: Specular | None = None
    compression: Compression | None = None

    def __post_init__(self) -> None:
        if not 0 < self.level_dn <= 1e4:
            raise ValueError(f"level_dn = {self.level_dn}: must be in 0 ... 10000")
        if not 0 <= self.contrast <= 1:
            raise ValueError(f"the ink's contrast = {self.contrast}: must be in 0 ... 1")
        if self.samples < 0:
            raise ValueError(f"samples = {self.samples}: 0 for exact areas, or a count per pixel")


WHITE_DN = 255.0

SLOTS: Mapping[str, tuple[str, str]] = {
    "marker_print": ("print_faults", "PrintFaults"),
    "shading": ("shading", "Shading"),
    "dirt": ("dirt", "Dirt"),
    "defocus": ("defocus", "Defocus"),
    "specular": ("specular", "Specular"),
    "motion_blur": ("motion_blur", "MotionBlur"),
    "exposure": ("exposure", "Exposure"),
    "sensor_noise": ("noise", "SensorNoise"),
    "compression": ("compression", "Compression"),
}
"""For each effect the field of `Look` and the class in the effect's module."""


def plan_look(
    plan: Plan,
    parameters: Mapping[str, EffectParameters],
    camera_record: Mapping[str, Any],
    seed: int,
    step_s: float,
) -> Look:
    """The look of the frames of a plan.

    Args:
        plan: of the scene; only its effects are imported.
        parameters: of every effect by name, `scene.effects.parameters()`.
        camera_record: the bundle's, for aperture and focus.
        seed: of everything random.
        step_s: time from frame to frame, of which the shutter is open a part.

    Raises:
        ValueError: the plan draws no picture, or the renderer refuses a value.
    """
    drawing = parameters["drawing"]
    if "drawing" not in plan.order or not isinstance(drawing, DrawingParameters):
        raise ValueError(f"the plan of {plan.scene} draws no picture")
    slots: dict[str, Any] = {}
    for choice in plan.included:
        given = parameters[choice.effect].model_dump(exclude={"use"})
        # Switched on without a quality there is nothing to compress.
        if choice.effect not in SLOTS or given.get("quality", 0) is None:
            continue
        slot, name = SLOTS[choice.effect]
        kind = getattr(import_module(choice.implementation), name)
        translated = _TRANSLATE.get(choice.effect, _as_it_is)(given, camera_record, step_s)
        values = {**translated, **dict(choice.rung_parameters)}
        if "seed" in {field.name for field in dataclasses.fields(kind)}:
            values["seed"] = seed
        slots[slot] = kind(**values)
    return Look(level_dn=drawing.level_dn, contrast=drawing.contrast, **slots)


Values = dict[str, Any]


def _as_it_is(given: Values, _record: Mapping[str, Any], _step_s: float) -> Values:
    return given


def _marker_print(given: Values, _record: Mapping[str, Any], _step_s: float) -> Values:
    return {
        "jitter_mm": given["jitter_mm"],
        "missing_share": given["missing_percent"] / 100,
        "odd_share": given["odd_percent"] / 100,
    }


def _defocus(given: Values, record: Mapping[str, Any], _step_s: float) -> Values:
    aperture, focus = record.get("aperture_mm") or 0.0, record.get("focus_mm") or 0.0
    # A pinhole is sharp wherever it is focused.
    return {**given, "aperture_mm": aperture if focus else 0.0, "focus_mm": focus or 1.0}


def _specular(given: Values, _record: Mapping[str, Any], _step_s: float) -> Values:
    level = given["brightness_percent"] / 100 * WHITE_DN
    return {"spots": given["spots"], "level_dn": level, "radius_px": given["radius_px"]}


def _motion_blur(given: Values, _record: Mapping[str, Any], step_s: float) -> Values:
    if step_s <= 0:
        return {"open_share": 0.0}
    return {"open_share": min(1.0, given["shutter_ms"] / 1000 / step_s)}


def _sensor_noise(given: Values, _record: Mapping[str, Any], _step_s: float) -> Values:
    electrons = given["full_well_electrons"]
    if electrons == 0:
        return {"read_dn": 0.0}
    per_dn = electrons / WHITE_DN
    return {"electrons_per_dn": per_dn, "read_dn": given["read_noise_electrons"] / per_dn}


_TRANSLATE: Mapping[str, Callable[[Values, Mapping[str, Any], float], Values]] = {
    "marker_print": _marker_print,
    "defocus": _defocus,
    "specular": _specular,
    "motion_blur": _motion_blur,
    "sensor_noise": _sensor_noise,
}


def sensor_look(aperture_mm: float, focus_mm: float, seed: int = 0) -> Look:
    """The look of a used sensor with a small Bayer camera, for validation.

    The blur in focus is 0.7 px and a grey value stands for about 40 electrons; ink and response
    are those of published frames. Compression depends on how frames are sent and is left out.
    Each effect draws from its own stream of `seed`.
    """
    from gelslim_twin.render.defocus import Defocus
    from gelslim_twin.render.dirt import Dirt
    from gelslim_twin.render.exposure import Exposure
    from gelslim_twin.render.motion_blur import MotionBlur
    from gelslim_twin.render.print_faults import PrintFaults
    from gelslim_twin.render.sensor_noise import SensorNoise
    from gelslim_twin.render.shading import Shading
    from gelslim_twin.render.specular import Specular

    return Look(
        level_dn=80.0,
        contrast=0.85,
        shading=Shading(),
        defocus=Defocus(aperture_mm, focus_mm, still_px=0.7),
        motion_blur=MotionBlur(open_share=0.5),
        exposure=Exposure(gamma=1.8),
        noise=SensorNoise(1.5, 40.0, seed),
        print_faults=PrintFaults(0.02, 0.004, 0.01, seed),
        dirt=Dirt(12, 4, seed=seed),
        specular=Specular(6, seed=seed),
    )
