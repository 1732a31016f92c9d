"""A contact scene: what touches the sensor, how it moves, and what is observed of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field, create_model, model_validator

from gelslim_core.yaml.base import Block, require_folder_name
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.effects.circumstances import EffectParameters, Use
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.variation import Variation


class Sensor(Block):
    """The sensor, by its spec or by its bundle. Paths are relative to the scene file."""

    spec: str | None = Field(
        default=None, min_length=1, max_length=400, description="Spec of the finger, a YAML file"
    )
    bundle: str | None = Field(
        default=None,
        min_length=1,
        max_length=400,
        description="Stiffness bundle, a folder",
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
    """The contact between the tool and the gel."""

    friction: float = Field(
        default=0.0, ge=0, le=10, description="Coefficient of Coulomb friction; 0 means no friction"
    )


class Tolerance(Block):
    """Errors allowed in the simulation. Effects that change less than their share are left out."""

    force_n: float = Field(default=0.02, ge=0, le=1000, description="Allowed error of forces")
    image_px: float = Field(
        default=0.1,
        ge=0,
        le=1000,
        description="Allowed error of displacements, markers and pictures, as seen by the camera",
    )


class SceneCamera(Block):
    """When frames are taken. The optics of the camera belong to the sensor."""

    frame_rate_hz: float | None = Field(
        default=None,
        gt=0,
        le=10_000,
        description="Frames per second; without it, one per pose",
    )


class EffectsBlock(Block):
    """`auto`, `on` or `off` for each effect, or a block with `use` and its parameters."""

    @model_validator(mode="after")
    def _one_series(self) -> EffectsBlock:
        given = self.parameters()
        both = ("relaxation", "viscoelasticity")
        if all(getattr(given[name], "terms", ()) for name in both):
            raise FieldError(
                "viscoelasticity.terms",
                "are given beside those of relaxation, a gel has one Prony series",
                "delete one of the two blocks",
            )
        return self

    def parameters(self) -> dict[str, EffectParameters]:
        """The parameters of every effect by name; a bare word stands for the defaults with it."""
        found: dict[str, EffectParameters] = {}
        for effect in EFFECTS:
            given: Use | EffectParameters = getattr(self, effect.name)
            found[effect.name] = effect.parameters(use=given) if isinstance(given, str) else given
        return found

    def completed(self, values: Mapping[str, Mapping[str, float]]) -> Effects:
        """These effects with parameters by effect and name, where the scene gives none itself."""
        changed: dict[str, EffectParameters] = {}
        own = self.parameters()
        for name, known in values.items():
            given = own[name]
            free = {n: v for n, v in known.items() if n not in given.model_fields_set}
            changed[name] = given.model_copy(update=free)
        return self.model_copy(update=changed)


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
        description="Name of the scene, which is also that of the output folder",
    )
    sensor: Sensor = Field(description="The sensor that is touched")
    look: str | None = Field(
        default=None,
        min_length=1,
        max_length=400,
        description="File of `gelslim calibrate-look`, relative to the scene file: pictures look "
        "like those of that built sensor; without it, as the effects say",
    )
    indenters: tuple[Indenter, ...] = Field(
        min_length=1, max_length=16, description="Rigid shapes that form one tool and move together"
    )
    motion: Motion = Field(description="Motion of the tool")
    contact: Contact = Field(default=Contact(), description="Contact, by default without friction")
    observe: tuple[Observable, ...] = Field(
        min_length=1, max_length=4, description="Quantities that the simulation provides"
    )
    tolerance: Tolerance = Field(
        default=Tolerance(), description="Allowed errors of the simulation"
    )
    camera: SceneCamera = Field(default=SceneCamera(), description="When frames are taken")
    effects: Effects = Field(
        default=Effects(),
        description="Physical effects: whether to simulate them, and how",
    )
    vary: Variation = Field(
        default=Variation(), description="Ranges from which `gelslim simulate --count` draws scenes"
    )
    seed: int = Field(default=0, ge=0, le=2**53, description="Seed of all random numbers")

    @model_validator(mode="after")
    def _once(self) -> Scene:
        require_folder_name("name", self.name)
        for index, name in enumerate(self.observe):
            if name in self.observe[:index]:
                raise FieldError(f"observe[{index}]", f"{name} is listed twice", "delete one")
        return self
