"""Files of arrays whose errors say what the disk said."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
from numpy.typing import NDArray


class _Stream:
    """A stream without a file descriptor, into which NumPy writes by Python's own calls.

    Into one with a descriptor it writes by itself, and reports a full disk without the reason.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        self.write = stream.write


def save_array(stream: IO[bytes], array: NDArray[Any]) -> None:
    """Write an array as NumPy's `.npy`. Raises the OSError of the disk."""
    np.save(_Stream(stream), np.ascontiguousarray(array), allow_pickle=False)
