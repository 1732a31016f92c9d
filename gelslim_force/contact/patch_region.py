"""Where in the picture the shading changed as under a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from gelslim_force.contact.shading_change import ShadingChange


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


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CLEAR = 2.0
"""Change over the noise from which a bin's own change counts."""
LEAST_AROUND = 2
"""Valid bins of 3 x 3 that a bin must have around it."""


def changed_region(light: ShadingChange, settings: PatchSettings) -> tuple[Mask | None, float]:
    """Largest group of bins whose shading changed, and its contrast."""
    s = settings
    change = light.change.astype(np.float32, copy=False)
    valid = light.valid.astype(np.float32)
    over_noise = np.square(change / light.noise)
    power = over_noise.mean(axis=0)
    # What noise may well have made has no size, or dark bins would outweigh a patch.
    clear = np.abs(change) * (over_noise > CLEAR**2)
    size = np.float32(s.largest_change) * np.tanh(clear.max(axis=0) / np.float32(s.largest_change))
    around = _around(np.stack([valid, power * valid, size * valid]))
    power, size = around[1:] / np.maximum(around[0], 1)
    changed = (power > s.least_power) & (size > s.least_change) & (around[0] >= LEAST_AROUND)
    if changed.sum() < s.least_bins:
        return None, 0.0
    # Faint changes far off (a lamp, a hand's shadow) are not the patch's.
    sizes = size[changed]
    rank = round(0.98 * (len(sizes) - 1))
    level = s.outline_level * float(np.partition(sizes, rank)[rank])
    whole = changed & (size >= level)
    box = _box(whole, 3)
    strong, size = whole[box], size[box]
    # Ink splits a patch: groups that a bin or two keep apart are one.
    labels, count = ndimage.label(ndimage.binary_dilation(strong, iterations=2))
    if not count:
        return None, 0.0
    score = ndimage.sum_labels(np.where(strong, size**3, 0.0), labels, np.arange(1, count + 1))
    strong = _joined(labels, score) & strong
    if strong.sum() < s.least_bins:
        return None, 0.0
    region = np.zeros_like(whole)
    region[box] = strong
    return region, float(np.sqrt(power[region].mean()))


def _around(layers: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sums over 3 x 3 bins, of layers (k, rows, columns); nothing lies beyond the picture."""
    wide = np.pad(layers, ((0, 0), (1, 1), (1, 1)))
    down = wide[:, :-2] + wide[:, 1:-1] + wide[:, 2:]
    return np.asarray(down[:, :, :-2] + down[:, :, 1:-1] + down[:, :, 2:])


def _box(mask: Mask, margin: int) -> tuple[slice, slice]:
    """The smallest box about a mask, wider by a margin on each side."""
    sides = []
    for axis in (1, 0):
        at = np.flatnonzero(mask.any(axis=axis))
        low, high = (int(at[0]), int(at[-1])) if len(at) else (0, 0)
        sides.append(slice(max(0, low - margin), high + margin + 1))
    return sides[0], sides[1]


def _joined(labels: NDArray[np.int32], score: Array) -> Mask:
    """The strongest group, with those no less than a fifth as strong and no further than its size.

    Red and green change most on two sides of a line through the middle, which stays dark.
    """
    best = 1 + int(np.argmax(score))
    chosen = labels == best
    if len(score) == 1:
        return np.asarray(chosen)
    near = ndimage.distance_transform_edt(~chosen) <= 2 * np.sqrt(chosen.sum() / np.pi)
    others = np.unique(labels[near])
    strong = [k for k in others if k > 0 and score[k - 1] >= 0.2 * score[best - 1]]
    return np.isin(labels, strong)
