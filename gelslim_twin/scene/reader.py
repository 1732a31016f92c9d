"""Read a scene with the files that it names; schema and reference page of scenes."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from gelslim_core.yaml.errors import InputError, Problem, shown
from gelslim_core.yaml.reader import Loaded, read_model
from gelslim_core.yaml.schema import reference_markdown, schema_text
from gelslim_twin.scene.draw import Drawn, NamedTool, drawn, drawn_scene, tools_of
from gelslim_twin.scene.indenter import MeshFile
from gelslim_twin.scene.mesh_file import KINDS, footprint_mm
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.pose import Pose, poses
from gelslim_twin.scene.pose_table import LIMITS, read_pose_table
from gelslim_twin.scene.scene import FORMAT, Scene, Tolerance

if TYPE_CHECKING:
    from gelslim_twin.scene.built_look import BuiltLook


@dataclass(frozen=True)
class LoadedScene(Loaded[Scene]):
    """A scene read from a file, with the poses of its motion.

    Attributes:
        model: The scene, also called `scene`.
        path: The file it was read from.
        poses: Poses of the tool in the order of time.
        look: The look that the scene names, whose values its effects have.
    """

    poses: tuple[Pose, ...]
    look: BuiltLook | None = None

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.model

    @property
    def folder(self) -> Path:
        """The folder that paths in the scene are relative to."""
        return Path(self.path).parent

    @property
    def sensor_path(self) -> Path:
        """The spec or bundle of the sensor."""
        return self.folder / (self.scene.sensor.spec or self.scene.sensor.bundle or "")

    @cached_property
    def tools(self) -> tuple[NamedTool, ...]:
        """The tools of the data set that this scene describes.

        Raises `InputError` on the line of `vary.tool_meshes` for a folder without meshes.
        """
        try:
            return tools_of(self.scene, self.folder)
        except (ValueError, OSError) as error:
            meshes = self.scene.vary.tool_meshes
            reason = str(error)
            if isinstance(error, OSError):
                reason = (error.strerror or type(error).__name__).lower()
            raise self.problem(
                "vary.tool_meshes.folder",
                None if meshes is None else shown(meshes.folder),
                reason,
                "name a folder of meshes, relative to the scene's file",
            ) from None

    def numbered(self, number: int) -> LoadedScene:
        """Scene `number` of the data set that this scene's `vary` describes.

        Raises `InputError` on the line of `vary` where a value drawn leaves the scene's limits.
        """
        try:
            return self.with_drawn(drawn(self.scene, number, len(self.tools)))
        except InputError:
            raise
        except ValueError as error:
            raise self.problem("vary", None, str(error), "count from 0") from None

    def with_drawn(self, what: Drawn) -> LoadedScene:
        """The scene of one sample. Raises as `numbered`."""
        try:
            scene = drawn_scene(self.scene, what, self.tools)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(str(part) for part in first["loc"])
            message = f"scene {what.number}: {where} = {first['input']}: {first['msg'].lower()}"
            raise self.problem("vary", None, message, "narrow the ranges") from None
        except ValueError as error:
            message, _, remedy = str(error).partition("; ")
            raise self.problem("vary", None, message, remedy or "correct it") from None
        found = replace(self, model=scene, poses=self._poses_of(scene.motion))
        found.require_upright()
        return found

    def _poses_of(self, motion: Motion) -> tuple[Pose, ...]:
        if motion.csv is None:
            return poses(motion)
        if motion == self.scene.motion:
            return self.poses
        return read_pose_table(self.folder / motion.csv)

    def with_tolerance(self, force_n: float, image_px: float) -> LoadedScene:
        """The same scene with another tolerance."""
        tolerance = Tolerance(force_n=force_n, image_px=image_px)
        return replace(self, model=self.scene.model_copy(update={"tolerance": tolerance}))

    def require_upright(self) -> None:
        """Raise InputError for a pose tilted by more than the limit, which rolls may add up to."""
        most = LIMITS["tilt_x_deg"][1]
        for pose in self.poses:
            tilt = max(abs(pose.tilt_x_deg), abs(pose.tilt_y_deg))
            if tilt > most * (1 + 1e-12):
                raise self.problem(
                    "motion",
                    None,
                    f"tilts the tool by {tilt:.4g}° at {pose.time_s:g} s, the limit is {most:g}°, "
                    "because the tool is known from below only",
                    "tilt or roll less, or give the motion to gelslim.Twin with a mesh",
                )

    def problem(self, field: str, value: str | None, message: str, remedy: str) -> InputError:
        """An error about a field of the scene, on its line or on that of the block it is in."""
        position, near = self.source_map.get(field), field
        while position is None and near:
            near = near.rpartition(".")[0]
            position = self.source_map.get(near)
        line, column = position or (None, None)
        return InputError((Problem(self.path, line, column, field, value, message, remedy),))


def read_scene(path: str | os.PathLike[str]) -> LoadedScene:
    """Read a contact scene, with the poses of its motion.

    The sensor need not exist yet; what uses the sensor reports that it is missing.

    Args:
        path: The YAML file.

    Returns:
        The scene with the lines of its fields, and its poses.

    Raises:
        InputError: Every problem of the file, or of a file that it names.
    """
    loaded = read_model(path, Scene)
    motion, folder = loaded.model.motion, Path(loaded.path).parent
    found = poses(motion) if motion.csv is None else read_pose_table(folder / motion.csv)
    scene = LoadedScene(**vars(loaded), poses=found)
    _check_meshes(scene)
    scene.require_upright()
    return scene if scene.scene.look is None else _with_look(scene, scene.scene.look)


def _with_look(loaded: LoadedScene, name: str) -> LoadedScene:
    """The scene with the values of its look, where it gives none itself."""
    # Only scenes with a look load what reads it.
    from gelslim_twin.scene.built_look import LookError, read_look

    try:
        look = read_look(loaded.folder / name)
    except LookError as error:
        message, _, remedy = str(error).rpartition("; ")
        raise loaded.problem("look", shown(name), message, remedy) from None
    effects = loaded.scene.effects.completed(look.effect_values())
    return replace(loaded, model=loaded.scene.model_copy(update={"effects": effects}), look=look)


def _check_meshes(loaded: LoadedScene) -> None:
    for index, indenter in enumerate(loaded.scene.indenters):
        if not isinstance(indenter, MeshFile):
            continue
        field = f"indenters[{index}].file"
        try:
            footprint_mm(loaded.folder / indenter.file, indenter.down, indenter.scale)
        except ValueError as error:
            raise loaded.problem(field, shown(indenter.file), str(error), f"name {KINDS}") from None
        except OSError as error:
            reason = (error.strerror or type(error).__name__).lower()
            raise loaded.problem(
                field, shown(indenter.file), reason, "paths are relative to the scene's file"
            ) from None


def scene_schema_text() -> str:
    """The JSON Schema (draft 2020-12) of scenes as text."""
    return schema_text(Scene, FORMAT)


RULES = (
    ("sensor", "names `spec` or `bundle`, not both"),
    ("indenters[]: ring", "`inner_radius_mm` is below `outer_radius_mm`"),
    ("indenters[]: flat_punch", "`radius_mm`, or `length_mm` and `width_mm`, not both kinds"),
    ("motion", "`waypoints` or `csv`, not both; a table gives the place, so no start beside it"),
    ("motion", "at most 20 000 poses"),
    ("observe", "nothing is listed twice"),
    (
        "vary",
        "the first value of a range is at most the second; factors of depth and size are above 0",
    ),
    (
        "vary",
        "a range is `[lowest, highest]`, even, or has the name of its distribution third: "
        "`log_uniform`, or `normal` with its mean midway and two standard deviations to each end",
    ),
    ("vary.split", "the shares of validation and test add up to less than 1"),
)
"""What no single field can tell: block, rule. The reader enforces each."""

_HEAD = """\
# Scene reference

<!-- Made by `make docs` from the schema; do not edit by hand. -->

Every field of a contact scene (`format: gelslim-scene/1`), block by block in the order of the file.
What scenes are for, and how effects are chosen, is in the [digital twin's guide](digital_twin.md).
`gelslim schema --scene` prints the JSON Schema, which is also in
[gelslim-scene-1.schema.json](gelslim-scene-1.schema.json).
"""
_BETWEEN = """
## Rules between fields

Checked when the file is read.

"""


def reference_text() -> str:
    """The whole page in Markdown, the same for the same program."""
    rules = "".join(f"- `{block}`: {rule}.\n" for block, rule in RULES)
    return f"{_HEAD}\n{reference_markdown(Scene)}{_BETWEEN}{rules}"
