"""The effects block of a scene: for each effect a word, or its parameters."""

from __future__ import annotations

from pydantic import Field

from gelslim_core.yaml.base import Block
from gelslim_twin.effects.circumstances import EffectParameters, Use
from gelslim_twin.effects.compression import CompressionParameters
from gelslim_twin.effects.defocus import DefocusParameters
from gelslim_twin.effects.dirt import DirtParameters
from gelslim_twin.effects.drawing import DrawingParameters
from gelslim_twin.effects.exposure import ExposureParameters
from gelslim_twin.effects.friction import FrictionParameters
from gelslim_twin.effects.lens_distortion import LensDistortionParameters
from gelslim_twin.effects.marker_print import MarkerPrintParameters
from gelslim_twin.effects.motion_blur import MotionBlurParameters
from gelslim_twin.effects.nonlinearity import NonlinearityParameters
from gelslim_twin.effects.normal_contact import NormalContactParameters
from gelslim_twin.effects.perspective import PerspectiveParameters
from gelslim_twin.effects.refraction import RefractionParameters
from gelslim_twin.effects.relaxation import RelaxationParameters
from gelslim_twin.effects.sensor_noise import SensorNoiseParameters
from gelslim_twin.effects.shading import ShadingParameters
from gelslim_twin.effects.specular import SpecularParameters


class Effects(Block):
    """`auto`, `on` or `off` for an effect, or a block with `use` and its parameters."""

    normal_contact: Use | NormalContactParameters = Field(
        default="auto", description="Contact itself"
    )
    friction: Use | FrictionParameters = Field(default="auto", description="Stick and slip")
    nonlinearity: Use | NonlinearityParameters = Field(
        default="auto", description="Large deformation of the gel"
    )
    relaxation: Use | RelaxationParameters = Field(
        default="auto", description="Forces that decay while held"
    )
    perspective: Use | PerspectiveParameters = Field(
        default="auto", description="The camera behind the mirror"
    )
    refraction: Use | RefractionParameters = Field(
        default="auto", description="Refraction in acrylic and gel"
    )
    lens_distortion: Use | LensDistortionParameters = Field(
        default="auto", description="Distortion of the lens"
    )
    marker_print: Use | MarkerPrintParameters = Field(
        default="auto", description="Faults of the marker print"
    )
    drawing: Use | DrawingParameters = Field(default="auto", description="The dots drawn")
    shading: Use | ShadingParameters = Field(default="auto", description="Red and green light")
    dirt: Use | DirtParameters = Field(default="auto", description="Specks and hairs")
    defocus: Use | DefocusParameters = Field(default="auto", description="Blur by defocus")
    specular: Use | SpecularParameters = Field(
        default="auto", description="Reflections of the lamps"
    )
    motion_blur: Use | MotionBlurParameters = Field(default="auto", description="Blur by motion")
    exposure: Use | ExposureParameters = Field(
        default="auto", description="Brightness and tone curve"
    )
    sensor_noise: Use | SensorNoiseParameters = Field(
        default="auto", description="Noise of the image sensor"
    )
    compression: Use | CompressionParameters = Field(default="auto", description="JPEG compression")

    def parameters(self) -> dict[str, EffectParameters]:
        """The parameters of every effect by name, a bare word as its defaults with that use."""
        found: dict[str, EffectParameters] = {}
        for name, field in type(self).model_fields.items():
            given = getattr(self, name)
            if isinstance(given, str):
                kind = next(k for k in field.annotation.__args__ if _is_block(k))  # type: ignore[union-attr]
                given = kind(use=given)
            found[name] = given
        return found


def _is_block(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, EffectParameters)
