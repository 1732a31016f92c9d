"""The contact patch fitted to the slopes that the change of shading shows.

Under a smooth indenter the slope grows linearly from the middle to the rim. Outside, the free
surface levels off steeply. The region in which the light changes is therefore larger than the
patch, but the crease at the rim is sharp. Each layer of the change of shading is modelled as linear
in the two components of the slope, plus one term in its square. The gains of these terms are fitted
in every frame, so that no photometric calibration is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]

REFRESH_FRAMES = 12
"""Frames for which a patch is followed at most before it is also searched for anew."""
STEADY_CHANGE = 0.08
"""Relative change of the region's size up to which a followed patch needs no new search."""
_STARTS = ((0.7, 0.5), (0.85, 1.5), (1.0, 4.0))
"""Size, over that of the outline, and decay, from which a fit starts."""
_MOST_STEPS = 12
_FIRST_STEPS = 5
_TRIED_SIZES = (1.0, 0.87, 1.14)
"""Factors on the expected size that are tried when a fit continues from the last frame."""
_TRIED_DECAY = 1.5
"""Decay that is tried then, in addition to that of the last frame."""
_SMALL_MOVE = 0.03
"""Change, over the size of the patch, up to which a fit updates its derivative."""
_START_BINS = 300
_CONTINUE_BINS = 150


@dataclass(frozen=True)
class SlopeLaw:
    """What is known of the slope under and around the indenter."""

    strip: bool
    """Whether the patch is a strip; else it is a disc."""
    curvature_per_mm: float
    """1/R of the indenter; 0 where it is not known."""
    blur_mm: float
    """Blur of the crease at the rim."""


