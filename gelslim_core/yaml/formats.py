"""The `format:` line, looked at before all else: a file of another format has other fields."""

from __future__ import annotations

import re

from pydantic import BaseModel

from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.fields import field_at
from gelslim_core.yaml.nodes import MappingNode, Scalar
from gelslim_core.yaml.source import Source

_FORMAT = re.compile(r"([A-Za-z0-9-]+)/([0-9]{1,9})\Z")


def check_format(source: Source, root: MappingNode, model: type[BaseModel], start: str) -> None:
    """Refuse a file whose `format:` is given and is none that `model` supports.

    A missing line, or one that is no text, is left to the model. Raises `InputError`.
    """
    field = field_at(model, "format")
    entry = root.entries.get("format")
    if field is None or not field.choices or entry is None or not isinstance(entry.node, Scalar):
        return
    node = entry.node
    if not isinstance(node.value, str) or node.value in field.choices:
        return
    message, remedy = _difference(node.value, tuple(str(choice) for choice in field.choices), start)
    problem = Problem(source.path, *node.position, "format", node.raw, message, remedy)
    raise InputError((problem,))


def _difference(given: str, supported: tuple[str, ...], start: str) -> tuple[str, str]:
    newest = supported[-1]
    reads = f"this program reads {' and '.join(supported)}"
    name, version = newest.rsplit("/", 1)
    found = _FORMAT.match(given)
    if not found or found.group(1) != name:
        message = f"not a format of this kind of file, {reads}"
        return message, f"give a file that has `format: {newest}`, or correct this line to it"
    if int(found.group(2)) > int(version):
        return f"newer than this program, {reads}", "update gelslim-cad"
    return (
        f"no longer supported, {reads}",
        f"{start}, and write `format: {newest}`",
    )
