"""Removal of cached kernels whose helpers have changed.

numba compiles a cached kernel again when the kernel's own file changes, but not when a helper that
was compiled into it changes. After an update the old kernel would still be used.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path


def drop_stale(kernels: Iterable[str], helpers: Iterable[str], folder: Path) -> int:
    """Remove cached code of `kernels` that is older than any of `helpers`.

    Both are names of modules in `folder`. Files that cannot be removed are left. Returns the number
    of files removed.
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
