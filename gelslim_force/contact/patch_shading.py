"""The contact patch fitted to the slopes that its shading shows.

Under a smooth indenter the slope grows evenly from the middle to the rim; beside it the free
surface levels off steeply. Where the light changes is therefore wider than the patch, but the
crease at the rim is sharp. Each layer of the change of shading is taken to be linear in the slope's
two parts, with one more term in its square; these gains are found anew for every frame, so that no
photometric calibration is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]

STEPS = 12
FIRST_STEPS = 5
ABOUT = (1.0, 0.87, 1.14)
AGAIN_DECAY = 1.5
"""Sizes about the one expected, and the decay beside the last, that a fit is taken up from."""
NEAR = 0.03
"""Move over the patch's size up to which a fit followed from the frame before goes on with the
derivative it has."""
LOOK_AT = 300
GLANCE_AT = 150


@dataclass(frozen=True, eq=False)
class Window:
    """Bins about the patch."""

    x_mm: Array
    """(n,) where the line of sight meets the rest surface."""
    y_mm: Array
    lean: Array
    """(n, 2) motion along x and y per mm of height."""
    change: Array
    """(n, c) over the noise."""
    bin_mm: float
    steps: tuple[NDArray[np.intp], NDArray[np.intp]]
    """Pairs (k,) of bins next to one another on the diagonal."""

    def thinned(self, count: int) -> Window:
        """About `count` of the bins, for a first look."""
        skip = max(1, len(self.x_mm) // count)
        none = np.zeros(0, dtype=np.intp)
        whole = self.x_mm, self.y_mm, self.lean, self.change
        # Contiguous, as the whole window is: kernels are compiled anew for strided arrays.
        x, y, lean, change = (np.ascontiguousarray(a[::skip]) for a in whole)
        return Window(x, y, lean, change, self.bin_mm, (none, none))


@dataclass(frozen=True, eq=False)
class ShadingFit:
    """`values` (4,): x, y, radius, decay of a disc; offset, angle, half-width, decay of a strip."""

    values: Array
    covariance: Array
    explained: float
    """Share of the change that the fit explains."""
    window: Window
    """The bins it was fitted to."""


def best_shading_fit(
    window: Window, starts: list[Array], strip: bool, curvature_per_mm: float, blur_mm: float
) -> ShadingFit | None:
    """The fit from the start that leaves least after a few steps on a part of the bins."""
    if len(starts) == 1:
        return fit_shading(window, starts[0], strip, curvature_per_mm, blur_mm, NEAR)
    part = window.thinned(LOOK_AT)

    def tried(start: Array) -> tuple[float, Array]:
        first = _settle(part, start, strip, curvature_per_mm, blur_mm, FIRST_STEPS)
        return first[1], first[0]

    _, best = min((tried(s) for s in starts), key=lambda t: t[0])
    return fit_shading(window, best, strip, curvature_per_mm, blur_mm)


def leaves_less(
    one: ShadingFit, other: ShadingFit, strip: bool, curvature_per_mm: float, blur_mm: float
) -> bool:
    """Whether one fit leaves less than the other on the same bins, those of the wider window: a
    narrow one knows little of the slope beside the patch."""
    window = max(one.window, other.window, key=lambda w: len(w.x_mm))
    residual = np.empty(window.change.shape)
    first, second = (
        _left(window, f.values, strip, curvature_per_mm, blur_mm, residual) for f in (one, other)
    )
    return first < second


def _left(
    window: Window,
    values: Array,
    strip: bool,
    curvature_per_mm: float,
    blur_mm: float,
    residual: Array,
) -> float:
    from gelslim_force.contact.patch_fit_kernel import squares_left

    return float(
        squares_left(
            window.x_mm, window.y_mm, window.lean, window.change, values, strip,
            curvature_per_mm, blur_mm, residual,
        )
    )  # fmt: skip


def moved_on(
    window: Window,
    last: Array,
    shift_mm: Array,
    growth: float,
    strip: bool,
    curvature_per_mm: float,
    blur_mm: float,
) -> Array:
    """Where to start from the fit of the frame before, (4,): of other places, sizes and decays,
    that which leaves least.

    `shift_mm` (2,) is the way of what changed in the picture, `growth` that of its size. A rim
    that has moved by a tenth of the size is not found from where it was: the crease fits a steep
    decay there.
    """
    part = window.thinned(GLANCE_AT)
    residual = np.empty(part.change.shape)
    here, there = last.copy(), last.copy()
    if strip:
        there[0] += shift_mm @ [-np.sin(last[1]), np.cos(last[1])]
    else:
        there[:2] += shift_mm
    sizes = [s * g for g in {1.0, growth} for s in ABOUT]
    starts = [place * [1, 1, size, 1] for place in (here, there) for size in sizes]
    starts += [np.array([*s[:3], AGAIN_DECAY]) for s in starts]

    return min(starts, key=lambda s: _left(part, s, strip, curvature_per_mm, blur_mm, residual))


def fit_shading(
    window: Window,
    start: Array,
    strip: bool,
    curvature_per_mm: float,
    blur_mm: float,
    near: float = 0.0,
) -> ShadingFit | None:
    """Gauss-Newton with the gains projected out; None where it does not settle.

    `curvature_per_mm` is 1/R of the indenter, 0 where unknown; `blur_mm` widens the crease.
    """
    theta, cost, residual, jacobian = _settle(
        window, start, strip, curvature_per_mm, blur_mm, STEPS, near
    )
    whole = window.change - window.change.mean(axis=0)
    explained = 1 - cost / max(float((whole**2).sum()), 1e-12)
    if not np.isfinite(theta).all() or theta[2] < 1.5 * window.bin_mm:
        return None
    freedom = max(residual.size - 4 - 7 * residual.shape[1], 1)
    spread = cost / freedom * _together(residual, window)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * spread
    return ShadingFit(theta, covariance, explained, window)


def _settle(
    window: Window,
    start: Array,
    strip: bool,
    curvature_per_mm: float,
    blur_mm: float,
    steps: int,
    near: float = 0.0,
) -> tuple[Array, float, Array, Array]:
    """Values, squares left, residual (n, c) and its derivative (n c, 4)."""
    from gelslim_force.contact.patch_fit_kernel import settle

    theta = start.copy()
    residual = np.empty(window.change.shape)
    jacobian = np.zeros((residual.size, 4))
    cost = settle(
        window.x_mm, window.y_mm, window.lean, window.change, theta, strip, curvature_per_mm,
        blur_mm, steps, near, residual, jacobian,
    )  # fmt: skip
    return theta, float(cost), residual, jacobian


def _together(residual: Array, window: Window) -> float:
    """How many bins err as one, from the likeness of neighbours on the diagonal."""
    power = float((residual**2).mean())
    first, second = window.steps
    if power <= 0 or not len(first):
        return 1.0
    diagonal = float((residual[first] * residual[second]).mean()) / power
    # Along a row or column likeness is greater: its square is the diagonal's.
    like = min(max(diagonal, 0.0), 0.9) ** 0.5
    return min(((1 + like) / (1 - like)) ** 2, 200.0)


STARTS = ((0.7, 0.5), (0.85, 1.5), (1.0, 4.0))
"""Sizes, over the outline's, and decays that the fit to the shading starts from."""
AFRESH, STEADY = 12, 0.08
"""Frames that a patch is followed for at most, and the change of its region, relative, up to
which it is, before it is sought afresh as well."""


@dataclass(frozen=True, eq=False)
class Region:
    """Where the light changed: its middle (2,), and the radius of a disc of its area."""

    middle_mm: Array
    reach_mm: float


@dataclass(frozen=True, eq=False)
class Followed:
    """What a frame hands on to the next; `age` frames ago the patch was sought afresh."""

    patch: ContactPatch
    fit: ShadingFit
    region: Region
    age: int


def settled(before: ContactPatch, after: ContactPatch) -> bool:
    """Whether the bins about the one patch serve for the other."""
    shift = float(np.linalg.norm(after.centre_mm - before.centre_mm)) / before.size_mm
    return shift < 0.3 and 0.7 < after.size_mm / before.size_mm < 1.15


def values_of(patch: ContactPatch, scale: float, decay: float) -> Array:
    """Start (4,) of the fit to the shading from a patch."""
    if patch.kind == "disc":
        return np.array([*patch.centre_mm, scale * patch.size_mm, decay])
    turn = np.deg2rad(patch.angle_deg)
    across = float(patch.centre_mm @ np.array([-np.sin(turn), np.cos(turn)]))
    return np.array([across, turn, scale * patch.size_mm, decay])
