"""The library of grippers: a data file each, every figure with its source.

The jaw of a gripper is described where the finger is bolted to it. A pattern has its origin in
the middle of the jaw's face; its first axis y runs across the finger. On an `axial` face, which
looks along the finger, the second axis runs towards the object. On a `lateral` face, which looks
at the object, it runs along the finger to the tip.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import Field, model_validator

from gelslim_cad.spec.limits import above, between
from gelslim_cad.spec.source import Source
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_core.yaml.reader import read_model
from gelslim_core.yaml.suggest import suggest_choice

GRIPPERS = Path(__file__).with_name("grippers")
"""Folder with a file per gripper of the library, named as the gripper."""
GripperName = Literal[
    "generic",
    "franka_hand",
    "onrobot_rg2",
    "robotiq_2f140",
    "robotiq_2f85",
    "wsg32",
    "wsg50",
]
FlangeBolt = Literal["M3", "M4", "M5", "M6"]
ABOUT = ("format", "name", "summary", "sources")
"""Fields of a library file that are no figures of the gripper."""
PLACES = ("jaw.holes_mm", "jaw.pins_mm")
"""Figures that decide whether an adapter can be bolted on."""


class GripperLibraryError(GelslimError, ValueError):
    """The library has no gripper of that name."""


class Jaw(Block):
    """The face of a gripper's jaw that the finger is bolted to; sizes in mm."""

    face: Literal["axial", "lateral"] = Field(
        description="Where it looks: along the finger, or at the object"
    )
    width_mm: float | None = above(0, 500, "Across the finger", default=None)
    depth_mm: float | None = above(
        0, 500, "Along the closing direction, or along the finger where lateral", default=None
    )
    closed_gap_mm: float | None = between(
        0,
        1000,
        "Between the middles of the two faces, or the faces themselves where lateral, when closed",
        default=None,
    )
    bolt: FlangeBolt = Field(description="Bolt between jaw and flange")
    thread: Literal["jaw", "flange"] = Field(
        default="jaw", description="Where the thread is; the other has a clearance hole"
    )
    holes_mm: tuple[tuple[float, float], ...] = Field(
        min_length=1, max_length=12, description="Places of the bolts"
    )
    pins_mm: tuple[tuple[float, float, float], ...] = Field(
        default=(), max_length=6, description="Places and diameters of dowel pins in the jaw"
    )


class LibraryGripper(Block):
    """A parallel gripper of the library. Each figure has one source, or is marked as assumed.

    Attributes:
        format: Format of the file, `gelslim-gripper/1`.
        name: Maker and type.
        summary: One sentence.
        stroke_mm: Travel of both jaws together, from closed to open.
        force_n: Least and largest gripping force of one jaw that can be set.
        payload_kg: Recommended mass of an object that friction holds.
        mass_kg: Mass of the gripper without fingers.
        flange_thickness_mm: Thickness of the flange that suits it.
        jaw: The face that the finger is bolted to.
        sources: Where the figures come from.
    """

    format: Literal["gelslim-gripper/1"]
    name: str = Field(min_length=1, max_length=80)
    summary: str
    stroke_mm: float | None = above(0, 1000, "Travel of both jaws together", default=None)
    force_n: tuple[float, float] | None = Field(
        default=None, description="Least and largest gripping force"
    )
    payload_kg: float | None = above(0, 500, "Mass of an object held by friction", default=None)
    mass_kg: float | None = above(0, 500, "Mass of the gripper", default=None)
    flange_thickness_mm: float = between(2, 30, "Thickness of the flange")
    jaw: Jaw
    sources: tuple[Source, ...]

    @property
    def figures(self) -> dict[str, Any]:
        """Every figure that the file gives, by its dotted path."""
        own = {n: getattr(self, n) for n in type(self).model_fields if n not in (*ABOUT, "jaw")}
        own |= {f"jaw.{n}": getattr(self.jaw, n) for n in self.jaw.model_fields_set}
        return {name: value for name, value in own.items() if value is not None}

    def source(self, figure: str) -> Source:
        """The source of one of `figures`. Raises KeyError for another name."""
        for source in self.sources:
            if figure in source.gives:
                return source
        raise KeyError(figure)

    @property
    def places_assumed(self) -> bool:
        """Whether no drawing states where the bolts are."""
        return any(self.source(name).assumed for name in PLACES if name in self.figures)

    @model_validator(mode="after")
    def _whole(self) -> LibraryGripper:
        stated = [figure for source in self.sources for figure in source.gives]
        if sorted(stated) != sorted(self.figures):
            wrong = sorted(set(stated) ^ set(self.figures)) or "a figure is named twice"
            raise FieldError("sources", f"must name each figure once: {wrong}")
        if self.force_n is not None and not 0 <= self.force_n[0] < self.force_n[1]:
            raise FieldError("force_n", "must rise from the least to the largest force")
        if (self.stroke_mm is None) != (self.jaw.closed_gap_mm is None):
            raise FieldError("stroke_mm", "needs jaw.closed_gap_mm, and the other way round")
        if len(set(self.jaw.holes_mm)) < len(self.jaw.holes_mm):
            raise FieldError("jaw.holes_mm", "has a bolt twice")
        for size, axis in ((self.jaw.width_mm, 0), (self.jaw.depth_mm, 1)):
            if size is not None and max(abs(p[axis]) for p in self.jaw.holes_mm) > size / 2:
                raise FieldError("jaw.holes_mm", "has a bolt beside the jaw")
        return self


def gripper_names() -> tuple[str, ...]:
    """Names of the grippers of the library, `generic` first, then in alphabetical order."""
    return get_args(GripperName)


@cache
def library_gripper(name: str) -> LibraryGripper:
    """A gripper of the library.

    Args:
        name: One of `gripper_names()`.

    Returns:
        The gripper.

    Raises:
        GripperLibraryError: There is no gripper of this name.
    """
    if name not in gripper_names():
        told = suggest_choice(name, gripper_names())
        known = ", ".join(gripper_names())
        raise GripperLibraryError(
            f"no gripper of the library is called {name}; {told} It has {known}"
        )
    return read_model(GRIPPERS / f"{name}.yaml", LibraryGripper).model
