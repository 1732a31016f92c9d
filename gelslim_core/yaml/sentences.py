"""What is wrong with one value and what to give instead."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, get_args

from gelslim_core.yaml.errors import shown
from gelslim_core.yaml.fields import Field
from gelslim_core.yaml.nodes import ListNode, MappingNode, Node, Scalar
from gelslim_core.yaml.phrases import SIGNS, give, kind_phrase, number, unit_label
from gelslim_core.yaml.place import Complaint
from gelslim_core.yaml.suggest import one_of, suggest_choice
from gelslim_core.yaml.texts import text_remedy

_LIMIT_KINDS = {
    "greater_than": "gt",
    "greater_than_equal": "ge",
    "less_than": "lt",
    "less_than_equal": "le",
}


def sentence(complaint: Complaint, field: Field | None, is_item: bool) -> tuple[str, str]:
    """Message and remedy for a complaint about the value of `field`, or about an item of it."""
    place, kind, detail = complaint.place, complaint.kind, complaint.detail
    if kind in _LIMIT_KINDS:
        return _limit(field, is_item, kind, detail, place.node)
    if kind.startswith("union_tag"):
        return _tag(detail, field, place.node)
    if kind in ("literal_error", "enum"):
        return _choice(complaint, field, is_item)
    if kind in ("too_short", "too_long"):
        return _length(kind, detail)
    if kind in _TEXT_RULES:
        return _TEXT_RULES[kind](detail, place.node)
    if kind.endswith(("_type", "_from_float", "_parsing")):
        return _wrong_type(field, is_item, place.node)
    return shown(complaint.text, 200), give(field, is_item)


def _choice(complaint: Complaint, field: Field | None, is_item: bool) -> tuple[str, str]:
    node = complaint.place.node
    if is_item and field is not None and field.item_choices and isinstance(node, Scalar):
        allowed = field.item_choices
        return f"must be {one_of(allowed)}", suggest_choice(node.value, allowed)
    if field is None or not field.choices:
        expected = str(complaint.detail.get("expected", "another value"))
        return f"must be {expected.replace(chr(39), '')}", "write one of these"
    if not isinstance(node, Scalar) or isinstance(node.value, bool) or node.value is None:
        return _wrong_type(field, False, node)
    numeric = float in field.types or int in field.types
    choices = suggest_choice(node.value, field.choices)
    if numeric and not choices.startswith("did you"):
        return _wrong_type(field, False, node)
    return f"must be {kind_phrase(field)}", choices


def _tag(detail: dict[str, Any], field: Field | None, node: Node) -> tuple[str, str]:
    """For a block whose kind is told by one of its fields, and that field is missing or wrong."""
    tag = str(detail["discriminator"]).strip("'")
    kinds = tuple(
        choice
        for model in (field.models if field else ())
        for choice in get_args(model.model_fields[tag].annotation)
    )
    if isinstance(node, Scalar) and field is None:
        tags = tuple(re.findall("'([^']*)'", str(detail.get("expected_tags", ""))))
        return f"must be {one_of(tags)}", suggest_choice(node.value, tags)
    return f"has no {tag}", f"add `{tag}: {one_of(kinds) if kinds else '...'}`"


def _limit(
    field: Field | None, is_item: bool, kind: str, detail: dict[str, Any], node: Node
) -> tuple[str, str]:
    sign = _LIMIT_KINDS[kind]
    limit = float(detail[sign])
    value = node.value if isinstance(node, Scalar) else None
    limits = (field.item_limits if is_item else field.limits) if field else ()
    # Of several lower limits a negative number is told the plainest.
    if ("gt", 0.0) in limits and isinstance(value, int | float) and value <= 0:
        sign, limit = "gt", 0.0
    unit = unit_label(field) if limit else ""
    return f"must be {SIGNS[sign]} {number(limit)}{unit}", give(field, is_item)


def _length(kind: str, detail: dict[str, Any]) -> tuple[str, str]:
    count = detail.get("actual_length")
    least, most = detail.get("min_length"), detail.get("max_length")
    if kind == "too_short":
        return f"must have at least {least} item{_s(least)}, has {count}", "add items"
    return f"must have at most {most} item{_s(most)}, has {count or 'more'}", "delete items"


def _s(count: Any) -> str:
    return "" if count == 1 else "s"


def _wrong_type(field: Field | None, is_item: bool, node: Node) -> tuple[str, str]:
    wanted = kind_phrase(field, is_item)
    if isinstance(node, MappingNode):
        return f"must be {wanted}, not a block of fields", give(field, is_item)
    if isinstance(node, ListNode):
        return f"must be {wanted}, not a list", give(field, is_item)
    if node.value is None:
        return f"is empty, must be {wanted}", give(field, is_item)
    if field is not None and not is_item and field.types == (list,):
        return "must be a list", f"write it in brackets: [{node.raw}]"
    numeric = is_item or (field is not None and bool({float, int} & set(field.types)))
    if isinstance(node.value, str) and field is not None:
        cure = text_remedy(node.value, field, numeric)
        return f"must be {wanted}, not text", cure or give(field, is_item)
    if isinstance(node.value, bool):
        return f"must be {wanted}, not true or false", give(field, is_item)
    if field is not None and str in field.types:
        return f"must be text, {node.raw} is a number", f'put it in quotes: "{node.raw}"'
    if field is not None and bool in field.types and node.value in (0, 1):
        return "must be true or false, not a number", f"write {'true' if node.value else 'false'}"
    if isinstance(node.value, float) and node.value.is_integer() and field is not None:
        return f"must be {wanted}", f"write {int(node.value)}"
    return f"must be {wanted}", give(field, is_item)


def _text_length(detail: dict[str, Any], node: Node) -> tuple[str, str]:
    length = len(node.value) if isinstance(node, Scalar) and isinstance(node.value, str) else 0
    if "max_length" in detail:
        return f"must have at most {detail['max_length']} characters, has {length}", "shorten it"
    least = detail["min_length"]
    return f"must have at least {least} character{_s(least)}, has {length}", "write more"


def _text_pattern(detail: dict[str, Any], node: Node) -> tuple[str, str]:
    rule = str(detail.get("pattern", ""))
    value = node.value if isinstance(node, Scalar) and isinstance(node.value, str) else ""
    legal = re.sub(r"[^A-Za-z0-9_.-]+", "_", value).strip("_.-")[:60]
    if legal and re.search(rule, legal):
        return f"must match {rule}", f"for example {legal}"
    return f"must match {rule}", "use other characters: letters, digits, _ and - are safe"


_TEXT_RULES: dict[str, Callable[[dict[str, Any], Node], tuple[str, str]]] = {
    "string_too_long": _text_length,
    "string_too_short": _text_length,
    "string_pattern_mismatch": _text_pattern,
}
