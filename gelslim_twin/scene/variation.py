"""Data sets: the ranges of `vary`, and one scene drawn from them."""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.scene.indenter import Indenter, MeshFile
from gelslim_twin.scene.motion import Press, Shear, Slide, Twist, Waypoint

if TYPE_CHECKING:
    from gelslim_twin.scene.scene import Scene

Range = Annotated[tuple[float, float], Field(description="Lowest and highest value")]


class Variation(Block):
    """Ranges from which values are drawn uniformly. What has no range stays as the scene says."""

    x_mm: Range | None = Field(default=None, description="Offset of the start, along the finger")
    y_mm: Range | None = Field(default=None, description="Offset of the start, across the finger")
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
        """The values of scene `number`, the same on every machine.

        Every name has a stream of its own: an even number from the hash of what it is for.
        """
        given: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        return {
            name: pair[0] + _hashed(seed, number, name) / 2.0**53 * (pair[1] - pair[0])
            for name, pair in given.items()
            if pair is not None
        }


def _hashed(*what: object) -> int:
    """A whole number below 2^53 from the hash of what it is for: the same on every machine."""
    digest = hashlib.sha256("/".join(map(str, what)).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 11


def varied(scene: Scene, number: int) -> Scene:
    """Scene `number` of the data set that `scene` describes: its ranges drawn, a seed of its own.

    A pure function of the scene and the number, so scenes may be made in any order, anywhere.
    The result has no ranges left.

    Raises:
        ValueError: a negative number, a motion by table whose ranges ask for more than the
            place, or a value drawn outside the scene's limits; the message names it.
    """
    if number < 0:
        raise ValueError(f"scene number {number}: must not be negative")
    drawn = scene.vary.drawn(scene.seed, number)
    changes: dict[str, Any] = {
        "vary": type(scene.vary)(),
        "seed": _hashed(scene.seed, number),
        "name": f"{scene.name[:50]}-{number:06d}",
    }
    if scene.motion.waypoints is None and set(drawn) - {"size_factor", "friction"}:
        raise ValueError("a motion by table is not varied; vary size_factor or friction only")
    if scene.motion.waypoints is not None:
        changes["motion"] = scene.motion.model_copy(
            update={
                "start_x_mm": scene.motion.start_x_mm + drawn.get("x_mm", 0.0),
                "start_y_mm": scene.motion.start_y_mm + drawn.get("y_mm", 0.0),
                "waypoints": tuple(_moved(w, drawn) for w in scene.motion.waypoints),
            }
        )
    if "friction" in drawn:
        changes["contact"] = scene.contact.model_copy(update={"friction": drawn["friction"]})
    if "size_factor" in drawn:
        changes["indenters"] = tuple(_sized(i, drawn["size_factor"]) for i in scene.indenters)
    # A copy is not checked; a round trip is, with the limits of every field.
    return type(scene).model_validate_json(scene.model_copy(update=changes).model_dump_json())


def _moved(waypoint: Waypoint, drawn: dict[str, float]) -> Waypoint:
    match waypoint:
        case Press():
            depth = waypoint.depth_mm * drawn.get("depth_factor", 1.0)
            return waypoint.model_copy(update={"depth_mm": depth})
        case Shear() | Slide():
            angle = math.radians(drawn.get("direction_deg", 0.0))
            factor = drawn.get("lateral_factor", 1.0)
            cos, sin = factor * math.cos(angle), factor * math.sin(angle)
            x, y = waypoint.x_mm, waypoint.y_mm
            return waypoint.model_copy(
                update={"x_mm": cos * x - sin * y, "y_mm": sin * x + cos * y}
            )
        case Twist():
            turn = waypoint.angle_deg * drawn.get("twist_factor", 1.0)
            return waypoint.model_copy(update={"angle_deg": turn})
        case _:
            return waypoint


def _sized(indenter: Indenter, factor: float) -> Indenter:
    lengths = {
        name: value * factor
        for name in type(indenter).model_fields
        if name.endswith("_mm") and name != "resolution_mm"
        if (value := getattr(indenter, name)) is not None
    }
    if isinstance(indenter, MeshFile):
        lengths["scale"] = indenter.scale * factor
    return indenter.model_copy(update=lengths)
