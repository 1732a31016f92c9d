"""Draws of a data set: what each sample has, and the scene that it makes.

A draw is a function of the seed of the scene, the number of the sample and the name of what is
drawn. What belongs to a built sensor is a function of the number of that sensor instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_twin.scene.distribution import Range, farther_end, hashed, share_of, value_at
from gelslim_twin.scene.indenter import Indenter, Mesh, MeshFile
from gelslim_twin.scene.motion import Motion, Press, Shear, Slide, Twist, Waypoint
from gelslim_twin.scene.varied_effects import NUMBERS, OF_SENSOR

if TYPE_CHECKING:
    from gelslim_twin.scene.scene import Scene
    from gelslim_twin.scene.variation import Variation

MESH_SUFFIXES = (".stl", ".obj", ".ply")
OF_MOTION = (
    "x_mm", "y_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg", "depth_factor", "lateral_factor",
    "direction_deg", "twist_factor",
)  # fmt: skip


@dataclass(frozen=True)
class NamedTool:
    """A tool of a data set.

    Attributes:
        name: Its name in the table of the samples.
        indenters: Its shapes.
    """

    name: str
    indenters: tuple[Indenter, ...]


@dataclass(frozen=True)
class Drawn:
    """What one sample has.

    Attributes:
        number: Number of the sample.
        tool: Number of its tool among `tools_of`.
        motion: Number of its path among `vary.motions`; 0 where there are none.
        sensor: Number of its built sensor.
        values: Values drawn by name; parameters of effects are `effect.parameter`.
    """

    number: int
    tool: int = 0
    motion: int = 0
    sensor: int = 0
    values: Mapping[str, float] = field(default_factory=dict)


def tools_of(scene: Scene, folder: Path) -> tuple[NamedTool, ...]:
    """The tools of a data set: those listed, then the meshes of the folder by name.

    Args:
        scene: The scene.
        folder: Folder that its paths are relative to.

    Returns:
        At least one tool; without `tools` and `tool_meshes` it is that of the scene.

    Raises:
        ValueError: The folder holds no mesh.
        OSError: It cannot be read.
    """
    vary = scene.vary
    found = [NamedTool(f"{one.shape}_{k}", (one,)) for k, one in enumerate(vary.tools or ())]
    if vary.tool_meshes is not None:
        meshes = vary.tool_meshes
        place = folder / meshes.folder
        names = sorted(p.name for p in place.iterdir() if p.suffix.lower() in MESH_SUFFIXES)
        if not names:
            raise ValueError("holds no STL, OBJ or PLY file")
        found += [
            NamedTool(
                name,
                (
                    Mesh(
                        shape="mesh",
                        file=f"{meshes.folder}/{name}",
                        scale=meshes.scale,
                        down=meshes.down,
                        resolution_mm=meshes.resolution_mm,
                    ),
                ),
            )
            for name in names
        ]
    return tuple(found) or (NamedTool("indenters", scene.indenters),)


def sensors_of(vary: Variation, of_tolerance: bool = False) -> int:
    """Number of built sensors of a data set.

    Args:
        vary: The block of the scene.
        of_tolerance: Whether Poisson's ratio or thickness is drawn from a tolerance of the spec.
    """
    drawn = (
        vary.gel.poissons_ratio is not None
        or vary.gel.thickness_factor is not None
        or (vary.gel.within_tolerance and of_tolerance)
        or any(True for _ in vary.camera.ranges())
        or any(effect in OF_SENSOR for effect, _, _ in vary.effects.ranges())
        or "sensors" in vary.model_fields_set
    )
    return vary.sensors if drawn else 1


def drawn(scene: Scene, number: int, tools: int = 1, sensors: int = 1) -> Drawn:
    """What sample `number` has: the same on every machine.

    Args:
        scene: The scene of the data set.
        number: Number of the sample, from 0.
        tools: Number of tools.
        sensors: Number of built sensors.

    Raises:
        ValueError: The number is negative.
    """
    if number < 0:
        raise ValueError(f"scene number {number}: must not be negative")
    seed, vary = scene.seed, scene.vary
    values = {name: value_at(given, share_of(seed, number, name)) for name, given in vary.ranges()
              if name != "light_gain"}  # fmt: skip
    chosen = {
        name: drawn_number(seed, number, name, count)
        for name, count in (
            ("tool", tools), ("motion", len(vary.motions or (0,))), ("sensor", sensors),
        )
    }  # fmt: skip
    for effect, name, given in vary.effects.ranges():
        if effect not in OF_SENSOR:
            share = share_of(seed, number, effect, name)
            values[f"{effect}.{name}"] = _counted(effect, name, given, share)
    return Drawn(number, **chosen, values=values | sensor_values(scene, chosen["sensor"]))


def drawn_number(seed: int, number: int, name: str, count: int) -> int:
    """Which of `count` a sample has, each as likely; `name` is `tool`, `motion` or `sensor`."""
    return int(share_of(seed, number, name) * count)


def sensor_values(scene: Scene, sensor: int) -> dict[str, float]:
    """Parameters of effects that are drawn for a built sensor, `effect.parameter`."""
    return {
        f"{effect}.{name}": _counted(
            effect, name, given, share_of(scene.seed, "sensor", sensor, effect, name)
        )
        for effect, name, given in scene.vary.effects.ranges()
        if effect in OF_SENSOR
    }


def corner(scene: Scene, tool: int, motion: int, small: bool) -> Drawn:
    """The hardest sample of a tool on a path, from which a data set is planned.

    Every range is at the end that is farther from zero; `small` tools have their least size.
    """
    values = {name: farther_end(given) for name, given in scene.vary.ranges()
              if name != "light_gain"}  # fmt: skip
    if small and scene.vary.size_factor is not None:
        values["size_factor"] = scene.vary.size_factor[0]
    for effect, name, given in scene.vary.effects.ranges():
        values[f"{effect}.{name}"] = _counted(effect, name, given, 1 - 1e-12)
    return Drawn(0, tool, motion, 0, values)


def _counted(effect: str, name: str, given: Range, share: float) -> float:
    """A value of a parameter; of one that counts, each whole number of the range as likely."""
    if NUMBERS[effect][name] is float:
        return value_at(given, share)
    low, high = math.ceil(given[0]), math.floor(given[1])
    return low + int(share * (high - low + 1))


def drawn_scene(scene: Scene, what: Drawn, tools: Sequence[NamedTool]) -> Scene:
    """The scene of one sample: everything drawn is in its place, and no ranges are left.

    Raises:
        ValueError: A motion by table whose ranges ask for more than its place, or a value drawn
            outside the scene's limits; the message names it.
    """
    values = what.values
    motion = (scene.vary.motions or (scene.motion,))[what.motion]
    changes: dict[str, Any] = {
        "vary": type(scene.vary)(),
        "seed": hashed(scene.seed, what.number),
        "name": f"{scene.name[:50]}-{what.number:06d}",
        "indenters": tools[what.tool].indenters,
        "motion": _moved_motion(motion, values),
    }
    if "friction" in values:
        changes["contact"] = scene.contact.model_copy(update={"friction": values["friction"]})
    if "size_factor" in values:
        changes["indenters"] = tuple(
            _sized(one, values["size_factor"]) for one in tools[what.tool].indenters
        )
    effects = _effect_values(values)
    if effects:
        changes["effects"] = _changed_effects(scene, effects)
    # A copy is not checked; a round trip is, with the limits of every field. What the scene leaves
    # open stays open, such as a friction that is then that of the gel's skin.
    copied = scene.model_copy(update=changes)
    return type(scene).model_validate_json(copied.model_dump_json(exclude_unset=True))


def _effect_values(values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for key, value in values.items():
        effect, dot, name = key.partition(".")
        if dot:
            found.setdefault(effect, {})[name] = value
    return found


def _changed_effects(scene: Scene, values: Mapping[str, Mapping[str, float]]) -> Any:
    own = scene.effects.parameters()
    return scene.effects.model_copy(
        update={effect: own[effect].model_copy(update=dict(new)) for effect, new in values.items()}
    )


def _moved_motion(motion: Motion, values: Mapping[str, float]) -> Motion:
    if motion.waypoints is None:
        if set(values) & set(OF_MOTION):
            raise ValueError("a motion by table is not varied; vary size_factor or friction only")
        return motion
    changes: dict[str, Any] = {
        f"start_{name}": getattr(motion, f"start_{name}") + values[name]
        for name in ("x_mm", "y_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg")
        if name in values
    }
    changes["waypoints"] = tuple(_moved(w, values) for w in motion.waypoints)
    return motion.model_copy(update=changes)


def _moved(waypoint: Waypoint, values: Mapping[str, float]) -> Waypoint:
    match waypoint:
        case Press():
            depth = waypoint.depth_mm * values.get("depth_factor", 1.0)
            return waypoint.model_copy(update={"depth_mm": depth})
        case Shear() | Slide():
            angle = math.radians(values.get("direction_deg", 0.0))
            factor = values.get("lateral_factor", 1.0)
            cos, sin = factor * math.cos(angle), factor * math.sin(angle)
            x, y = waypoint.x_mm, waypoint.y_mm
            return waypoint.model_copy(
                update={"x_mm": cos * x - sin * y, "y_mm": sin * x + cos * y}
            )
        case Twist():
            turn = waypoint.angle_deg * values.get("twist_factor", 1.0)
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
