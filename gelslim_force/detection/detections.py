"""Dots found in one frame: centres, sizes, contrasts and what is doubtful about each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

GOOD, BORDER, FAINT, ODD_SHAPE, SMALL, LARGE, RESTLESS = 0, 1, 2, 4, 8, 16, 32
"""Bits of `Detections.flags`: the window leaves the picture; under half of the neighbours'
contrast; not an ellipse; under half or over 1.6 times the neighbours' area (an odd-sized anchor
is LARGE); the centre had not come to rest."""
DOUBTFUL = BORDER | FAINT | ODD_SHAPE | RESTLESS


@dataclass(frozen=True, eq=False)
class Detections:
    """Dots of a frame, n of them; arrays are read-only copies.

    Pixel centres are at integer coordinates, x to the right and y down.
    Raises ValueError where arrays disagree in length.
    """

    centres_px: NDArray[np.float64]
    """(n, 2) sub-pixel centres (x, y)."""
    area_px: NDArray[np.float64]
    """(n,) dark area; 0 where a dot asked for by place was not found."""
    contrast: NDArray[np.float64]
    """(n,) darkness against the light around: 0 none, 1 black."""
    moments_px2: NDArray[np.float64]
    """(n, 3) second moments (xx, xy, yy) of the dark area."""
    flags: NDArray[np.int64]
    """(n,) bits, 0 for a dot without blemish."""

    def __post_init__(self) -> None:
        count = len(self.area_px)
        shapes = {"centres_px": (count, 2), "moments_px2": (count, 3)}
        for name in ("centres_px", "area_px", "contrast", "moments_px2", "flags"):
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
        """(n,) found, and nothing is doubtful about the centre."""
        return self.found & ((self.flags & DOUBTFUL) == 0)

    def take(self, which: ArrayLike) -> Detections:
        """Return the dots chosen by indices or by (n,) booleans."""
        chosen = np.asarray(which)
        return Detections(
            centres_px=self.centres_px[chosen],
            area_px=self.area_px[chosen],
            contrast=self.contrast[chosen],
            moments_px2=self.moments_px2[chosen],
            flags=self.flags[chosen],
        )

    def joined(self, more: Detections) -> Detections:
        """Return these dots with others after them."""
        return Detections(
            centres_px=np.vstack([self.centres_px, more.centres_px]),
            area_px=np.concatenate([self.area_px, more.area_px]),
            contrast=np.concatenate([self.contrast, more.contrast]),
            moments_px2=np.vstack([self.moments_px2, more.moments_px2]),
            flags=np.concatenate([self.flags, more.flags]),
        )
