"""Where benches find the modules of the tests and put what they measured: a folder like docs."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def see_tests(*folders: str) -> None:
    """Let a bench import modules of the tests, whose contacts and looks it takes.

    Args:
        folders: Folders below `tests` that are searched after it, such as `force/real_frames`.
    """
    places = [str(ROOT / "tests"), *(str(ROOT / "tests" / folder) for folder in folders)]
    sys.path[:0] = [place for place in places if place not in sys.path]


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
