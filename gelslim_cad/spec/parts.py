"""Parts of one's own in place of built-in ones: what the spec says, and the files behind it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError, InputError, Problem
from gelslim_core.yaml.source import Position

_STEP = re.compile(r".+\.(step|stp)\Z", re.IGNORECASE)
_PYTHON = re.compile(r"(.+\.py):([A-Za-z_]\w*)\Z")


def _part(description: str) -> str | None:
    found: str | None = Field(default=None, max_length=300, description=description)
    return found


class Parts(Block):
    """Files that replace or change parts, paths relative to the spec: a STEP file, or a Python
    file and a function in it. `body: my_parts.py:body` calls the function with the dimensions and
    the built-in solid; building such a spec runs that file."""

    body: str | None = _part("The body")
    back_cover: str | None = _part("The cover with camera and mirror")
    tip_bezel: str | None = _part("The bezel round the gel; no blank is cut for your own")
    camera_clamp: str | None = _part("The clamp of the camera")
    mirror_seat: str | None = _part("The seat of the mirror")
    gripper_adapter: str | None = _part("The flange on the gripper's jaw with its tongues")

    @model_validator(mode="after")
    def _files(self) -> Parts:
        for name, text in self.given().items():
            if not (_STEP.match(text) or _PYTHON.match(text)):
                raise FieldError(
                    name,
                    "must name a STEP file, or a Python file and a function in it",
                    f"write {name}: my_{name}.step, or {name}: my_parts.py:{name}",
                )
        return self

    def given(self) -> dict[str, str]:
        """The parts that are given, by name."""
        return {name: text for name, text in self.model_dump().items() if text is not None}


@dataclass(frozen=True)
class OwnPart:
    """A part of one's own: which built-in one it is for, and where it comes from.

    Attributes:
        name: Name of the built-in part.
        text: What the spec says.
        file: The STEP or Python file.
        function: Name of the function; empty for a STEP file.
        spec: The spec file as the caller named it.
        place: Where the spec says so; None where the spec was not read from a file.
    """

    name: str
    text: str
    file: Path
    function: str
    spec: str
    place: Position | None

    def problem(self, message: str, remedy: str) -> Problem:
        """A fault of this part as one of the spec's line that asks for it."""
        line, column = (None, None) if self.place is None else tuple(self.place)
        return Problem(self.spec, line, column, f"parts.{self.name}", self.text, message, remedy)

    def error(self, message: str, remedy: str) -> InputError:
        """The error with this one problem."""
        return InputError((self.problem(message, remedy),))


def own_parts(
    given: Mapping[str, str],
    folder: Path,
    spec: str = "spec",
    places: Mapping[str, Position] | None = None,
) -> tuple[OwnPart, ...]:
    """The parts of one's own of a spec.

    Args:
        given: What the spec says by the part's name.
        folder: Folder that paths are relative to.
        spec: The spec file, for messages.
        places: Places of the spec's fields, by their dotted path.

    Returns:
        The parts; their files need not exist.
    """
    found = []
    for name, text in given.items():
        python = _PYTHON.match(text)
        file, function = (python[1], python[2]) if python else (text, "")
        place = (places or {}).get(f"parts.{name}")
        found.append(OwnPart(name, text, folder / file, function, spec, place))
    return tuple(found)


def require_files(parts: Iterable[OwnPart]) -> None:
    """Raise InputError for every part whose file is not there."""
    missing = tuple(
        part.problem("no such file", "paths are relative to the spec's folder")
        for part in parts
        if not part.file.is_file()
    )
    if missing:
        raise InputError(missing)


def files_key(parts: Iterable[OwnPart]) -> str:
    """SHA-256 of the parts' files; of a Python file with all others beside it, as it may use them.

    Files that are not there count as empty.
    """
    digest = hashlib.sha256()
    for part in parts:
        beside = sorted(part.file.parent.glob("*.py")) if part.function else [part.file]
        for file in beside:
            try:
                content = file.read_bytes()
            except OSError:
                content = b""
            digest.update(f"{part.name} {file.name} {len(content)} ".encode() + content)
    return digest.hexdigest()
