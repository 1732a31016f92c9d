"""The change of light near a contact as linear data for the heights of the nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.joint.light_view import LightView, SeenLight
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.normal_equations import huber
from gelslim_optics.light.light_law import LightLaw

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_LIMIT = 10.0
"""Standard deviations beyond which light counts linearly."""
_WHOLLY = 0.999
_GAINS = 0.3, 3.0


@dataclass(frozen=True, eq=False)
class LightRows:
    """Data (n,) of all channels: values = slopes heights f + by_gain γ.

    Attributes:
        slopes: (n, m) derivative by the heights of m nodes.
        heights: (m, 3p) heights under forces (3p,).
        values: (n,).
        weight: (n,).
        by_gain: (n,) derivative by the gain.
        data: (n,) change of light that was seen.
        gain_now: Gain at which this is linear.
    """

    slopes: sparse.csr_array
    heights: Array
    values: Array
    weight: Array
    by_gain: Array
    data: Array
    gain_now: float

    def gain(self, force: Array, sigma: float) -> float:
        """The gain that fits forces (3p,) best, with a prior about 1."""
        own = float(self.weight @ self.by_gain**2) + sigma**-2
        pull = float(self.weight @ (self.by_gain * self._left(force)))
        pull += (1 - self.gain_now) / sigma**2
        return float(np.clip(self.gain_now + pull / own, *_GAINS))

    def unexplained(self, force: Array) -> float:
        """Share of the change of light that forces (3p,) leave."""
        size = float(self.weight @ self.data**2)
        left = float(self.weight @ self._left(force) ** 2)
        return left / size if size > 0 else 0.0

    def _left(self, force: Array) -> Array:
        return self.values - self.slopes @ (self.heights @ force)


@dataclass(frozen=True, eq=False)
class PlacedBins:
    """Bins (n,) of a frame, at their places on the gel at rest.

    Attributes:
        along: (n, m) from the heights of `nodes` to slopes along x.
        across: (n, m) along y.
        nodes: (m,) nodes whose heights matter.
        change: (c, n) of the light.
        noise: (c, n).
        saturated: (c, n).
        share: (k, c, n) of each source.
        level: (c, n).
        area_mm2: (n,).
    """

    along: sparse.csr_array
    across: sparse.csr_array
    nodes: Nodes
    change: Array
    noise: Array
    saturated: Mask
    share: Array
    level: Array
    area_mm2: Array

    def linearised(
        self,
        law: LightLaw,
        heights: Array,
        by_forces_mm: Array,
        height_mm: Array,
        gain: float,
        light_error: float,
    ) -> LightRows:
        """The data, linear about the present heights.

        Args:
            law: Change of light with the slope.
            heights: (m, 3p) heights of `nodes` under forces.
            by_forces_mm: (m,) their heights under the present forces.
            height_mm: (c,) present heights of all nodes, which a strained gel changes further.
            gain: Present gain of the light.
            light_error: Standard deviation of the mean change over 1 mm².
        """
        slope = np.column_stack([m @ height_mm[self.nodes] for m in (self.along, self.across)])
        model, by_slope, by_gain = law.change(slope, self.share, self.level, gain)
        residual = self.change - model
        sigma = np.hypot(light_error / np.sqrt(self.area_mm2), self.noise)
        weight = huber(residual, sigma, _LIMIT)
        # A model that is brighter than what saturates agrees with it.
        weight[self.saturated & (residual < 0)] = 0.0
        slopes = sparse.csr_array(
            sparse.vstack(
                [
                    sparse.diags_array(steep[:, 0]) @ self.along
                    + sparse.diags_array(steep[:, 1]) @ self.across
                    for steep in by_slope
                ]
            )
        )
        return LightRows(
            slopes,
            heights,
            residual.ravel() + slopes @ by_forces_mm,
            weight.ravel(),
            by_gain.ravel(),
            self.change.ravel(),
            gain,
        )


def placed_bins(
    view: LightView, seen: SeenLight, lattice: NodeLattice, displacement_mm: Array, near: Mask
) -> PlacedBins:
    """The valid bins of a frame among the nodes `near` (c,).

    The line of sight of a bin meets the surface where it is now; the motion (c, 3) of the nodes
    leads from there to the place at rest.
    """
    bins = np.flatnonzero(seen.shading.valid)
    rest = view.rest_mm.reshape(-1, 2)[bins]
    moved = lattice.values_at(displacement_mm, rest)
    places = rest + view.lean.reshape(-1, 2)[bins] * moved[:, 2:] - moved[:, :2]
    kept = lattice.on(places) & (lattice.values_at(near.astype(float), places) > _WHOLLY)
    bins, places = bins[kept], places[kept]
    along, across = lattice.slopes_at(places)
    nodes = np.unique(np.concatenate([along.indices, across.indices]))

    def of(layers: Any) -> Any:
        return layers.reshape(*layers.shape[:-2], -1)[..., bins]

    return PlacedBins(
        along[:, nodes],
        across[:, nodes],
        nodes,
        of(seen.log_change),
        of(seen.noise),
        of(seen.saturated),
        of(view.share),
        of(view.level),
        of(view.area_mm2),
    )
