"""A spec's text with some values changed, its comments and order kept."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any


def spec_text(text: str, values: Mapping[str, Any]) -> str:
    """`text` as YAML with the fields at the dotted paths set; blocks that it lacks are added."""
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    content = yaml.load(text)
    for path, value in values.items():
        *blocks, last = path.split(".")
        inner = content
        for name in blocks:
            if inner.get(name) is None:
                inner[name] = {}
            inner = inner[name]
        inner[last] = value
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()
