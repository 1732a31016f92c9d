"""A picture within a JSON file: rows as differences, compressed, as text.

Neighbouring rows are alike, and their differences compress to about half the size of the picture.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
MOST_BYTES = 200_000_000
_LEVEL = 6


def picture_record(picture: Picture) -> dict[str, Any]:
    """The picture (h, w) or (h, w, 3) uint8 as strings and numbers."""
    rows = np.ascontiguousarray(picture)
    steps = np.diff(rows, axis=0, prepend=np.zeros_like(rows[:1]))
    packed = zlib.compress(steps.tobytes(), _LEVEL)
    return {"shape": list(rows.shape), "row_steps": base64.b64encode(packed).decode("ascii")}


def picture_of(record: Mapping[str, Any]) -> Picture:
    """The picture of a record.

    Raises:
        ValueError: The record holds no picture.
        KeyError: A part is missing.
    """
    shape = tuple(int(n) for n in record["shape"])
    if len(shape) not in (2, 3) or min(shape) < 1 or (len(shape) == 3 and shape[2] != 3):
        raise ValueError(f"the picture's shape {shape} is not (h, w) or (h, w, 3)")
    size = int(np.prod(shape, dtype=np.int64))
    if size > MOST_BYTES:
        raise ValueError(f"the picture's shape {shape} is larger than {MOST_BYTES} bytes")
    try:
        unpack = zlib.decompressobj()
        data = unpack.decompress(base64.b64decode(record["row_steps"], validate=True), size + 1)
    except (zlib.error, binascii.Error) as error:
        raise ValueError(f"the picture is damaged ({error})") from error
    if len(data) != size:
        raise ValueError(f"the picture has {len(data)} bytes, its shape {shape} needs {size}")
    steps = np.frombuffer(data, dtype=np.uint8).reshape(shape)
    picture: Picture = np.cumsum(steps, axis=0, dtype=np.uint8)
    return picture
