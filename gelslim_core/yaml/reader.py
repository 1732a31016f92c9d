"""Read a YAML file into a frozen model; every fault is named with its line and its remedy."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.complaints import Translator
from gelslim_core.yaml.errors import MAX_PROBLEMS, Problem, listed
from gelslim_core.yaml.fields import children, field_at
from gelslim_core.yaml.formats import check_format
from gelslim_core.yaml.nodes import MappingNode, join_path, plain, positions
from gelslim_core.yaml.phrases import give
from gelslim_core.yaml.place import Complaint, locate
from gelslim_core.yaml.source import Source, SourceMap, decode_source, read_source
from gelslim_core.yaml.tree import NUMBER_REMEDY, parse_tree
from gelslim_core.yaml.unions import settle_unions

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class Loaded(Generic[M]):
    """A model read from a file."""

    model: M
    source_map: SourceMap
    """Each field that the file gives, with its place."""
    sha256: str
    """Of the file's bytes."""
    text: str
    """The file's text."""
    path: str
    """The file, as the caller named it."""
    defaulted: tuple[str, ...]
    """Dotted paths of the fields that the file leaves to their defaults."""


def read_model(path: str | os.PathLike[str], model: type[M]) -> Loaded[M]:
    """The `model` in the YAML file at `path`. Raises `InputError`."""
    return load_source(read_source(path), model)


def load_bytes(name: str, data: bytes, model: type[M]) -> Loaded[M]:
    """The `model` in `data`, called `name` in messages. Raises `InputError`."""
    return load_source(decode_source(name, data), model)


def load_source(source: Source, model: type[M]) -> Loaded[M]:
    """The `model` in the YAML text of `source`. Raises `InputError`."""
    start = getattr(model, "starting_point", Block.starting_point)
    root, refused = parse_tree(source, start)
    check_format(source, root, model, start)
    problems = tuple(_with_remedy(problem, model) for problem in refused)
    instance = _validated(source, root, model, problems)
    return Loaded(
        instance,
        SourceMap(dict(positions(root))),
        source.sha256,
        source.text,
        source.path,
        tuple(_defaulted(instance)),
    )


def _with_remedy(problem: Problem, model: type[BaseModel]) -> Problem:
    if problem.remedy != NUMBER_REMEDY:
        return problem
    path, is_item = problem.field, problem.field.endswith("]")
    field = field_at(model, path.rpartition("[")[0] if is_item else path)
    return replace(problem, remedy=give(field, is_item))


def _validated(
    source: Source, root: MappingNode, model: type[M], refused: tuple[Problem, ...]
) -> M:
    # Through JSON, because strict models take a list for a tuple there and nowhere else.
    try:
        instance = model.model_validate_json(json.dumps(plain(root)), strict=True)
    except ValidationError as error:
        problems, unread = _problems(source, root, model, error, refused)
    else:
        problems, unread = [], 0
        if not refused:
            return instance
    raise listed((*refused, *problems), unread)


def _problems(
    source: Source,
    root: MappingNode,
    model: type[BaseModel],
    error: ValidationError,
    refused: tuple[Problem, ...],
) -> tuple[list[Problem], int]:
    """The problems behind `error`, the first of them in file order, and how many more there are."""
    complaints = [_complaint(root, item) for item in error.errors(include_url=False)]
    fields = {p.field for p in refused}
    heard = [c for c in complaints if not _answered(c, fields)]
    blamed = fields | {c.place.path for c in heard}
    heard = [c for c in heard if not _follows(c, blamed)]
    translator = Translator(source.path, root, model)
    ordered = sorted(settle_unions(heard), key=lambda complaint: complaint.place.position)
    # Suggestions compare a key with every field: a file of nonsense pays for the listed ones only.
    translated = [translator.problem(complaint) for complaint in ordered[:MAX_PROBLEMS]]
    meant = {s.paths[0] for _, s in translated if len(s.paths) == 1}
    problems = [
        problem
        for problem, _ in translated
        if problem.message != "missing" or problem.field not in meant
    ]
    return problems, len(ordered) - len(translated)


def _complaint(root: MappingNode, item: Any) -> Complaint:
    place = locate(root, item["loc"])
    return Complaint(item["type"], item.get("ctx", {}), item["msg"], place)


def _answered(complaint: Complaint, refused: set[str]) -> bool:
    """Whether a value that was refused earlier is behind this complaint."""
    path = complaint.place.path
    if any(path == field or path.startswith((f"{field}.", f"{field}[")) for field in refused):
        return bool(path)
    if complaint.kind in ("value_error", "assertion_error"):
        return any(not path or field.startswith((f"{path}.", f"{path}[")) for field in refused)
    return False


def _follows(complaint: Complaint, blamed: set[str]) -> bool:
    """Whether a list is only called too short because its items were refused."""
    items = f"{complaint.place.path}["
    return complaint.kind == "too_short" and any(path.startswith(items) for path in blamed)


def _defaulted(model: BaseModel, prefix: tuple[str | int, ...] = ()) -> Iterator[str]:
    for name in type(model).model_fields:
        path = (*prefix, name)
        value = getattr(model, name)
        if name in model.model_fields_set:
            yield from _defaulted_below(value, path)
        elif isinstance(value, BaseModel):
            yield from _leaves(value, join_path(path))
        else:
            yield join_path(path)


def _defaulted_below(value: Any, path: tuple[str | int, ...]) -> Iterator[str]:
    if isinstance(value, BaseModel):
        yield from _defaulted(value, path)
    elif isinstance(value, tuple | list):
        for index, item in enumerate(value):
            yield from _defaulted_below(item, (*path, index))


def _leaves(model: BaseModel, path: str) -> Iterator[str]:
    for field in children(type(model), ""):
        value = getattr(model, field.name)
        name = f"{path}.{field.name}"
        if isinstance(value, BaseModel):
            yield from _leaves(value, name)
        else:
            yield name
