"""Read a spec: a YAML file as a frozen `Spec`; every fault is named with its line and remedy."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from gelslim_cad.spec.camera_library import lend_fields
from gelslim_cad.spec.led_library import lend_led_fields
from gelslim_cad.spec.parts import OwnPart, own_parts, require_files
from gelslim_cad.spec.spec import Spec
from gelslim_core.html_table import table_html
from gelslim_core.yaml.document import Document
from gelslim_core.yaml.fields import field_at
from gelslim_core.yaml.reader import Loaded, read_model


@dataclass(frozen=True)
class LoadedSpec(Loaded[Spec]):
    """A spec that was read from a file. In a notebook it shows its fields as a table.

    Attributes:
        spec: The spec.
    """

    @property
    def own_parts(self) -> tuple[OwnPart, ...]:
        """Parts of the author's own, their files relative to that of the spec."""
        folder = Path(self.path).parent
        return own_parts(self.model.parts.given(), folder, self.path, self.source_map)

    @property
    def spec(self) -> Spec:
        """The spec."""
        return self.model

    def _repr_html_(self) -> str:
        """A table for notebooks: each field with its value, unit, line in the file and meaning."""
        rows = []
        for path, value in leaves(self.model):
            place = self.source_map.get(path)
            origin = self.lent.get(path, "default") if place is None else str(place.line)
            field = field_at(Spec, path)
            unit = field.unit.label if field and field.unit else ""
            meaning = field.description if field else ""
            rows.append((path, "" if value is None else str(value), unit, origin, meaning))
        return table_html(("field", "value", "unit", "line", "meaning"), rows)


def leaves(block: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted path and value of every field of `block` that is no block itself."""
    for name in type(block).model_fields:
        value = getattr(block, name)
        path = f"{prefix}{name}"
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{path}.")
        else:
            yield path, value


def read_spec(path: str | os.PathLike[str]) -> LoadedSpec:
    """Read the spec of a finger.

    Args:
        path: The YAML file.

    Returns:
        The spec with the lines of its fields.

    Raises:
        InputError: Every problem of the file. A file with faults is not read in part. Files of
            own parts that are not there count as problems; they are not read.
    """
    loaded = LoadedSpec(**vars(read_model(path, Spec, lend_from_libraries)))
    require_files(loaded.own_parts)
    return loaded


def lend_from_libraries(document: Document) -> None:
    """Give camera and LEDs of a spec's document the fields that the libraries lend them."""
    lend_fields(document)
    lend_led_fields(document)


def suggestion(name: str, known: Iterable[str], otherwise: str) -> str:
    """Which of the known dotted names may be meant; `otherwise` where none is close.

    Close are similar names, and names of other blocks with the same last part.
    """
    names = tuple(known)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    last = name.rsplit(".", 1)[-1]
    close += [k for k in names if k.rsplit(".", 1)[-1] == last and k not in close][:3]
    return f"did you mean {' or '.join(close)}?" if close else otherwise
