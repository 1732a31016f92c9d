"""Files to which frames are appended one by one, so that a killed process loses none of them.

A record of the journal consists of the magic number `GSF1`, the lengths of its head and its body
(two little-endian uint64), the CRC-32 of both (uint32), the head (JSON: names, types, shapes and
texts) and the body (the arrays one after the other, C order, little-endian). Reading stops at the
first record that is incomplete or damaged.
"""

from __future__ import annotations

import contextlib
import json
import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.outputs.packed_frame import PackedFrame

_PREFIX = struct.Struct("<4sQQI")
_MAGIC = b"GSF1"


class AppendFile:
    """A new file that survives a kill of the process up to the last block that was appended.

    The operating system has the block when `append` returns; a power failure may still lose it.
    """

    def __init__(self, path: Path) -> None:
        """Create the file. Raises FileExistsError if it exists, OSError if the disk refuses."""
        self.path = path
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self._file = os.open(path, flags, 0o644)
        self._length = 0

    def append(self, block: bytes) -> None:
        """Write a complete block. Raises OSError and removes the part of it that was written."""
        rest = memoryview(block)
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._length)
            raise
        self._length += len(block)

    def sync(self) -> None:
        """Force what was appended to the disk. Raises OSError."""
        if self._file >= 0:
            os.fsync(self._file)

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def record(frame: PackedFrame, with_points: bool) -> bytes:
    """Return the bytes of a frame; only one record of a file must hold the nodes at rest."""
    arrays = dict(frame.arrays)
    if with_points and frame.points_mm is not None:
        arrays["points_mm"] = frame.points_mm
    blocks = [np.asarray(a, dtype=a.dtype.newbyteorder("<"), order="C") for a in arrays.values()]
    names = [
        [name, block.dtype.str, block.shape] for name, block in zip(arrays, blocks, strict=True)
    ]
    head = json.dumps({"arrays": names, "problems": frame.problems, "extra": frame.extra}).encode()
    body = b"".join(block.tobytes() for block in blocks)
    check = zlib.crc32(body, zlib.crc32(head))
    return _PREFIX.pack(_MAGIC, len(head), len(body), check) + head + body


def read_journal(path: Path) -> tuple[list[PackedFrame], bool]:
    """Return the complete records of a file and whether its last record is incomplete.

    Raises OSError.
    """
    data = path.read_bytes()
    frames: list[PackedFrame] = []
    points: NDArray[np.float64] | None = None
    start = 0
    while start < len(data):
        found = _next(data, start)
        if found is None:
            return frames, True
        head, body, start = found
        arrays = _arrays(head["arrays"], body)
        points = arrays.pop("points_mm", points)
        has_field = bool(arrays["has_field"])
        frames.append(
            PackedFrame(
                arrays, points if has_field else None, tuple(head["problems"]), head["extra"]
            )
        )
    return frames, False


def _next(data: bytes, start: int) -> tuple[dict[str, Any], bytes, int] | None:
    at = start + _PREFIX.size
    if at > len(data):
        return None
    magic, head_length, body_length, check = _PREFIX.unpack_from(data, start)
    middle, end = at + head_length, at + head_length + body_length
    if magic != _MAGIC or end > len(data):
        return None
    head, body = data[at:middle], data[middle:end]
    if zlib.crc32(body, zlib.crc32(head)) != check:
        return None
    return json.loads(head), body, end


def _arrays(names: list[Any], body: bytes) -> dict[str, NDArray[Any]]:
    arrays, at = {}, 0
    for name, kind, shape in names:
        dtype = np.dtype(kind)
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(body, dtype, count, at).reshape(shape)
        at += count * dtype.itemsize
    return arrays
