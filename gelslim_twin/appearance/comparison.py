"""Figures of a real picture and the drawn one side by side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.appearance.fit_look import FittedLook, RestPicture, to_grey, to_linear
from gelslim_twin.appearance.ink_fit import SeenDots, fit_ink
from gelslim_twin.appearance.noise_fit import fit_noise
from gelslim_twin.appearance.similarity import profile_error_dn, similarity, similarity_map

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]
_RISE = 2.5631
"""Width of a Gaussian edge from a tenth to nine tenths of its height, in standard deviations."""
_PIXEL2 = 1 / 12
"""Variance of a pixel's own width."""
_CHANGED_DN, _CHANGED_PX = 4.0, 2.0
"""Smoothed difference from the picture at rest from which a pixel counts as changed by a press."""


@dataclass(frozen=True)
class Figures:
    """What both pictures show.

    Attributes:
        dot_contrast: Darkness in grey values of the middle of a dot, the median: 0 none, 1 black.
        edge_percent: Width of a dot's edge between a tenth and nine tenths, of the view's width.
        noise_dn: Standard deviation of the noise in grey values.
        noise_correlation: Of pixels 1, 2 and 3 px apart.
    """

    dot_contrast: float
    edge_percent: float
    noise_dn: float
    noise_correlation: tuple[float, float, float]

    def to_record(self) -> dict[str, Any]:
        """Plain values."""
        return {**vars(self), "noise_correlation": list(self.noise_correlation)}


def figures_of(picture: Picture, fitted: FittedLook, rest: RestPicture) -> Figures:
    """Figures of a real or drawn picture at rest, each measured in the same way.

    Args:
        picture: The picture.
        fitted: Tells gamma and the pixels of the dots.
        rest: Tells where the dots are.
    """
    planes, gamma = np.atleast_3d(picture), fitted.look.gamma
    dots = SeenDots(rest.centres_px, rest.moments_px2, np.zeros(len(rest.centres_px)))
    ink = fit_ink(to_linear(planes, gamma), dots, rest.pitch_px)
    noise = fit_noise(planes, fitted.ink.covered, gamma)
    sigma = np.sqrt(ink.blur_px**2 + _PIXEL2)
    return Figures(
        dot_contrast(planes, to_grey(ink.bare, gamma), rest.centres_px),
        float(100 * _RISE * sigma / planes.shape[1]),
        noise.grey_dn,
        noise.correlation,
    )


def dot_contrast(planes: Picture, bare: Array, centres_px: Array) -> float:
    """Median darkness of the middles of dots in the sum of the channels.

    Args:
        planes: (h, w, c) uint8.
        bare: (h, w, c) the same without dots.
        centres_px: (m, 2).
    """
    x, y = np.rint(centres_px).astype(int).T
    x, y = np.clip(x, 0, planes.shape[1] - 1), np.clip(y, 0, planes.shape[0] - 1)
    grey, full = (v[y, x].astype(float).sum(axis=1) for v in (planes, bare))
    return float(np.median(1 - grey / np.maximum(full, 1.0)))


def compare_rest(
    fitted: FittedLook, rest: RestPicture, drawn: Picture, noisy: Picture
) -> dict[str, Any]:
    """Compare the picture at rest with the drawn ones.

    Args:
        fitted: The look.
        rest: The real picture.
        drawn: Drawn without noise, which is random in the real picture too.
        noisy: Drawn with noise.

    Returns:
        Plain data: similarities, error of the profiles, and the figures of both pictures.
            `similarity_with_itself` is that of the two drawn pictures: what noise alone leaves.
    """
    real = rest.picture
    return {
        "similarity": similarity(drawn, real),
        "similarity_on_gel": similarity(drawn, real, fitted.on_pad),
        "similarity_with_noise": similarity(noisy, real),
        "similarity_with_itself": similarity(drawn, noisy),
        "profile_error_dn": profile_error_dn(noisy, real, fitted.on_pad).tolist(),
        "real": figures_of(real, fitted, rest).to_record(),
        "drawn": figures_of(noisy, fitted, rest).to_record(),
    }


def compare_press(
    name: str, real: Picture, rest: Picture, drawn: Picture, drawn_rest: Picture
) -> dict[str, Any]:
    """Compare a press that the look was not fitted to with its drawn picture.

    Args:
        name: Of the picture.
        real: The press.
        rest: The real picture at rest.
        drawn: The press as drawn without noise.
        drawn_rest: The picture at rest as drawn without noise.

    Returns:
        Plain data: the similarity of the whole picture, that where the press changed it, and there
        also that of the drawn picture at rest, which knows nothing of the press.
    """
    changed = changed_by(real, rest)
    map_press, map_rest = similarity_map(drawn, real), similarity_map(drawn_rest, real)
    inside = changed if changed.any() else np.ones_like(changed)
    return {
        "picture": name,
        "similarity": float(map_press.mean()),
        "changed_share": float(changed.mean()),
        "similarity_changed": float(map_press[inside].mean()),
        "similarity_changed_of_rest": float(map_rest[inside].mean()),
    }


def changed_by(real: Picture, rest: Picture) -> Mask:
    """Pixels (h, w) whose smoothed grey differs from the picture at rest."""
    from scipy.ndimage import gaussian_filter

    apart = np.atleast_3d(real).astype(float) - np.atleast_3d(rest)
    smooth = gaussian_filter(apart, (_CHANGED_PX, _CHANGED_PX, 0))
    return np.asarray(np.abs(smooth).max(axis=2) > _CHANGED_DN)
