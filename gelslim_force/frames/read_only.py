"""Read-only views of arrays, for compiled kernels."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind", bound=np.generic)


def read_only(array: NDArray[Kind]) -> NDArray[Kind]:
    """Return a contiguous view of the array, or a contiguous copy, that cannot be written to.

    numba compiles a kernel again for each combination of memory layout and write permission.
    With all input prepared by this function it compiles each kernel once.
    """
    view: Any = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    checked: NDArray[Kind] = view
    return checked
