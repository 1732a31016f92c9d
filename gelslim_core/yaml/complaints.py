"""Pydantic's complaints as problems: our own sentences, on the line of the field they blame."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from pydantic import BaseModel

from gelslim_core.yaml.errors import FieldError, Problem, shown
from gelslim_core.yaml.fields import Field, children, field_at
from gelslim_core.yaml.nodes import ListNode, MappingNode, Scalar, join_path
from gelslim_core.yaml.phrases import missing_remedy
from gelslim_core.yaml.place import Complaint, Place, locate
from gelslim_core.yaml.sentences import sentence
from gelslim_core.yaml.source import Position
from gelslim_core.yaml.suggest import Suggestion, suggest_key

_MENTION = re.compile(r"[a-z][a-z0-9_]*(?:\[\d+\])?(?:\.[a-z][a-z0-9_]*(?:\[\d+\])?)*")


@dataclass(frozen=True)
class Translator:
    """Turns complaints about one file into problems."""

    path: str
    root: MappingNode
    model: type[BaseModel]

    def problem(self, complaint: Complaint) -> tuple[Problem, Suggestion]:
        """The problem, and the fields that its remedy suggests."""
        kind = complaint.kind
        if kind == "missing":
            return self._missing(complaint), Suggestion("")
        if kind == "extra_forbidden":
            return self._unknown(complaint)
        if kind in ("value_error", "assertion_error"):
            return self._rule(complaint), Suggestion("")
        if kind == "union_tag_invalid":
            tag = str(complaint.detail["discriminator"]).strip("'")
            place = locate(self.root, (*complaint.place.parts, tag))
            message, remedy = sentence(replace(complaint, place=place), None, False)
            return self._at(place, message, remedy), Suggestion("")
        field, is_item = self._field(complaint.place)
        message, remedy = sentence(complaint, field, is_item)
        return self._at(complaint.place, message, remedy), Suggestion("")

    def _at(self, place: Place, message: str, remedy: str, field: str | None = None) -> Problem:
        raw = place.node.raw if isinstance(place.node, Scalar) else ""
        name = shown(place.path if field is None else field, 120)
        return Problem(self.path, *place.position, name, raw or None, message, remedy)

    def _field(self, place: Place) -> tuple[Field | None, bool]:
        path = place.path
        is_item = path.endswith("]")
        return field_at(self.model, path.rpartition("[")[0] if is_item else path), is_item

    def _missing(self, complaint: Complaint) -> Problem:
        place = complaint.place
        name = complaint.place.labels[-1] if place.labels else ""
        if isinstance(name, int):
            count = len(place.node.items) if isinstance(place.node, ListNode) else 0
            return self._at(place, f"has too few items ({count})", "add the others")
        path = f"{place.path}.{name}" if place.path else name
        field = field_at(self.model, path)
        required = tuple(child for child in children(self.model, path) if child.required)
        remedy = missing_remedy(field, place.path, required)
        return Problem(self.path, *place.position, path, None, "missing", remedy)

    def _unknown(self, complaint: Complaint) -> tuple[Problem, Suggestion]:
        place = complaint.place
        value = place.node.value if isinstance(place.node, Scalar) else None
        parent = join_path(place.parts[:-1])
        suggestion = suggest_key(self.model, parent, str(place.parts[-1]), value)
        position = self._key_position(place)
        problem = self._at(place, "unknown field", suggestion.remedy)
        return replace(problem, line=position.line, column=position.column), suggestion

    def _key_position(self, place: Place) -> Position:
        parent = locate(self.root, place.parts[:-1]).node
        key = place.parts[-1]
        if isinstance(parent, MappingNode) and isinstance(key, str):
            return parent.entries[key].key_position
        return place.position

    def _rule(self, complaint: Complaint) -> Problem:
        """A model validator's refusal, on the line of the field it is about."""
        error = complaint.detail.get("error")
        if isinstance(error, FieldError):
            return self._blame(complaint.place, error.field, error.message, error.remedy)
        text = str(error) if error is not None else complaint.text
        mentioned = self._mentioned(complaint.place, text)
        sentence, _, remedy = text.partition("; ")
        if not mentioned:
            remedy = remedy or "correct the fields of this block"
            return self._at(complaint.place, sentence, remedy)
        # "thickness_mm = 3: must be ..." repeats what the problem shows anyway.
        told = re.compile(rf"{re.escape(mentioned[0])} = [^\s:]+:? ")
        if found := told.match(sentence):
            sentence = sentence[found.end() :]
        names = " or ".join(dict.fromkeys(mentioned))
        return self._blame(complaint.place, mentioned[0], sentence, remedy or f"change {names}")

    def _mentioned(self, place: Place, text: str) -> list[str]:
        names = []
        for found in _MENTION.finditer(text):
            name = found.group()
            # A single word such as "layers" is prose, unless it opens the text or has a value.
            is_prose = not re.search(r"[_.]", name) and not text[found.end() :].startswith(" = ")
            if is_prose and found.start():
                continue
            below = locate(self.root, (*place.parts, *re.split(r"[.\[\]]+", name)))
            if len(below.parts) > len(place.parts) and not below.labels:
                names.append(name)
        return names

    def _blame(self, place: Place, name: str, message: str, remedy: str) -> Problem:
        parts = tuple(int(p) if p.isdigit() else p for p in re.split(r"[.\[\]]+", name) if p)
        below = locate(self.root, (*place.parts, *parts))
        path = f"{place.path}.{name}" if place.path else name
        return self._at(place if below.labels else below, message, remedy, path)
