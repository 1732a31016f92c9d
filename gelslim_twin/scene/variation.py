"""What a data set draws: the block `vary` of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.scene.distribution import Range, require_ordered
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.varied_effects import VariedEffects

MOST_SENSORS = 64


class _Ranges(Block):
    """Ranges by name, with the limits within which their values must lie."""

    def ranges(self) -> Iterator[tuple[str, Range]]:
        """Name and range of everything that is drawn."""
        for name in type(self).model_fields:
            given = getattr(self, name)
            if isinstance(given, tuple) and given and isinstance(given[0], float):
                yield name, given

    def _require(self, name: str, low: float = -math.inf, high: float = math.inf) -> None:
        """Raise FieldError for a range that is not ordered or leaves the limits of its values."""
        given = getattr(self, name)
        if given is None:
            return
        require_ordered(name, given)
        if not low <= given[0] <= given[1] <= high:
            raise FieldError(name, f"must lie in {low:g} to {high:g}", "correct the range")


class ToolMeshes(Block):
    """A folder of meshes, each of which is a tool."""

    folder: str = Field(min_length=1, max_length=400, description="Folder, relative to the scene")
    scale: float = Field(default=1.0, gt=0, le=1e4, description="Millimetres per unit of the files")
    down: Literal["x", "-x", "y", "-y", "z", "-z"] = Field(
        default="-z", description="Direction in the files that points into the gel"
    )
    resolution_mm: float = Field(
        default=0.05, gt=0, le=5, description="Cell size of the height maps"
    )


class VariedGel(_Ranges):
    """The gel. Poisson's ratio and thickness are those of a built sensor."""

    within_tolerance: bool = Field(
        default=False,
        description="Draw what has no range here from a normal distribution with the standard "
        "deviation that the spec states, up to two of them away",
    )
    youngs_modulus_factor: Range | None = Field(
        default=None, description="Factor on Young's modulus, drawn for every sample"
    )
    poissons_ratio: Range | None = Field(default=None, description="Poisson's ratio")
    thickness_factor: Range | None = Field(default=None, description="Factor on the thickness")

    @model_validator(mode="after")
    def _ordered(self) -> VariedGel:
        self._require("youngs_modulus_factor", 0.05, 20)
        self._require("poissons_ratio", 0.0, 0.499)
        self._require("thickness_factor", 0.2, 5)
        return self


class VariedCamera(_Ranges):
    """Displacement of the camera of a built sensor from its place in the design."""

    along_mm: Range | None = Field(default=None, description="Shift along the finger")
    across_mm: Range | None = Field(default=None, description="Shift across the finger")
    away_mm: Range | None = Field(default=None, description="Shift away from the gel")
    turn_deg: Range | None = Field(default=None, description="Turn about the optical axis")
    nod_deg: Range | None = Field(default=None, description="Turn about the rows of the picture")
    pan_deg: Range | None = Field(default=None, description="Turn about the columns")

    @model_validator(mode="after")
    def _ordered(self) -> VariedCamera:
        for name, _ in self.ranges():
            self._require(name, -10, 10)
        return self


class Split(Block):
    """How samples are divided among training, validation and test."""

    by: Literal["tool", "sample"] = Field(
        default="tool", description="A tool is in one split only, or each sample by itself"
    )
    validation_share: float = Field(
        default=0.1, ge=0, lt=1, description="Share of the tools or samples for validation"
    )
    test_share: float = Field(
        default=0.1, ge=0, lt=1, description="Share of the tools or samples for the test"
    )
    validation: tuple[str, ...] = Field(
        default=(), max_length=10_000, description="Tools for validation by name, instead"
    )
    test: tuple[str, ...] = Field(
        default=(), max_length=10_000, description="Tools for the test by name, instead"
    )

    @model_validator(mode="after")
    def _disjoint(self) -> Split:
        if self.validation_share + self.test_share >= 1:
            raise FieldError(
                "test_share",
                f"and validation_share add up to {self.validation_share + self.test_share:g}, "
                "which leaves nothing to train with",
                "lower one of them",
            )
        for index, name in enumerate(self.test):
            if name in self.validation:
                raise FieldError(
                    f"test[{index}]", f"{name} is listed for validation too", "delete one of them"
                )
        return self


class Variation(_Ranges):
    """What a data set draws. What has no range stays as the scene says."""

    x_mm: Range | None = Field(default=None, description="Offset of the start, along the finger")
    y_mm: Range | None = Field(default=None, description="Offset of the start, across the finger")
    twist_deg: Range | None = Field(
        default=None, description="Turn of the tool about the normal of the gel at the start"
    )
    tilt_x_deg: Range | None = Field(default=None, description="Tilt about x at the start")
    tilt_y_deg: Range | None = Field(default=None, description="Tilt about y at the start")
    depth_factor: Range | None = Field(default=None, description="Factor on the depths of presses")
    lateral_factor: Range | None = Field(default=None, description="Factor on shears and slides")
    direction_deg: Range | None = Field(
        default=None, description="Rotation of shears and slides about the normal of the gel"
    )
    twist_factor: Range | None = Field(default=None, description="Factor on the angles of twists")
    size_factor: Range | None = Field(
        default=None, description="Factor on all lengths of the indenters"
    )
    friction: Range | None = Field(default=None, description="Coefficient of friction")
    tools: tuple[Indenter, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="Tools in place of `indenters`, of which each sample has one",
    )
    tool_meshes: ToolMeshes | None = Field(
        default=None, description="Further tools: all STL, OBJ and PLY files of a folder"
    )
    motions: tuple[Motion, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="Paths in place of `motion`, of which each sample has one",
    )
    light_gain: Range | None = Field(
        default=None, description="Factor on the light of each lamp, drawn for every lamp"
    )
    sensors: int = Field(
        default=4,
        ge=1,
        le=MOST_SENSORS,
        description="Number of built sensors among which the samples are divided, where something "
        "of a built sensor is drawn; each is prepared once",
    )
    gel: VariedGel = Field(default=VariedGel(), description="Ranges of the gel")
    camera: VariedCamera = Field(
        default=VariedCamera(), description="Ranges of the camera's place in a built sensor"
    )
    effects: VariedEffects = Field(
        default=VariedEffects(), description="Ranges of the parameters of effects"
    )
    split: Split = Field(default=Split(), description="Division into training, validation, test")

    @model_validator(mode="after")
    def _ordered(self) -> Variation:
        for name, _ in self.ranges():
            self._require(name)
        for name in ("depth_factor", "size_factor"):
            given = getattr(self, name)
            if given is not None and given[0] <= 0:
                raise FieldError(name, "must be above 0", "raise the lower end")
        self._require("friction", 0, 10)
        self._require("light_gain", 0.01, 100)
        for name in ("tilt_x_deg", "tilt_y_deg"):
            self._require(name, -45, 45)
        self._require("twist_deg", -180, 180)
        return self

    @property
    def is_empty(self) -> bool:
        """Whether nothing is drawn, so that all samples would be the same contact."""
        blocks = (*self.ranges(), *self.gel.ranges(), *self.camera.ranges(), *self.effects.ranges())
        return not (
            blocks
            or self.gel.within_tolerance
            or self.tool_meshes is not None
            or len(self.tools or ()) > 1
            or len(self.motions or ()) > 1
        )
