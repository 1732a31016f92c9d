"""The dots of a picture at rest: their ellipses, the contrast of the ink and the point spread.

A dot lets through the light 1 - c k, where k is the share of a pixel that the blurred ellipse
covers and c the contrast of the channel. The detected second moments give the ellipses up to their
sizes. A common factor on these and the standard deviation of the blur are fitted, then the share of
ink of each dot and the contrasts are read in the middles of the dots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.render.printed_dots import CORNERS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
COVERED = 0.004
"""Share of ink from which a pixel counts as one of a dot."""
_WIDER = 1.3
"""Of the first outlines, before size and blur are known."""
_FIRST_BLUR_PX, _MOST_BLUR_PX = 0.8, 6.0
_SIZES = 0.6, 1.6
_MIDDLE_PX = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))
"""Rows and columns of the middle of a dot."""
_LEAST_LIGHT = 0.3
"""Light of a dot, at least, over that of the others in a channel, to count for its contrast."""
_DARKEST = 0.9
"""Quantile of the dots' ink that counts as full."""


@dataclass(frozen=True, eq=False)
class SeenDots:
    """Ellipses of m dots in a picture.

    Attributes:
        centres_px: (m, 2).
        moments_px2: (m, 3) second moments xx, xy, yy.
        defocus_px: (m,) standard deviation of the blur by defocus at each dot.
        opacity: (m,) ink of each dot over that of the darkest; None for equal dots.
    """

    centres_px: Array
    moments_px2: Array
    defocus_px: Array
    opacity: Array | None = None

    @property
    def ink_share(self) -> Array:
        """(m,) ink of each dot over that of the darkest."""
        return np.ones(len(self.centres_px)) if self.opacity is None else self.opacity

    def outlines_px(self, size: float = 1.0) -> Array:
        """Outlines (m, k, 2), stretched by `size`."""
        moments = np.empty((len(self.centres_px), 2, 2))
        moments[:, 0, 0], moments[:, 1, 1] = self.moments_px2[:, 0], self.moments_px2[:, 2]
        moments[:, 0, 1] = moments[:, 1, 0] = self.moments_px2[:, 1]
        axes, turn = ellipse_axes(moments)
        angle = np.linspace(0.0, 2 * np.pi, CORNERS, endpoint=False)
        u, v = size * axes[:, :1] * np.cos(angle), size * axes[:, 1:] * np.sin(angle)
        c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
        outlines: Array = self.centres_px[:, None] + np.stack([c * u - s * v, s * u + c * v], 2)
        return outlines

    def ink(self, shape: tuple[int, ...], size: float, blur_px: float) -> NDArray[np.float32]:
        """Share (h, w) of each pixel that ink covers."""
        from gelslim_twin.render.defocus import kernel_taps
        from gelslim_twin.render.dot_kernel import draw_dots

        outlines, count = self.outlines_px(size), len(self.centres_px)
        taps, reach = kernel_taps(np.hypot(self.defocus_px, blur_px))
        ink = np.zeros(shape[:2], dtype=np.float32)
        draw_dots(
            outlines, outlines, np.ones(count, dtype=bool), np.ones(count, dtype=np.int64),
            taps, reach, self.ink_share.astype(np.float32), ink,
        )  # fmt: skip
        return ink

    def on_gel_mm(self, camera: VirtualCamera, places_mm: Array) -> tuple[Array, Array]:
        """Semi-axes (m, 2) in mm and angles (m,) of the dots at places (m, 3) on the gel."""
        from_px = np.linalg.inv(camera.jacobian(places_mm))
        moments = np.empty((len(places_mm), 2, 2))
        moments[:, 0, 0], moments[:, 1, 1] = self.moments_px2[:, 0], self.moments_px2[:, 2]
        moments[:, 0, 1] = moments[:, 1, 0] = self.moments_px2[:, 1]
        return ellipse_axes(from_px @ moments @ np.swapaxes(from_px, 1, 2))


def ellipse_axes(moments: Array) -> tuple[Array, Array]:
    """Semi-axes (m, 2) and angles (m,) of even ellipses with second moments (m, 2, 2): 2 sqrt."""
    values, vectors = np.linalg.eigh(moments)
    axes = 2 * np.sqrt(np.maximum(values, 1e-12))
    return axes, np.arctan2(vectors[:, 1, 0], vectors[:, 0, 0])


@dataclass(frozen=True, eq=False)
class FittedInk:
    """Result of `fit_ink`.

    Attributes:
        dots: The dots with the fitted moments, which are those of the ellipses of ink.
        blur_px: Standard deviation of the blur in focus.
        contrast: (c,) share of the light that the ink of the darkest dots absorbs.
        bare: (h, w, c) the picture in linear grey values with the dots filled in.
        covered: (h, w) pixels that ink covers in part.
        explained: (m,) share of the squared darkness around each dot that the model explains.
    """

    dots: SeenDots
    blur_px: float
    contrast: Array
    bare: Array
    covered: Mask
    explained: Array


