"""Read a YAML file into a frozen model; every fault is reported with its line and its remedy."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.document import CORRECT_VALUE, Document, Path, join_path, parse_document
from gelslim_core.yaml.errors import MAX_PROBLEMS, InputError, Problem, listed
from gelslim_core.yaml.fields import field_at
from gelslim_core.yaml.messages import Complaint, Translator, settle_unions
from gelslim_core.yaml.source import Position, Source, decode_source, read_source

M = TypeVar("M", bound=BaseModel)

_FORMAT = re.compile(r"([A-Za-z0-9-]+)/([0-9]{1,9})\Z")


@dataclass(frozen=True)
class Loaded(Generic[M]):
    """A model read from a file.

    Attributes:
        model: The model.
        source_map: Each field that the file gives, by its dotted path, with its place: a plain
            value where the value stands, a block or a list where its key stands.
        sha256: Hash of the file's bytes, in hexadecimal.
        text: The file's text.
        path: The file, as the caller named it.
        defaulted: Dotted paths of the fields that the file leaves to their defaults.
        lent: Fields that the file asks for from elsewhere, by dotted path, with where they come
            from.
    """

    model: M
    source_map: Mapping[str, Position]
    sha256: str
    text: str
    path: str
    defaulted: tuple[str, ...]
    lent: Mapping[str, str] = field(default_factory=dict, kw_only=True)


Completion = Callable[[Document], None]
"""Adds to a document what its file asks for from elsewhere, by `Document.lend`."""


def read_model(
    path: str | os.PathLike[str], model: type[M], complete: Completion | None = None
) -> Loaded[M]:
    """Read a model from a YAML file.

    Args:
        path: The file.
        model: The class of the model.
        complete: Adds to the document what the file asks for from elsewhere.

    Returns:
        The model with the places of its fields in the file.

    Raises:
        InputError: The file cannot be read or breaks a rule of the model; all problems are listed.
    """
    return load_source(read_source(path), model, complete)


def load_bytes(
    name: str, data: bytes, model: type[M], complete: Completion | None = None
) -> Loaded[M]:
    """The `model` in `data`, called `name` in messages. Raises `InputError`."""
    return load_source(decode_source(name, data), model, complete)


def load_source(source: Source, model: type[M], complete: Completion | None = None) -> Loaded[M]:
    """The `model` in the YAML text of `source`. Raises `InputError`."""
    starting_point = getattr(model, "starting_point", Block.starting_point)
    document = parse_document(source, starting_point)
    _check_format(document, model, starting_point)
    if complete is not None:
        complete(document)
    instance = _validated(document, model)
    source_map = {
        join_path(path): mark.position
        for path, mark in document.marks.items()
        if path and path not in document.lent
    }
    defaulted = tuple(_defaulted(instance.model_dump(), document.marks))
    lent = {join_path(path): origin for path, origin in document.lent.items()}
    return Loaded(
        instance, source_map, source.sha256, source.text, source.path, defaulted, lent=lent
    )


def _check_format(document: Document, model: type[BaseModel], starting_point: str) -> None:
    """Refuse a file of another format before its fields, which would all be different.

    A missing `format:` line, or one that is no text, is left to the model. Raises `InputError`.
    """
    field, given = field_at(model, "format"), document.data.get("format")
    if field is None or not isinstance(given, str) or not field.choices or given in field.choices:
        return
    newest = str(field.choices[-1])
    name, version = newest.rsplit("/", 1)
    found = _FORMAT.match(given)
    if not found or found.group(1) != name:
        message = "not a format of this kind of file"
        remedy = f"give a file that has `format: {newest}`, or correct this line to it"
    elif int(found.group(2)) > int(version):
        message, remedy = "newer than this program", "update gelslim-cad"
    else:
        message = "no longer supported"
        remedy = f"{starting_point}, and write `format: {newest}`"
    message += f", this program reads {', '.join(map(str, field.choices))}"
    mark = document.marks[("format",)]
    path = document.source.path
    raise InputError((Problem(path, *mark.position, "format", mark.raw, message, remedy),))


def _validated(document: Document, model: type[M]) -> M:
    translator = Translator(document, model)
    refused = [
        replace(p, remedy=translator.value_remedy(p.field)) if p.remedy == CORRECT_VALUE else p
        for p in document.problems
    ]
    # Through JSON, because strict models accept a list for a tuple there and nowhere else.
    try:
        instance = model.model_validate_json(json.dumps(document.data), strict=True)
    except ValidationError as error:
        problems, uncounted = _problems(translator, error, refused)
        raise listed((*refused, *problems), uncounted) from None
    if refused:
        raise listed(refused)
    return instance


def _problems(
    translator: Translator, error: ValidationError, refused: list[Problem]
) -> tuple[list[Problem], int]:
    """The problems behind `error`, the first of them in file order, and how many more there are."""
    document = translator.document
    complaints = [
        Complaint(e["type"], e.get("ctx", {}), e["msg"], *document.locate(e["loc"]))
        for e in error.errors(include_url=False)
    ]
    fields = {problem.field for problem in refused}
    open_ = [c for c in complaints if not _explained(c, fields)]
    reported = fields | {join_path(c.path) for c in open_}
    open_ = [c for c in open_ if not _follows(c, reported)]
    ordered = sorted(settle_unions(open_), key=lambda c: document.marks[c.path].position)
    # Suggestions compare a key with every field, so only the listed problems are worded.
    worded = [translator.problem(complaint) for complaint in ordered[:MAX_PROBLEMS]]
    meant = {fields[0] for _, fields in worded if len(fields) == 1}
    problems = [p for p, _ in worded if p.message != "missing" or p.field not in meant]
    return problems, len(ordered) - len(worded)


def _explained(complaint: Complaint, refused: set[str]) -> bool:
    """Whether a value that was refused while parsing is the cause of this complaint."""
    path = join_path(complaint.path)
    if path and any(path == f or path.startswith((f"{f}.", f"{f}[")) for f in refused):
        return True
    below = (f"{path}.", f"{path}[")
    return complaint.is_rule and any(not path or f.startswith(below) for f in refused)


def _follows(complaint: Complaint, reported: set[str]) -> bool:
    """Whether a list is only called too short because its items were refused."""
    items = f"{join_path(complaint.path)}["
    return complaint.kind == "too_short" and any(path.startswith(items) for path in reported)


def _defaulted(value: Any, given: Mapping[Path, Any], path: Path = ()) -> Iterator[str]:
    """Paths of the plain values in the dumped model `value` that are not `given` in the file."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _defaulted(item, given, (*path, name))
    elif path not in given:
        yield join_path(path)
    elif isinstance(value, tuple | list):
        for index, item in enumerate(value):
            yield from _defaulted(item, given, (*path, index))
