"""Names of hidden files beside a file or folder: locks, and what is not finished yet."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

MOST_BYTES = 255
"""Of a name, on nearly every file system."""


def beside(place: Path, ending: str) -> Path:
    """`.NAME` + `ending` in the folder of `place`.

    A name too long for that has its end replaced by a digest: any name that can be written can
    be locked.
    """
    name = f".{place.name}{ending}"
    if len(os.fsencode(name)) > MOST_BYTES:
        digest = hashlib.sha256(os.fsencode(place.name)).hexdigest()[:16]
        short = place.name
        while len(os.fsencode(f".{short}-{digest}{ending}")) > MOST_BYTES:
            short = short[:-1]
        name = f".{short}-{digest}{ending}"
    return place.with_name(name)
