"""One scene of a data set, drawn from the ranges of `vary`."""

from __future__ import annotations

import hashlib
import math
from typing import Any

from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.motion import Press, Shear, Slide, Twist, Waypoint
from gelslim_twin.scene.scene import Scene


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
        "seed": own_seed(scene.seed, number),
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
    return Scene.model_validate_json(scene.model_copy(update=changes).model_dump_json())


def own_seed(seed: int, number: int) -> int:
    """The seed of one scene of a data set, below 2^53."""
    digest = hashlib.sha256(f"{seed}/{number}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 11


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
    if indenter.shape == "stl":
        lengths["scale"] = indenter.scale * factor
    return indenter.model_copy(update=lengths)
