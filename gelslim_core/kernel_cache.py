"""Compiled kernels whose helpers changed are compiled again.

numba renews a cached kernel when its own file changes, not when a helper that was compiled into it
does: after an update an old kernel would run on.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path


def drop_stale(kernels: Iterable[str], helpers: Iterable[str], folder: Path) -> int:
    """Remove cached code of `kernels` older than any of `helpers`; returns how many files.

    Both are module names within `folder`. A cache that cannot be written is left alone: it was
    made by whoever can.
    """
    newest = max((folder / f"{name}.py").stat().st_mtime for name in helpers)
    places = [folder / "__pycache__"]
    if os.environ.get("NUMBA_CACHE_DIR"):
        places += [p for p in Path(os.environ["NUMBA_CACHE_DIR"]).glob("*") if p.is_dir()]
    dropped = 0
    for place in places:
        for name in kernels:
            for cached in place.glob(f"{name}.*.nb[ic]"):
                with contextlib.suppress(OSError):
                    if cached.stat().st_mtime < newest:
                        cached.unlink()
                        dropped += 1
    return dropped
