"""The sensor that a scene is about, named but not built."""

from __future__ import annotations

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError


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
