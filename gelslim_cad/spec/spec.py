"""The whole spec: what the user chose."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from gelslim_cad.spec.camera import Camera
from gelslim_cad.spec.design import Design
from gelslim_cad.spec.manufacturing import Manufacturing
from gelslim_cad.spec.material import Material
from gelslim_cad.spec.mesh import Mesh
from gelslim_core.yaml.base import Block, require_folder_name


class Spec(Block):
    """The spec of a finger: everything that a user chooses.

    Attributes:
        format: Format of the file, `gelslim-spec/1`.
        name: Name of the finger, which is also that of its output folder.
        camera: The camera, as its data sheet gives it.
        design: What the designer chooses.
        material: Gel and acrylic.
        manufacturing: Processes, tolerances and stock.
        mesh: Finite-element mesh of the pad.
    """

    starting_point: ClassVar[str] = "`gelslim new` writes a spec to start from"

    format: Literal["gelslim-spec/1"] = Field(description="Format of this file")
    name: str = Field(
        min_length=1,
        max_length=60,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        description="Name of the finger; becomes the output folder",
    )
    camera: Camera = Field(description="The camera, as given by its data sheet")
    design: Design = Field(description="What the designer chooses")
    material: Material = Field(default=Material(), description="Gel and acrylic")
    manufacturing: Manufacturing = Field(
        default=Manufacturing(), description="Processes, tolerances, stock"
    )
    mesh: Mesh = Field(default=Mesh(), description="Finite-element mesh of the pad")

    @model_validator(mode="after")
    def _names_a_folder(self) -> Spec:
        require_folder_name("name", self.name)
        return self
