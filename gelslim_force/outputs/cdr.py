"""The byte format of ROS 2 messages: plain CDR, little-endian (OMG DDSI-RTPS 2.3, 10.5).

Numbers are aligned to their size, counted from the end of the 4-byte encapsulation header; strings
end in a zero byte that counts in their length; a sequence is its length and then its elements.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import ArrayLike

_HEADER = b"\x00\x01\x00\x00"


class CdrMessage:
    """One message; fields are added in the order of its definition."""

    def __init__(self) -> None:
        self._parts = bytearray(_HEADER)

    def boolean(self, value: bool) -> None:
        """Add a bool."""
        self._parts.append(1 if value else 0)

    def int32(self, value: int) -> None:
        """Add an int32. Raises struct.error beyond its range."""
        self._align(4)
        self._parts += struct.pack("<i", value)

    def uint32(self, value: int) -> None:
        """Add a uint32. Raises struct.error beyond its range."""
        self._align(4)
        self._parts += struct.pack("<I", value)

    def string(self, text: str) -> None:
        """Add a string."""
        data = text.encode("utf-8", "backslashreplace").replace(b"\0", b"") + b"\0"
        self.uint32(len(data))
        self._parts += data

    def array(self, values: ArrayLike, kind: str) -> None:
        """Add an array of fixed length, or a single number, of a type such as "<f8"."""
        block = np.asarray(values).astype(kind)
        if block.size:
            self._align(block.dtype.itemsize)
            self._parts += block.tobytes()

    def sequence(self, values: ArrayLike, kind: str) -> None:
        """Add an array of any length."""
        self.uint32(int(np.size(values)))
        self.array(values, kind)

    def data(self) -> bytes:
        """Return the message."""
        return bytes(self._parts)

    def _align(self, size: int) -> None:
        self._parts += bytes(-(len(self._parts) - len(_HEADER)) % size)
