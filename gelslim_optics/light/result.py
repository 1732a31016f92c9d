"""The result of a trace: flux ledger with intervals, irradiance on the gel's face, uniformity."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light import trace_geometry as column

Array = NDArray[np.float64]
LEAKED, STOPPED, RETURNED = "leaked", "stopped", "returned"
PATCHES = 8


@dataclass(frozen=True)
class Estimate:
    """A mean over independent replicates, its standard error and 95 % interval (Student's t)."""

    value: float
    standard_error: float
    low: float
    high: float


def estimate(replicates: Array) -> Estimate:
    """Estimate from one value per replicate; a single replicate gives an unbounded interval."""
    values = np.asarray(replicates, dtype=float)
    mean = float(np.mean(values))
    if values.size < 2:
        return Estimate(mean, math.inf, -math.inf, math.inf)
    from scipy.special import stdtrit

    error = float(np.std(values, ddof=1)) / math.sqrt(values.size)
    half = float(stdtrit(values.size - 1, 0.975)) * error
    return Estimate(mean, error, mean - half, mean + half)


@dataclass(frozen=True)
class Uniformity:
    """Uniformity of an irradiance map, without the contribution of the rays' noise.

    Attributes:
        min_over_mean: Irradiance of the darkest of 8 x 8 patches over the mean.
        cv: Coefficient of variation, the standard deviation of the bins over their mean.
    """

    min_over_mean: float
    cv: float


@dataclass(frozen=True)
class LightResult:
    """The tallies of a trace; each source emits a flux of 1.

    Attributes:
        colours: Colour of each source.
        shares: Share of each source in the emitted flux.
        edges: Names of the edges of the profile.
        face: Name of the edge whose arriving light is mapped.
        rays: Number of rays.
        tallies: Flux (source, replicate, column); for the columns see `trace_geometry`.
        maps: Flux (source, replicate, nx, ny) that arrives at the face, by bin.
        bin_area_mm2: Area of a bin.
        fans: Flux (source, nx, ny, azimuth, elevation, 3) that arrives, by place and direction, and
            its products with the components along x and y of its tangent d / (d·n).
    """

    colours: tuple[str, ...]
    shares: tuple[float, ...]
    edges: tuple[str, ...]
    face: str
    rays: int
    tallies: Array
    maps: Array
    bin_area_mm2: float
    fans: Array

    def replicates(self, entry: str, colour: str | None = None) -> Array:
        """One value per replicate of an entry of the ledger, as a share of the emitted flux.

        Further entries are `arrived` (at the gel's face, counted again after each reflection
        there) and `entered_gel` (net flux through the bonded face). `colour` selects the sources of
        one colour and their flux. Raises KeyError for an unknown entry.
        """
        extra = {"arrived": column.ARRIVED, "entered_gel": column.ENTERED_GEL}
        places = {**self._columns(), **extra}
        if entry not in places:
            raise KeyError(f"the ledger has no entry {entry!r}; it has {', '.join(places)}")
        return self._sum(colour)[:, places[entry]]

    def ledger(self, colour: str | None = None) -> dict[str, Estimate]:
        """Where the emitted flux went; the values sum to 1.

        `delivered`: absorbed by the coat of the gel's face. `leaked.EDGE`: left the guide, last
        through that edge; `leaked.ends` and `leaked.gel_ends`: through the end faces.
        `stopped.EDGE`: absorbed by a mirror or coat. `returned.EDGE`: left through a foot.
        `foot_reflection` and `missed_foot`: never entered. `absorbed`: in the media. `truncated`:
        weight that was cut off. `lost`: at corners, should be 0. Edges without light are left out.
        For a row at an end of the guide its end face stands for the foot: light that misses the
        cross-section is `missed_foot`, and light that comes back to the LEDs `leaked.ends`.
        """
        sums = self._sum(colour)
        return {
            name: estimate(sums[:, place])
            for name, place in self._columns().items()
            if "." not in name or np.any(sums[:, place])
        }

    def value(self, entry: str, colour: str | None = None) -> float:
        """Mean of a ledger entry."""
        return float(np.mean(self.replicates(entry, colour)))

    def total(self, group: str, colour: str | None = None) -> Estimate:
        """Sum of all entries `group`.EDGE, e.g. leaked; 0 if there are none."""
        sums = self._sum(colour)
        chosen = [c for name, c in self._columns().items() if name.startswith(f"{group}.")]
        return estimate(np.sum(sums[:, chosen], axis=1))

    def ledger_gap(self) -> float:
        """Largest deviation from 1 of the ledger of any source and replicate."""
        places = list(self._columns().values())
        return float(np.max(np.abs(np.sum(self.tallies[:, :, places], axis=2) - 1)))

    def irradiance(self, colour: str | None = None) -> Array:
        """Irradiance (nx, ny) on the gel's face per mm², as a share of the emitted flux."""
        weights = self._weights(colour)
        flux = np.tensordot(weights, self.maps.mean(axis=1), axes=(0, 0))
        return np.asarray(flux / self.bin_area_mm2)

    def uniformity(self, colour: str | None = None) -> Uniformity:
        """Uniformity of the irradiance map; NaN where no light arrives.

        Squares are products of different replicates, whose noise is independent, and the darkest
        patch is measured by the replicates that did not choose it. With a single replicate the
        noise remains.
        """
        maps = np.tensordot(self._weights(colour), self.maps, axes=(0, 0))
        mean = float(np.mean(maps))
        if mean == 0:
            return Uniformity(math.nan, math.nan)
        maps = maps / mean
        excess = _mean_square(maps.reshape(len(maps), -1)) - _mean_square(
            maps.mean(axis=(1, 2))[:, None]
        )
        return Uniformity(_darkest(_patches(maps)), math.sqrt(max(excess, 0.0)))

    def arrived(self, colour: str | None = None) -> Estimate:
        """Flux that reaches the gel's face, counted again after each reflection there."""
        return estimate(self._sum(colour)[:, column.ARRIVED])

    def entered_gel(self, colour: str | None = None) -> Estimate:
        """Net flux through the bonded face into the gel."""
        return estimate(self._sum(colour)[:, column.ENTERED_GEL])

    def elevation_deg(self, colour: str | None = None) -> Estimate:
        """Flux-weighted mean angle between arriving light and the gel's face."""
        return self._per_arrival(colour, column.ELEVATION, np.degrees)

    def slope_sensitivity(
        self, colour: str | None = None, axis: Literal["x", "y"] = "y"
    ) -> Estimate:
        """Relative change of the mean irradiance per unit slope of the face along +y or +x.

        A facet with a small slope h along y changes the irradiance of each ray d by
        -h (d·y)/(d·n); along x likewise.
        """
        place = column.SLOPE if axis == "y" else column.SLOPE_ALONG
        return self._per_arrival(colour, place, lambda value: value)

    def of_colours(self, colours: tuple[str, ...]) -> LightResult:
        """The tallies of the sources of some colours alone, with their share of the flux.

        Raises KeyError for a colour without a source.
        """
        missing = [c for c in colours if c not in self.colours]
        if missing or not colours:
            raise KeyError(f"no light source has the colour {', '.join(missing) or '(none)'}")
        chosen = [i for i, c in enumerate(self.colours) if c in colours]
        whole = sum(self.shares[i] for i in chosen)
        return replace(
            self,
            colours=tuple(self.colours[i] for i in chosen),
            shares=tuple(self.shares[i] / whole for i in chosen),
            rays=self.rays * len(chosen) // len(self.colours),
            tallies=self.tallies[chosen],
            maps=self.maps[chosen],
            fans=self.fans[chosen],
        )

    @property
    def crossings(self) -> float:
        """Number of faces met, per ray."""
        return float(np.mean(self.tallies[:, :, column.CROSSINGS]))

    @property
    def corners(self) -> float:
        """Share of rays that rounding moved past a corner and that were continued from it."""
        return float(np.mean(self.tallies[:, :, column.CORNERS]))

    def _per_arrival(
        self, colour: str | None, place: int, turn: Callable[[Array], Array]
    ) -> Estimate:
        sums = self._sum(colour)
        arrived = sums[:, column.ARRIVED]
        if np.any(arrived == 0):
            return Estimate(math.nan, math.nan, math.nan, math.nan)
        return estimate(turn(sums[:, place] / arrived))

    def _weights(self, colour: str | None) -> Array:
        chosen = np.array([colour is None or c == colour for c in self.colours])
        if not np.any(chosen):
            raise KeyError(
                f"no light source has the colour {colour}; there are {', '.join(set(self.colours))}"
            )
        weights = np.where(chosen, np.asarray(self.shares), 0.0)
        return np.asarray(weights / np.sum(weights))

    def _sum(self, colour: str | None) -> Array:
        return np.asarray(np.tensordot(self._weights(colour), self.tallies, axes=(0, 0)))

    def _columns(self) -> dict[str, int]:
        places = {
            "absorbed": column.ABSORBED,
            "missed_foot": column.MISSED,
            "foot_reflection": column.FOOT_REFLECTION,
            "truncated": column.TRUNCATED,
            "lost": column.LOST,
            "leaked.ends": column.ENDS,
            "leaked.gel_ends": column.GEL_ENDS,
            "stopped.ends": column.ENDS_STOPPED,
        }
        groups = {}
        for group, name in enumerate((LEAKED, STOPPED, RETURNED)):
            for i, edge in enumerate(self.edges):
                groups[f"{name}.{edge}"] = column.PER_EDGE + group * len(self.edges) + i
        delivered = groups.pop(f"{STOPPED}.{self.face}", None)
        first = {} if delivered is None else {"delivered": delivered}
        return {**first, **places, **groups}


def paired_ratio(ours: LightResult, other: LightResult, entry: str = "delivered") -> Estimate:
    """Ratio of an entry in two traces of equal seed, rays and replicates, paired by replicate.

    Raises ValueError where the replicates do not match or the entry of `other` is 0.
    """
    a, b = ours.replicates(entry), other.replicates(entry)
    if a.size != b.size:
        raise ValueError(f"{a.size} and {b.size} replicates cannot be paired")
    if float(np.mean(b)) == 0:
        raise ValueError(f"the ratio of {entry} is undefined: the other design has none")
    ratio = float(np.mean(a) / np.mean(b))
    # Linearised (delta method): a mean of ratios would be biased.
    spread = estimate(ratio + (a - ratio * b) / float(np.mean(b)))
    return Estimate(ratio, spread.standard_error, spread.low, spread.high)


def _mean_square(maps: Array) -> float:
    """Mean over bins of the squared expectation, unbiased, from maps (replicate, bin)."""
    count = len(maps)
    if count < 2:
        return float(np.mean(maps**2))
    products = maps.sum(axis=0) ** 2 - (maps**2).sum(axis=0)
    return float(np.mean(products)) / (count * (count - 1))


def _darkest(maps: Array) -> float:
    """Mean of the value of each replicate where the others are darkest, maps (replicate, bin)."""
    if len(maps) < 2:
        return float(np.min(maps))
    others = maps.sum(axis=0) - maps
    return float(np.mean(maps[np.arange(len(maps)), np.argmin(others, axis=1)]))


def _patches(maps: Array) -> Array:
    """Maps (replicate, x, y) as means over PATCHES x PATCHES patches, (replicate, patch)."""
    for axis in (1, 2):
        parts = np.array_split(maps, min(PATCHES, maps.shape[axis]), axis=axis)
        maps = np.stack([part.mean(axis=axis) for part in parts], axis=axis)
    return np.asarray(maps.reshape(len(maps), -1))
