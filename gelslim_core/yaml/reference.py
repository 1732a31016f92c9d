"""A model's JSON Schema as a page to read: every block a section, every field a row."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gelslim_core.yaml.units import split_unit

HEADER = "| field | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n"
_KINDS = {"number": "number", "integer": "whole number", "boolean": "true or false"}
_NONE = "–"

Node = Mapping[str, Any]


@dataclass(frozen=True)
class _Section:
    """One block: where it stands in the YAML, and its schema."""

    path: str
    kind: str
    """Which of several shapes of the same block: the value of its first constant field."""
    body: Node

    @property
    def title(self) -> str:
        """The heading."""
        return f"{self.path}: {self.kind}" if self.kind else self.path


def reference_markdown(schema: Node, level: int = 2) -> str:
    """Sections in Markdown of every block of `schema` (JSON Schema of `gelslim_core.yaml.schema`).

    The fields at the top come first, under the heading "Top"; then blocks in the order of the
    fields, each followed by the blocks inside it. Headings are of `level`.
    """
    top = _Section("Top", "", schema)
    parts = [_section(s, schema, level) for s in (top, *_below("", schema, schema))]
    return "\n".join(parts)


def heading_anchor(title: str) -> str:
    """The fragment by which forges link to a heading."""
    kept = (c for c in title.strip().lower() if c.isalnum() or c in " -_")
    return "".join(kept).replace(" ", "-")


def _below(path: str, body: Node, schema: Node) -> Iterator[_Section]:
    """Every block below the one at `path`, deep ones after the one that holds them."""
    for name, given in body.get("properties", {}).items():
        here = f"{path}.{name}" if path else name
        for section in _blocks(here, given, schema):
            yield section
            yield from _below(section.path, section.body, schema)


def _blocks(path: str, node: Node, schema: Node) -> list[_Section]:
    """The blocks that a field may hold, itself or as items of a list."""
    # Beside a reference stands what the field means; what the block is, the block says itself.
    body = schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    if "properties" in body:
        return [_Section(path, "", body)]
    members = node.get("anyOf") or node.get("oneOf") or ()
    if "items" in node:
        path, members = f"{path}[]", (node["items"],)
    found = [s for member in members for s in _blocks(path, member, schema)]
    if len(found) < 2:
        return found
    return [_Section(s.path, _constant(s.body), s.body) for s in found]


def _constant(body: Node) -> str:
    return next((str(f["const"]) for f in body["properties"].values() if "const" in f), "")


def _resolved(node: Node, schema: Node) -> Node:
    """`node` with its reference followed; what stands beside the reference wins."""
    if "$ref" not in node:
        return node
    target = schema["$defs"][node["$ref"].rpartition("/")[2]]
    return {**target, **{k: v for k, v in node.items() if k != "$ref"}}


def _section(section: _Section, schema: Node, level: int) -> str:
    about = " ".join(str(section.body.get("description", "")).split()).rstrip(".")
    required = section.body.get("required", ())
    # A field that tells one shape from another heads its table.
    fields = sorted(section.body["properties"].items(), key=lambda f: "const" not in f[1])
    rows = [_row(section.path, name, node, name in required, schema) for name, node in fields]
    head = f"{'#' * level} {section.title}\n\n{about}.\n\n"
    return head + HEADER + "\n".join(rows) + "\n"


def _row(path: str, name: str, node: Node, required: bool, schema: Node) -> str:
    here = name if path == "Top" else f"{path}.{name}"
    blocks = _blocks(here, node, schema)
    node = {**node} if blocks else {**_resolved(node, schema)}
    unit = split_unit(name)[1]
    cells = (
        f"`{name}`",
        _type(node, blocks, schema),
        unit.label if unit and unit.label else _NONE,
        _default(node, required, bool(blocks)),
        _range(node, schema) or _NONE,
        str(node.get("description", "")).rstrip(".") or _NONE,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _type(node: Node, blocks: list[_Section], schema: Node) -> str:
    if blocks:
        links = ", ".join(f"[{s.kind or s.path}](#{heading_anchor(s.title)})" for s in blocks)
        is_list = blocks[0].path.endswith("[]")
        words = [w for w in _words(node, schema) if w != "block" and not w.startswith("list")]
        return " or ".join([*words, f"list of {links}" if is_list else f"block {links}"])
    return " or ".join(_words(node, schema)) or "any"


def _words(node: Node, schema: Node) -> list[str]:
    """What a value may be, in words."""
    node = _resolved(node, schema)
    if "const" in node:
        return [f"`{_yaml(node['const'])}`"]
    if "enum" in node:
        return [", ".join(f"`{_yaml(v)}`" for v in node["enum"])]
    if "properties" in node:
        return ["block"]
    members = node.get("anyOf") or node.get("oneOf")
    if members:
        given = [w for m in members for w in _words(m, schema)]
        return [w for w in dict.fromkeys(given) if w != "none"]
    kind = node.get("type")
    if kind == "array":
        inner = dict.fromkeys(w for item in _items(node) for w in _words(item, schema))
        return [f"list of {' or '.join(inner)}".replace("number", "numbers")]
    if kind == "null":
        return ["none"]
    return [_KINDS.get(str(kind), "text")]


def _items(node: Node) -> list[Node]:
    """The schemas of a list's items: one for all, or one each."""
    return list(node.get("prefixItems") or [node.get("items", {})])


def _default(node: Node, required: bool, is_block: bool) -> str:
    if required:
        return "**required**"
    if node.get("default") is None:
        holds_defaults = is_block and "anyOf" not in node and "items" not in node
        return "its defaults" if holds_defaults else "none"
    value = node["default"]
    return f"`{_yaml(value)}`"


def _yaml(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_yaml(item) for item in value)}]"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() else f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def _range(node: Node, schema: Node) -> str:
    """Limits of the value itself, or of the items of a list."""
    node = _resolved(node, schema)
    parts = [_interval(node)]
    for member in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        parts.append(_range(member, schema))
    if node.get("type") == "array":
        inner = _range(_items(node)[0], schema)
        parts.append(_count(node, "minItems", "maxItems", "items"))
        parts.append(f"each {inner}" if inner else "")
    if node.get("type") == "string" and "enum" not in node and "const" not in node:
        parts.append(_count(node, "minLength", "maxLength", "characters"))
        parts.append(f"`{node['pattern']}`" if "pattern" in node else "")
    return ", ".join(dict.fromkeys(p for p in parts if p))


def _interval(node: Node) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
    if low is not None and above is not None:
        low, above = (low, None) if low > above else (None, above)
    if low is not None and high is not None:
        return f"{_yaml(low)} to {_yaml(high)}"
    signs = (("≥", low), (">", above), ("≤", high), ("<", below))
    return ", ".join(f"{sign} {_yaml(limit)}" for sign, limit in signs if limit is not None)


def _count(node: Node, least: str, most: str, noun: str) -> str:
    low, high = node.get(least, 0), node.get(most)
    if low and low == high:
        return f"{low} {noun}"
    if high is None:
        return f"{low} or more {noun}" if low else ""
    return f"{low} to {high} {noun}" if low else f"up to {high} {noun}"
