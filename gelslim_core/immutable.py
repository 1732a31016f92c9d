"""Results that nobody can change: a stored result stays what it was."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind", bound=np.generic)
_MAPPINGS = (dict, Mapping)


def frozen(array: NDArray[Kind]) -> NDArray[Kind]:
    """Return an array that nothing can change: a read-only copy, or the array if it is one."""
    # A read-only view can still be changed through the array that it looks at.
    if array.flags.owndata and not array.flags.writeable:
        return array
    copied = array.copy()
    copied.flags.writeable = False
    return copied


class Immutable:
    """Base of frozen dataclasses whose arrays and mappings are read-only too.

    They are copied when an object is made, and once more when it is copied or unpickled, because
    NumPy makes the arrays of a pickle writable.
    """

    def __post_init__(self) -> None:
        """Replace arrays by read-only ones, and mappings by views of a copy."""
        values = vars(self)
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                values[name] = frozen(value)
            elif isinstance(value, _MAPPINGS):
                values[name] = MappingProxyType(dict(value))

    def __getstate__(self) -> dict[str, Any]:
        """Values by name, with mappings as dictionaries, which can be pickled."""
        return {
            name: dict(value) if isinstance(value, MappingProxyType) else value
            for name, value in vars(self).items()
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the values and make them read-only again."""
        vars(self).update(state)
        self.__post_init__()
