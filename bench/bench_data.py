"""Where benches put what they measured: docs/data and docs/images, or a folder like docs."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def write_data(name: str, data: dict[str, Any], docs: Path = DOCS) -> Path:
    """Write `docs`/data/`name`.json in one piece and return its path."""
    return write_whole(
        docs / "data" / f"{name}.json", (json.dumps(data, indent=1) + "\n").encode("utf-8")
    )


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file beside its place, then put it there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(path.name + ".new")
    fresh.write_bytes(content)
    os.replace(fresh, path)
    return path
