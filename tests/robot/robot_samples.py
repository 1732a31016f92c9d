"""A finger with its robot models on disk, for the tests of the room."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from shipped_fingers import dimensions
from shipped_fingers import parts as shipped_parts

pytest.importorskip("cadquery", reason="robot models are made of solids, with the [cad] extra")

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.robot.files import robot_files
from gelslim_cad.robot.model import RobotFinger, robot_finger
from gelslim_cad.solids.finger import finger_parts
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

DESIGN = Path(__file__).parents[2] / "designs" / "mini20.yaml"


@dataclass(frozen=True)
class WrittenFinger:
    """A finger, and the folder that holds its `robot`."""

    d: Dimensions
    parts: tuple[Part, ...]
    finger: RobotFinger
    folder: Path


def _finger(gel: dict[str, float], mount: dict[str, object]) -> tuple[Dimensions, tuple[Part, ...]]:
    if not gel and not mount:
        return dimensions(DESIGN.stem), shipped_parts(DESIGN.stem)
    data = read_spec(DESIGN).spec.model_dump()
    data["design"]["gel"] |= gel
    data["design"]["mount"] |= mount
    d = derive(Spec(**data))
    return d, finger_parts(d)


def written_finger(
    folder: Path, gel: dict[str, float] | None = None, **mount: object
) -> WrittenFinger:
    d, parts = _finger(gel or {}, mount)
    finger = robot_finger("mini20", parts, d)
    for path, (content, _) in robot_files(finger, d).items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return WrittenFinger(d, parts, finger, folder / "robot")
