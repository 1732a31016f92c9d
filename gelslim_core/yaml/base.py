"""The base class of every block of an input file, and a check that such blocks share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pydantic import BaseModel, ConfigDict

from gelslim_core.yaml.errors import FieldError

_DEVICES = {"con", "prn", "aux", "nul"} | {f"{p}{k}" for p in ("com", "lpt") for k in range(1, 10)}


@dataclass(frozen=True)
class Unsupported:
    """Something that people ask a file for and that the program does not do.

    Attributes:
        pattern: Regular expression for `path: value` in small letters, such as
            `design.gel.shape: dome`, of a field that is unknown or has an illegal value.
        what: What is asked for, in words that begin the message.
        remedy: What comes closest; empty where nothing does.
    """

    pattern: str
    what: str
    remedy: str = ""


class Block(BaseModel):
    """A frozen block of an input file: strict types, no unknown keys, no NaN.

    Units are the last part of the field names.

    Attributes:
        starting_point: Remedy for a file that is empty or of another kind.
        unsupported: What is refused in plain words instead of with a guess.
    """

    starting_point: ClassVar[str] = "start from an example of this kind of file"

    unsupported: ClassVar[tuple[Unsupported, ...]] = ()

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=False,
        validate_default=True,
    )


def require_folder_name(field: str, name: str) -> None:
    """Raise `FieldError` for a name that Windows cannot use for a folder or a file.

    Windows reserves the names of devices, with any ending too, and drops a dot at the end.
    """
    if name.partition(".")[0].lower() in _DEVICES:
        raise FieldError(field, f"{name} is the name of a device on Windows", "choose another name")
    if name.endswith("."):
        raise FieldError(field, f"{name} ends with a dot, which Windows drops", "leave the dot out")
