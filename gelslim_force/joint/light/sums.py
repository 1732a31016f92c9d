"""The change of light near a contact: bins at their places, and sums over them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light.view import LightView, SeenLight
from gelslim_force.joint.node_lattice import NodeLattice, SlopeTaps
from gelslim_optics.light.light_law import SCATTERED, LightLaw

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_LIMIT = 10.0
"""Standard deviations beyond which light counts linearly."""
_GAINS = 0.3, 3.0
_SHADED = 0.2
"""Standard deviation of the mean over 1 mm² of what a shadow takes, over it: its edge moves."""


@dataclass(frozen=True, eq=False)
class LightSums:
    """Weighted least squares of the light by changes of m heights and of the gain.

    The residual r of a datum depends on the changes h of the heights and γ of the gain as
    r - a·h - d γ; the weight is w.

    Attributes:
        nodes: (m,) nodes whose heights matter.
        matrix: (m, m) sum of w a aᵀ.
        pull: (m,) of w a r.
        mixed: (m,) of w a d.
        by_gain: Of w d d.
        gain_pull: Of w d r.
        left: Of w r r.
        seen: Of w times the square of the change that was seen.
        by_noise: Of w times the square of the noise that bins do not have in common.
        gain: The present gain.
    """

    nodes: Nodes
    matrix: Array
    pull: Array
    mixed: Array
    by_gain: float
    gain_pull: float
    left: float
    seen: float
    by_noise: float
    gain: float

    def gain_after(self, height_mm: Array, sigma: float) -> float:
        """The gain that fits best after the heights changed by (m,), with a prior about 1."""
        own = self.by_gain + sigma**-2
        pull = self.gain_pull - float(self.mixed @ height_mm) + (1 - self.gain) / sigma**2
        return min(max(self.gain + pull / own, _GAINS[0]), _GAINS[1])

    def unexplained(self, height_mm: Array) -> float:
        """Share of the change of light that is left after the heights changed by (m,).

        What independent noise adds to both is taken off. Noise that neighbours have in common
        cannot be told from a change.
        """
        left = self.left - float((2 * self.pull - self.matrix @ height_mm) @ height_mm)
        change = self.seen - self.by_noise
        return min(max(left - self.by_noise, 0.0) / change, 1.0) if change > 0 else 0.0


@dataclass(frozen=True, eq=False)
class PlacedBins:
    """Bins (n,) of a frame, at their places on the gel at rest.

    Attributes:
        taps: Slopes there by the heights of the nodes.
        change: (c, n) of the light.
        noise: (c, n).
        saturated: (c, n).
        share: (k, c, n) of each source.
        level: (c, n).
        area_mm2: (n,).
        law: Change of light with the slope, at all bins of the picture or everywhere.
        places: (n,) numbers of the bins in the picture; None where they are all.
        built: Gain of the light as calibrated, (c, n) or one number.
        independent: Share of the noise that neighbouring bins do not have in common.
        relief: (k, n) direct light over that of the slopes alone; None where heights do not matter.
        slope: (n, 2) present slopes of a finer surface; None for those of the taps. Their
            derivative is that of the taps in any case.
    """

    taps: SlopeTaps
    change: Array
    noise: Array
    saturated: Mask
    share: Array
    level: Array
    area_mm2: Array
    law: LightLaw
    places: Nodes | None = None
    built: Array | float = 1.0
    independent: float = 1.0
    relief: Array | None = None
    slope: Array | None = None

    def sums(self, height_mm: Array, gain: float, light_error: float) -> LightSums:
        """Sums over the data, linear about the present heights.

        Args:
            height_mm: (c,) present heights of all nodes.
            gain: Present gain of the light.
            light_error: Standard deviation of the mean change over 1 mm².
        """
        from gelslim_force.joint.kernels.light_kernel import light_data, number_nodes, slope_sums

        slope = self.taps.slopes(height_mm) if self.slope is None else self.slope
        shape = self.change.shape
        by_slope, scalars = np.empty((*shape, 2)), np.zeros(5)
        by_gain, residual, weight = np.empty((3, *shape))
        relief = np.empty((0, 0)) if self.relief is None else self.relief
        light_data(
            *self.law.irradiance(slope, self.places), self.change, self.noise, self.saturated,
            self.share, self.level, gain * np.broadcast_to(self.built, shape), gain, relief,
            self.area_mm2, (self.law.gamma, SCATTERED), (light_error, _SHADED, _LIMIT),
            by_slope, by_gain, residual, weight, scalars,
        )  # fmt: skip
        number = np.full(len(height_mm), -1, dtype=np.intp)
        count = number_nodes(self.taps.nodes, number)
        nodes = np.flatnonzero(number >= 0)
        matrix, pull, mixed = (np.zeros((count,) * rank) for rank in (2, 1, 1))
        slope_sums(
            self.taps.nodes, number, self.taps.along, self.taps.across,
            by_slope, by_gain, residual, weight, matrix, pull, mixed,
        )  # fmt: skip
        gain_square, gain_pull, left, seen, by_noise = map(float, scalars)
        return LightSums(
            nodes,
            matrix,
            pull,
            mixed,
            gain_square,
            gain_pull,
            left,
            seen,
            self.independent * by_noise,
            gain,
        )


def placed_bins(
    view: LightView,
    seen: SeenLight,
    lattice: NodeLattice,
    displacement_mm: Array,
    near: Mask,
    relief: Array | None = None,
    finer: tuple[NodeLattice, Array] | None = None,
    close: Mask | None = None,
) -> PlacedBins:
    """The valid bins of a frame among the nodes `near` (c,), with the `relief` (c, k) of the nodes.

    `finer` is a finer lattice with the heights (f,) of its places, from which present slopes come.
    Their derivatives are those by the heights of the nodes; or, about the nodes `close` (c,) if
    they are given, by those of all places, and elsewhere by those of every other place.

    The line of sight of a bin meets the surface where it is now; the motion (c, 3) of the nodes
    leads from there to the place at rest. Slopes are those of the deformed surface.
    """
    bins, places = _at_rest(view, seen, lattice, displacement_mm, near)

    def of(layers: Any) -> Any:
        return np.take(layers.reshape(*layers.shape[:-2], -1), bins, axis=-1)

    taps, slope = lattice.slopes_at(places, view.blur_mm), None
    turn = taps.turn(displacement_mm[:, :2])
    if finer is not None and close is not None:
        taps = finer[0].slopes_about(places, lattice.picture(close), view.blur_mm)
    elif finer is not None:
        blurred = finer[0].slopes_at(places, view.blur_mm).slopes(finer[1])
        slope = np.einsum("nij,nj->ni", turn, blurred)
    taps = taps.turned(turn)
    return PlacedBins(
        taps,
        of(seen.log_change),
        of(seen.noise),
        of(seen.saturated),
        of(view.share),
        of(view.level),
        of(view.area_mm2),
        view.law,
        bins,
        of(view.gain),
        seen.independent,
        None if relief is None else lattice.values_at(relief, places).T,
        slope,
    )


def _at_rest(
    view: LightView, seen: SeenLight, lattice: NodeLattice, displacement_mm: Array, near: Mask
) -> tuple[Nodes, Array]:
    """The valid bins among the nodes `near` (c,), and their places (n, 2) on the gel at rest."""
    from gelslim_force.joint.kernels.place_kernel import bins_at_rest

    valid, rest = seen.shading.valid.ravel(), view.rest_mm.reshape(-1, 2)
    bins, places = np.empty(len(valid), dtype=np.intp), np.empty((len(valid), 2))
    count = bins_at_rest(
        valid, lattice.widened(near, 1), view.nearest, rest, view.lean.reshape(-1, 2),
        displacement_mm, near, (lattice.origin_mm, lattice.step_mm, lattice.number), bins, places,
    )  # fmt: skip
    return bins[:count], places[:count]
