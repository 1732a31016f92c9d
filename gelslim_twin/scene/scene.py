"""The whole scene: what touches the sensor, how, and what is to be known of it."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block, require_folder_name
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.scene.effects import Effects
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.sensor import Sensor
from gelslim_twin.scene.variation import Variation

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
