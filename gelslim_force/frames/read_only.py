"""Arrays that are only looked at."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind", bound=np.generic)


def read_only(array: NDArray[Kind]) -> NDArray[Kind]:
    """Return a contiguous view of the array, or a copy, that cannot be written to.

    A compiled kernel is made anew for arrays that are strided or may be written to: given all
    input this way, it is compiled once, whoever made the array.
    """
    view: Any = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    checked: NDArray[Kind] = view
    return checked
