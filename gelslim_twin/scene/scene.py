"""The whole scene: what touches the sensor, how, and what is to be known of it."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, create_model, model_validator

from gelslim_core.yaml.base import Block, require_folder_name
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.effects.circumstances import EffectParameters, Use
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.motion import Motion

Range = Annotated[tuple[float, float], Field(description="Lowest and highest value")]
_TWO_53 = 2.0**53


class Variation(Block):
    """Ranges, drawn evenly; what is left out stays as the scene says."""

    x_mm: Range | None = Field(default=None, description="Added to the start, along the finger")
    y_mm: Range | None = Field(default=None, description="Added to the start, across the finger")
    depth_factor: Range | None = Field(default=None, description="Times every depth of a press")
    lateral_factor: Range | None = Field(default=None, description="Times every shear and slide")
    direction_deg: Range | None = Field(
        default=None, description="Turns every shear and slide about the gel's normal"
    )
    twist_factor: Range | None = Field(default=None, description="Times every twist")
    size_factor: Range | None = Field(
        default=None, description="Times every length of the indenters"
    )
    friction: Range | None = Field(default=None, description="Coefficient of friction")

    @model_validator(mode="after")
    def _ranges(self) -> Variation:
        for name in type(self).model_fields:
            pair = getattr(self, name)
            if pair is not None and pair[0] > pair[1]:
                raise FieldError(name, f"{pair[0]:g} is above {pair[1]:g}", "swap the two")
        for name in ("depth_factor", "size_factor"):
            pair = getattr(self, name)
            if pair is not None and pair[0] <= 0:
                raise FieldError(name, "must be above 0", "raise the lower end")
        if self.friction is not None and not 0 <= self.friction[0] <= self.friction[1] <= 10:
            raise FieldError("friction", "must lie in 0 to 10", "correct the range")
        return self

    def drawn(self, seed: int, number: int) -> dict[str, float]:
        """The values of scene `number`; every name has a stream of its own."""
        given: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        return {
            name: pair[0] + _unit(seed, number, name) * (pair[1] - pair[0])
            for name, pair in given.items()
            if pair is not None
        }


def _unit(seed: int, number: int, name: str) -> float:
    """An even number in 0 ... 1 from the hash of what it is for: the same on every machine."""
    digest = hashlib.sha256(f"{seed}/{number}/{name}".encode()).digest()
    return (int.from_bytes(digest[:8], "big") >> 11) / _TWO_53


class Sensor(Block):
    """A spec or a bundle; paths are relative to the scene's file."""

    spec: str | None = Field(
        default=None, min_length=1, max_length=400, description="Spec of the finger, a YAML file"
    )
    bundle: str | None = Field(
        default=None, min_length=1, max_length=400, description="Stiffness bundle, a folder"
    )

    @model_validator(mode="after")
    def _one(self) -> Sensor:
        if self.spec is not None and self.bundle is not None:
            raise FieldError("bundle", "given beside spec, a scene has one sensor", "delete one")
        if self.spec is None and self.bundle is None:
            raise FieldError(
                "", "names neither spec nor bundle", "add `spec: ../gelslim2.yaml` below it"
            )
        return self


FORMAT = "gelslim-scene/1"

Observable = Literal["displacement", "force", "markers", "image"]


class Contact(Block):
    """What happens between tool and gel."""

    friction: float = Field(
        default=0.0, ge=0, le=10, description="Coulomb's coefficient; 0 is frictionless"
    )


class Tolerance(Block):
    """How exact the simulation must be: effects below their share of it are left out."""

    force_n: float = Field(default=0.02, ge=0, le=1000, description="Error of forces")
    image_px: float = Field(
        default=0.1,
        ge=0,
        le=1000,
        description="Error in the picture; displacements as the camera sees them",
    )


class SceneCamera(Block):
    """How frames are taken; the optics belong to the sensor."""

    frame_rate_hz: float | None = Field(
        default=None, gt=0, le=10_000, description="Frames per second; one per pose if left out"
    )


class EffectsBlock(Block):
    """`auto`, `on` or `off` for each effect, or a block with `use` and its parameters."""

    def parameters(self) -> dict[str, EffectParameters]:
        """The parameters of every effect by name; a bare word stands for the defaults with it."""
        found: dict[str, EffectParameters] = {}
        for effect in EFFECTS:
            given: Use | EffectParameters = getattr(self, effect.name)
            found[effect.name] = effect.parameters(use=given) if isinstance(given, str) else given
        return found


if TYPE_CHECKING:
    Effects = EffectsBlock
else:
    Effects = create_model(
        "Effects",
        __base__=EffectsBlock,
        __doc__=EffectsBlock.__doc__,
        **{
            e.name: (Use | e.parameters, Field(default="auto", description=e.description))
            for e in EFFECTS
        },
    )
"""The block of the scene file, with one field per effect."""


class Scene(Block):
    """A contact scene."""

    starting_point: ClassVar[str] = "copy a scene from designs/scenes to start from"

    format: Literal["gelslim-scene/1"] = Field(description="Format of this file")
    name: str = Field(
        min_length=1,
        max_length=60,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        description="Name of the scene; becomes the output folder",
    )
    sensor: Sensor = Field(description="The finger")
    indenters: tuple[Indenter, ...] = Field(
        min_length=1, max_length=16, description="Rigid shapes on one tool, moved together"
    )
    motion: Motion = Field(description="How the tool moves")
    contact: Contact = Field(default=Contact(), description="Contact; left out: no friction")
    observe: tuple[Observable, ...] = Field(
        min_length=1, max_length=4, description="What is to be known"
    )
    tolerance: Tolerance = Field(default=Tolerance(), description="How exactly")
    camera: SceneCamera = Field(default=SceneCamera(), description="How frames are taken")
    effects: Effects = Field(
        default=Effects(), description="Effects forced on or off, and their parameters"
    )
    vary: Variation = Field(
        default=Variation(), description="Ranges that `simulate --count` draws scenes from"
    )
    seed: int = Field(default=0, ge=0, le=2**53, description="Of everything random")

    @model_validator(mode="after")
    def _once(self) -> Scene:
        require_folder_name("name", self.name)
        for index, name in enumerate(self.observe):
            if name in self.observe[:index]:
                raise FieldError(f"observe[{index}]", f"{name} is listed twice", "delete one")
        return self