def fit_ink(linear: Array, dots: SeenDots, pitch_px: float) -> FittedInk:
    """Fit size, blur and contrast of the dots.

    Args:
        linear: (h, w, c) picture in linear grey values.
        dots: The dots in it.
        pitch_px: Their distance, for the smoothness of the light.

    Raises:
        ValueError: There are no dots.
    """
    if len(dots.centres_px) == 0:
        raise ValueError("no dots to fit the ink to")
    size, blur = 1.0, _FIRST_BLUR_PX
    covered = dots.ink(linear.shape, _WIDER, blur) > COVERED
    for _ in range(2):
        bare = filled(linear, covered, pitch_px / 4)
        near = _grown(covered)
        size, blur = _least(_misfit(linear, bare, near, dots), size, blur)
        covered = dots.ink(linear.shape, size, blur) > COVERED
    bare = filled(linear, covered, pitch_px / 4)
    near = _grown(covered)
    dots = replace(dots, moments_px2=dots.moments_px2 * size**2)
    opacity, contrast = _opacity(linear, bare, dots, blur)
    inked = replace(dots, opacity=opacity)
    explained = _explained(linear, bare, near, inked, blur, contrast)
    return FittedInk(inked, blur, contrast, bare, covered, explained)


def filled(picture: Array, covered: Mask, spread_px: float) -> Array:
    """The picture (h, w, c) with covered pixels replaced by the mean around them."""
    from scipy.ndimage import gaussian_filter

    weight = (~covered).astype(float)
    found = picture.copy()
    todo, spread = covered.copy(), max(spread_px, 1.0)
    while todo.any() and spread < 4 * max(picture.shape):
        size = gaussian_filter(weight, spread)
        mean = gaussian_filter(picture * weight[..., None], (spread, spread, 0))
        known = todo & (size > 0.05)
        found[known] = mean[known] / size[known, None]
        todo &= ~known
        spread *= 2
    return found


def _grown(covered: Mask) -> Mask:
    from scipy.ndimage import binary_dilation

    return np.asarray(binary_dilation(covered, iterations=2))


def _contrast(
    linear: Array, bare: Array, near: Mask, ink: NDArray[np.float32]
) -> tuple[Array, float]:
    """Contrast (c,) of least squares, and the share of the squared darkness that it leaves."""
    dark = (bare - linear)[near]
    full = bare[near] * ink[near][:, None]
    found = np.clip((full * dark).sum(axis=0) / np.maximum((full**2).sum(axis=0), 1e-12), 0, 1)
    return found, _unexplained(linear, bare, near, ink, found)


def _unexplained(
    linear: Array, bare: Array, near: Mask, ink: NDArray[np.float32], contrast: Array
) -> float:
    """Share of the squared darkness of the dots that the model leaves."""
    dark = (bare - linear)[near]
    left = dark - bare[near] * ink[near][:, None] * contrast
    return float((left**2).sum() / max((dark**2).sum(), 1e-12))


def _opacity(linear: Array, bare: Array, dots: SeenDots, blur: float) -> tuple[Array, Array]:
    """Ink (m,) of each dot, at most 1, and the contrast (c,) of the darkest ones.

    Only the middle of a dot counts, where its outline, which is no perfect ellipse, has no part.
    """
    ink = dots.ink(linear.shape, 1.0, blur)
    x, y = np.rint(dots.centres_px).astype(int).T
    dark, full = np.zeros((len(x), linear.shape[2])), np.zeros((len(x), linear.shape[2]))
    for down, right in _MIDDLE_PX:
        at = (np.clip(y + down, 0, ink.shape[0] - 1), np.clip(x + right, 0, ink.shape[1] - 1))
        dark += bare[at] - linear[at]
        full += bare[at] * ink[at][:, None]
    absorbed = dark / np.maximum(full, 1e-9)
    lit = full > _LEAST_LIGHT * np.median(full, axis=0)
    # A channel without any light has no contrast.
    contrast = np.array(
        [
            np.median(a[used]) if used.any() else 0.0
            for a, used in zip(absorbed.T, lit.T, strict=True)
        ]
    )
    share = dark.sum(axis=1) / np.maximum((full * contrast).sum(axis=1), 1e-9)
    darkest = max(float(np.quantile(share, _DARKEST)), 1e-6)
    return np.clip(share / darkest, 0.0, 1.0), np.clip(contrast * darkest, 0.0, 1.0)


def _explained(
    linear: Array, bare: Array, near: Mask, dots: SeenDots, blur: float, contrast: Array
) -> Array:
    """Share (m,) of the squared darkness of the pixels of each dot that the model explains."""
    from scipy.spatial import cKDTree

    rows, columns = np.nonzero(near)
    _, owner = cKDTree(dots.centres_px).query(np.column_stack([columns, rows]))
    dark = (bare - linear)[rows, columns]
    ink = dots.ink(linear.shape, 1.0, blur)[rows, columns, None]
    left = dark - bare[rows, columns] * ink * contrast
    count = len(dots.centres_px)
    off, whole = (np.bincount(owner, (v**2).sum(axis=1), count) for v in (left, dark))
    return np.asarray(1 - off / np.maximum(whole, 1e-12))


def _misfit(
    linear: Array, bare: Array, near: Mask, dots: SeenDots
) -> Callable[[float, float], float]:
    def left(size: float, blur: float) -> float:
        return _contrast(linear, bare, near, dots.ink(linear.shape, size, blur))[1]

    return left


def _least(
    misfit: Callable[[float, float], float], size: float, blur: float
) -> tuple[float, float]:
    """Size and blur of the least misfit, which is smooth in the variance of the blur."""
    from scipy.optimize import minimize

    result = minimize(
        lambda v: misfit(float(np.exp(v[0])), float(np.sqrt(v[1]))),
        [np.log(size), blur**2],
        method="Nelder-Mead",
        bounds=[tuple(np.log(_SIZES)), (0.0, _MOST_BLUR_PX**2)],
        options={"xatol": 2e-3, "fatol": 1e-6, "maxfev": 70},
    )
    return float(np.exp(result.x[0])), float(np.sqrt(result.x[1]))