@dataclass(frozen=True, eq=False)
class Window:
    """Bins around the patch."""

    x_mm: Array
    """(n,) where the line of sight meets the rest surface."""
    y_mm: Array
    parallax: Array
    """(n, 2) displacement of the line of sight along x and y per mm of height."""
    change: Array
    """(n, c) change of shading over the noise."""
    bin_mm: float
    diagonal: tuple[NDArray[np.intp], NDArray[np.intp]]
    """Pairs (k,) of bins that are neighbours on the diagonal."""

    def thinned(self, count: int) -> Window:
        """About `count` of the bins, for a first evaluation."""
        skip = max(1, len(self.x_mm) // count)
        none = np.zeros(0, dtype=np.intp)
        arrays = self.x_mm, self.y_mm, self.parallax, self.change
        # Contiguous like the full window: kernels would be compiled anew for strided arrays.
        x, y, parallax, change = (np.ascontiguousarray(a[::skip]) for a in arrays)
        return Window(x, y, parallax, change, self.bin_mm, (none, none))


@dataclass(frozen=True, eq=False)
class ShadingFit:
    """`values` (4,): x, y, radius, decay of a disc; offset, angle, half-width, decay of a strip."""

    values: Array
    covariance: Array
    explained: float
    """Share of the change that the fit explains."""
    window: Window
    """The bins of the fit."""

    @property
    def missed(self) -> float:
        """Share of the change that the fit leaves beyond the noise."""
        change = self.window.change
        total = float(np.square(change - change.mean(axis=0)).sum())
        return max(1 - self.explained - change.size / max(total, 1e-12), 0.0)


@dataclass(frozen=True, eq=False)
class Region:
    """Where the light changed: its middle (2,), and the radius of a disc with its area."""

    middle_mm: Array
    radius_mm: float


@dataclass(frozen=True, eq=False)
class Followed:
    """What one frame hands on to the next; `age` frames ago the patch was searched for anew."""

    patch: ContactPatch
    fit: ShadingFit
    region: Region
    age: int


def settled(before: ContactPatch, after: ContactPatch) -> bool:
    """Whether the bins around the one patch also serve for the other."""
    shift = float(np.linalg.norm(after.centre_mm - before.centre_mm)) / before.size_mm
    return shift < 0.3 and 0.7 < after.size_mm / before.size_mm < 1.15


def start_values(patch: ContactPatch, scale: float, decay: float) -> Array:
    """Start (4,) of a fit from a patch, with its size times `scale`."""
    if patch.kind == "disc":
        return np.array([*patch.centre_mm, scale * patch.size_mm, decay])
    angle = np.deg2rad(patch.angle_deg)
    across = float(patch.centre_mm @ np.array([-np.sin(angle), np.cos(angle)]))
    return np.array([across, angle, scale * patch.size_mm, decay])


def first_starts(patch: ContactPatch) -> list[Array]:
    """Starts from a patch that was found by its outline, which is somewhat too large."""
    return [start_values(patch, scale, decay) for scale, decay in _STARTS]


def continued_starts(last: Array, shift_mm: Array, growth: float, *, strip: bool) -> list[Array]:
    """Starts (4,) near the values of the last frame.

    `shift_mm` (2,) is the motion of the region that changed, `growth` the factor of its size. A rim
    that moved by a tenth of the size is not found from its last position: the fit would take the
    crease for a steep decay.
    """
    here, moved = last.copy(), last.copy()
    if strip:
        moved[0] += shift_mm @ [-np.sin(last[1]), np.cos(last[1])]
    else:
        moved[:2] += shift_mm
    scales = [s * g for g in {1.0, growth} for s in _TRIED_SIZES]
    starts = [place * [1, 1, scale, 1] for place in (here, moved) for scale in scales]
    return starts + [np.array([*s[:3], _TRIED_DECAY]) for s in starts]


def nearest_start(window: Window, starts: list[Array], law: SlopeLaw) -> Array:
    """The start (4,) with the smallest residual on a part of the bins."""
    part = window.thinned(_CONTINUE_BINS)
    residual = np.empty(part.change.shape)
    return min(starts, key=lambda s: _squares(part, s, law, residual))


def settled_start(window: Window, starts: list[Array], law: SlopeLaw) -> Array:
    """The start (4,) with the smallest residual after a few steps on a part of the bins, moved."""
    part = window.thinned(_START_BINS)
    tried = [_optimised(part, start, law, _FIRST_STEPS)[:2] for start in starts]
    return min(tried, key=lambda pair: pair[1])[0]


def fit_shading(window: Window, start: Array, law: SlopeLaw) -> ShadingFit | None:
    """Fit by Gauss-Newton steps with the gains projected out; None where it does not converge."""
    values, cost, residual, jacobian = _optimised(window, start, law, _MOST_STEPS, _SMALL_MOVE)
    total = window.change - window.change.mean(axis=0)
    explained = 1 - cost / max(float((total**2).sum()), 1e-12)
    if not np.isfinite(values).all() or values[2] < 1.5 * window.bin_mm:
        return None
    freedom = max(residual.size - 4 - 7 * residual.shape[1], 1)
    variance = cost / freedom * _correlated_bins(residual, window)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * variance
    return ShadingFit(values, covariance, explained, window)


def fits_better(one: ShadingFit, other: ShadingFit, law: SlopeLaw) -> bool:
    """Whether one fit has a smaller residual than the other on the same bins.

    These are the bins of the wider window: a narrow one contains little of the slope outside.
    """
    window = max(one.window, other.window, key=lambda w: len(w.x_mm))
    residual = np.empty(window.change.shape)
    first, second = (_squares(window, f.values, law, residual) for f in (one, other))
    return first < second


def _squares(window: Window, values: Array, law: SlopeLaw, residual: Array) -> float:
    from gelslim_force.contact.patch_fit_kernel import squares_left

    return float(
        squares_left(
            window.x_mm, window.y_mm, window.parallax, window.change, values, law.strip,
            law.curvature_per_mm, law.blur_mm, residual,
        )
    )  # fmt: skip


def _optimised(
    window: Window, start: Array, law: SlopeLaw, steps: int, small_move: float = 0.0
) -> tuple[Array, float, Array, Array]:
    """Values, sum of squares, residual (n, c) and its derivative (n c, 4)."""
    from gelslim_force.contact.patch_fit_kernel import settle

    values = start.copy()
    residual = np.empty(window.change.shape)
    jacobian = np.zeros((residual.size, 4))
    cost = settle(
        window.x_mm, window.y_mm, window.parallax, window.change, values, law.strip,
        law.curvature_per_mm, law.blur_mm, steps, small_move, residual, jacobian,
    )  # fmt: skip
    return values, float(cost), residual, jacobian


def _correlated_bins(residual: Array, window: Window) -> float:
    """How many bins have a common error, from the correlation of neighbours on the diagonal."""
    power = float((residual**2).mean())
    first, second = window.diagonal
    if power <= 0 or not len(first):
        return 1.0
    diagonal = float((residual[first] * residual[second]).mean()) / power
    # Along a row or column the correlation is larger: its square is that of the diagonal.
    correlation = min(max(diagonal, 0.0), 0.9) ** 0.5
    return min(((1 + correlation) / (1 - correlation)) ** 2, 200.0)
