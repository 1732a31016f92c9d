"""The dots found in a frame: centres, sizes, contrasts, and what is doubtful about each."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

BORDER, FAINT, ODD_SHAPE, SMALL, LARGE, NOT_CONVERGED = 1, 2, 4, 8, 16, 32
"""Bits of `Detections.flags`: the window of the dot leaves the picture; less than half of the
contrast of its neighbours; not an ellipse; less than half, or more than 1.6 times, the area of its
neighbours (a large anchor is LARGE); the iteration for the centre did not converge."""
DOUBTFUL = BORDER | FAINT | ODD_SHAPE | NOT_CONVERGED


@dataclass(frozen=True, eq=False)
class Detections:
    """The n dots of a frame; arrays are read-only copies.

    Pixel centres are at integer coordinates, x to the right and y down. Raises ValueError if the
    arrays have different lengths.
    """

    centres_px: NDArray[np.float64]
    """(n, 2) sub-pixel centres (x, y)."""
    area_px: NDArray[np.float64]
    """(n,) dark area; 0 if no dot was found near a given position."""
    contrast: NDArray[np.float64]
    """(n,) darkness relative to the light around the dot: 0 none, 1 black."""
    moments_px2: NDArray[np.float64]
    """(n, 3) second moments (xx, xy, yy) of the dark area."""
    flags: NDArray[np.int64]
    """(n,) bits; 0 for a dot with nothing unusual."""

    def __post_init__(self) -> None:
        count = len(self.area_px)
        shapes = {"centres_px": (count, 2), "moments_px2": (count, 3)}
        for name in _ARRAYS:
            dtype = np.int64 if name == "flags" else np.float64
            array = np.array(getattr(self, name), dtype=dtype)
            if array.shape != shapes.get(name, (count,)):
                raise ValueError(
                    f"detections: {name} has shape {array.shape}, "
                    f"expected {shapes.get(name, (count,))}"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Return the number of dots."""
        return len(self.area_px)

    @property
    def found(self) -> NDArray[np.bool_]:
        """(n,) whether a dot was found; always true after a search of the whole frame."""
        return self.area_px > 0

    @property
    def trustworthy(self) -> NDArray[np.bool_]:
        """(n,) whether a dot was found and nothing is doubtful about its centre."""
        return self.found & ((self.flags & DOUBTFUL) == 0)

    def take(self, which: ArrayLike) -> Detections:
        """Return the dots chosen by indices or by (n,) booleans."""
        chosen = np.asarray(which)
        if chosen.dtype == bool and len(chosen) == len(self) and chosen.all():
            return self
        return Detections(**{name: getattr(self, name)[chosen] for name in _ARRAYS})

    def joined(self, more: Detections) -> Detections:
        """Return these dots followed by others."""
        both = {n: np.concatenate([getattr(self, n), getattr(more, n)]) for n in _ARRAYS}
        return Detections(**both)


_ARRAYS = tuple(field.name for field in fields(Detections))
