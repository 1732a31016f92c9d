"""The region of the picture in which the shading changed as under a contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from gelslim_force.contact.shading_change import ShadingChange

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LARGEST_CHANGE = 0.6
"""Logarithmic change of light above which the light no longer follows the slope; larger changes
are compressed."""
_LEAST_CHANGE = 0.02
"""Change of light below which nothing is a patch."""
_LEAST_POWER = 6.0
"""Smallest squared change over the noise, averaged over 3 x 3 bins."""
_LEAST_BINS = 12
_OUTLINE_LEVEL = 0.4
"""Share of the patch's own change at which its outline is drawn."""
_CLEAR = 2.0
"""Change over the noise from which a bin's own change counts."""
_LEAST_VALID = 2
"""Smallest number of valid bins among the 3 x 3 around a bin."""


def changed_region(light: ShadingChange) -> tuple[Mask | None, float]:
    """The largest group of bins whose shading changed (None without one), and its contrast."""
    change = light.change.astype(np.float32, copy=False)
    valid = light.valid.astype(np.float32)
    over_noise = np.square(change / light.noise)
    power = over_noise.mean(axis=0)
    # Changes that may be noise do not count, or dark bins would outweigh a patch.
    clear = np.abs(change) * (over_noise > _CLEAR**2)
    most = np.float32(LARGEST_CHANGE)
    size = most * np.tanh(clear.max(axis=0) / most)
    around = _around(np.stack([valid, power * valid, size * valid]))
    power, size = around[1:] / np.maximum(around[0], 1)
    changed = (power > _LEAST_POWER) & (size > _LEAST_CHANGE) & (around[0] >= _LEAST_VALID)
    if changed.sum() < _LEAST_BINS:
        return None, 0.0
    # Faint changes far away (a lamp, the shadow of a hand) do not belong to the patch.
    sizes = size[changed]
    rank = round(0.98 * (len(sizes) - 1))
    level = _OUTLINE_LEVEL * float(np.partition(sizes, rank)[rank])
    outlined = changed & (size >= level)
    box = _box(outlined, 3)
    strong, size = outlined[box], size[box]
    # Ink splits a patch: groups with a gap of one or two bins are joined.
    labels, count = ndimage.label(ndimage.binary_dilation(strong, iterations=2))
    if not count:
        return None, 0.0
    score = ndimage.sum_labels(np.where(strong, size**3, 0.0), labels, np.arange(1, count + 1))
    strong = _joined(labels, score) & strong
    if strong.sum() < _LEAST_BINS:
        return None, 0.0
    region = np.zeros_like(outlined)
    region[box] = strong
    return region, float(np.sqrt(power[region].mean()))


def _around(layers: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sums over 3 x 3 bins of layers (k, rows, columns); bins outside the picture count as 0."""
    wide = np.pad(layers, ((0, 0), (1, 1), (1, 1)))
    down = wide[:, :-2] + wide[:, 1:-1] + wide[:, 2:]
    return np.asarray(down[:, :, :-2] + down[:, :, 1:-1] + down[:, :, 2:])


def _box(mask: Mask, margin: int) -> tuple[slice, slice]:
    """The smallest box around a mask, larger by a margin on each side."""
    sides = []
    for axis in (1, 0):
        at = np.flatnonzero(mask.any(axis=axis))
        low, high = (int(at[0]), int(at[-1])) if len(at) else (0, 0)
        sides.append(slice(max(0, low - margin), high + margin + 1))
    return sides[0], sides[1]


def _joined(labels: NDArray[np.int32], score: Array) -> Mask:
    """The strongest group, and the groups nearby that are at least a fifth as strong.

    Red and green change most on the two sides of a line through the middle of a patch, where they
    hardly change: one contact may appear as two groups.
    """
    best = 1 + int(np.argmax(score))
    chosen = labels == best
    if len(score) == 1:
        return np.asarray(chosen)
    near = ndimage.distance_transform_edt(~chosen) <= 2 * np.sqrt(chosen.sum() / np.pi)
    others = np.unique(labels[near])
    strong = [k for k in others if k > 0 and score[k - 1] >= 0.2 * score[best - 1]]
    return np.isin(labels, strong)
