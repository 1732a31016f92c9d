"""How sure a contact patch must be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PatchSettings:
    """How sure a patch must be. Raises ValueError for values that make no sense."""

    least_change: float = 0.02
    """Logarithmic change of light (2 %) under which nothing is a patch, however quiet the frame."""
    largest_change: float = 0.6
    """Change from which on the light no longer follows the slope: more counts as little more."""
    least_power: float = 6.0
    """Squared change over the noise that a patch shows, averaged over 3 x 3 bins."""
    least_bins: int = 12
    outline_level: float = 0.4
    """Share of the patch's own change at which its outline is drawn."""
    window: float = 2.2
    """Reach of the fit to the shading, in patch sizes."""
    most_bins: int = 1200
    """Bins that the fit takes part of."""
    blur_px: float = 2.0
    """Blur of the picture, about."""
    least_explained: float = 0.5
    """Share of the change that a fit to the shading must explain, else the outline stands."""
    outline_error: float = 0.15
    """Relative error of a size that rests on the outline alone: the light changes beside it too."""
    shading_error: float = 0.01
    """Relative error of a size from the shading: the law of the slope beside it is not exact."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"patch settings: {name} = {value!r} must be above 0")
