"""Gains of the light from presses of a ball whose slopes are known.

A press whose place, radius of contact and gel are found gives the slope at every point around it.
The traced law then says how the light should change there, and the gain of each channel is what the
pictures show of it. The gains are fitted to all presses together, with few terms over the gel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light.calibration import TERMS, place_terms
from gelslim_force.joint.light.view import LightView, SeenLight
from gelslim_force.joint.normal_equations import huber
from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_optics.light.light_law import LightLaw

Array = NDArray[np.float64]
_REACH = 1.5
"""Distance beyond the rim, in thicknesses, up to which the light counts."""
_RIM_MM = 0.15
"""Distance from the rim within which the crease is blurred; left out."""
_STEPS = 400
_SETTLE = 8
LEVEL_SIGMA, SLOPE_SIGMA = 0.6, 0.15
"""Standard deviations of a gain's mean and of its other terms, before the presses."""
_ROUNDS = 8
_LIMIT = 3.0
_CELL_MM = 1.0
"""Side of the squares over which what is left is averaged."""


@dataclass(frozen=True, eq=False)
class PressLight:
    """The light around one press in n bins.

    Attributes:
        places_mm: (n, 2) on the gel at rest.
        slope: (n, 2) of the surface under and around the ball.
        change: (c, n) logarithmic change of the light as seen.
        noise: (c, n) its standard deviation; infinite where it cannot be used.
        share: (k, c, n) of each source.
        level: (c, n).
        area_mm2: (n,) of the bins.
        law: Change of light with the slope there, as traced.
    """

    places_mm: Array
    slope: Array
    change: Array
    noise: Array
    share: Array
    level: Array
    area_mm2: Array
    law: LightLaw


def press_light(
    view: LightView, seen: SeenLight, contact: BallOnLayer, place_mm: Array
) -> PressLight:
    """The bins around a press, with the slopes that the ball gives them.

    Args:
        view: The bins of the pictures.
        seen: What the picture shows in them.
        contact: The ball on the gel.
        place_mm: (2,) where it presses.
    """
    reach = contact.contact_mm + _REACH * contact.layer.thickness_mm
    radius = np.linspace(0, reach + 1.0, _STEPS)
    outward, height = contact.motion(radius)
    steep = np.gradient(height, radius)
    rest, lean = view.rest_mm.reshape(-1, 2), view.lean.reshape(-1, 2)
    near = np.flatnonzero(
        seen.shading.valid.ravel() & (np.hypot(*(rest - place_mm).T) < reach + 1.0)
    )
    points = rest[near]
    for _ in range(_SETTLE):
        away, unit = _polar(points - place_mm)
        rise, aside = np.interp(away, radius, height), np.interp(away, radius, outward)
        points = rest[near] + lean[near] * rise[:, None] - unit * aside[:, None]
    away, unit = _polar(points - place_mm)
    kept = (away < reach) & (np.abs(away - contact.contact_mm) > _RIM_MM)
    bins = near[kept]

    def of(layers: NDArray[Any]) -> Array:
        return np.asarray(layers.reshape(*layers.shape[:-2], -1)[..., bins], dtype=float)

    noise = np.where(of(seen.saturated) > 0, np.inf, of(seen.noise))
    return PressLight(
        points[kept],
        (unit * np.interp(away, radius, steep)[:, None])[kept],
        of(seen.log_change),
        noise,
        of(view.share),
        of(view.level),
        of(view.area_mm2),
        view.law.taken(bins),
    )


def _polar(offset: Array) -> tuple[Array, Array]:
    """Length (n,) and direction (n, 2) of offsets (n, 2)."""
    away = np.asarray(np.hypot(*offset.T), dtype=float)
    return away, offset / np.maximum(away, 1e-9)[:, None]


@dataclass(frozen=True, eq=False)
class FittedLight:
    """Gains and what they leave.

    Attributes:
        gain: (c, 6) terms of the gain of each channel.
        covariance: (c, 6, 6).
        light_error: (c,) standard deviation of the mean change over 1 mm² that is left.
        explained: (p, c) share of the change that the gains explain, by press.
        explained_as_traced: (p, c) share that the traced light explains.
        press_gain: (p, c) gain of each press alone over the fitted one.
    """

    gain: Array
    covariance: Array
    light_error: Array
    explained: Array
    explained_as_traced: Array
    press_gain: Array


def fit_light(presses: Sequence[PressLight], middle_mm: Array, half_mm: Array) -> FittedLight:
    """Fit the gains of all channels.

    Args:
        presses: p presses.
        middle_mm: (2,) middle of the gel.
        half_mm: (2,) half its length and width.
    """
    terms = [place_terms((press.places_mm - middle_mm) / half_mm) for press in presses]
    count = presses[0].change.shape[0]
    error = np.full(count, 0.05)
    prior = np.array([LEVEL_SIGMA, *[SLOPE_SIGMA] * (TERMS - 1)]) ** -2.0
    start = np.zeros(TERMS)
    start[0] = 1.0
    gain = np.tile(start, (count, 1))
    covariance = np.zeros((count, TERMS, TERMS))
    for _ in range(_ROUNDS):
        hessian = np.tile(np.diag(prior), (count, 1, 1))
        slope = prior * (start - gain)
        for press, rows in zip(presses, terms, strict=True):
            left, by_gain, weight = _linear(press, np.maximum(gain @ rows.T, 0.1), error)
            for channel in range(count):
                data = rows * by_gain[channel][:, None]
                hessian[channel] += (data * weight[channel][:, None]).T @ data
                slope[channel] += data.T @ (weight[channel] * left[channel])
        covariance = np.asarray(np.linalg.inv(hessian), dtype=float)
        gain = gain + np.einsum("cij,cj->ci", covariance, slope)
        error = np.maximum(_error_per_mm2(presses, terms, gain), 0.005)
    ones = np.zeros_like(gain)
    ones[:, 0] = 1.0
    return FittedLight(
        gain,
        covariance,
        error,
        _explained(presses, terms, gain),
        _explained(presses, terms, ones),
        _press_gains(presses, terms, gain, error),
    )


def _linear(press: PressLight, gain: Array, error: Array) -> tuple[Array, Array, Array]:
    """What is left (c, n) at a gain (c, n), its derivative by the gain, and the weights."""
    model, _, by_gain = press.law.change(press.slope, press.share, press.level, gain)
    left = press.change - model
    sigma = np.hypot(error[:, None] / np.sqrt(press.area_mm2), press.noise)
    usable = np.isfinite(sigma)
    weight = np.where(usable, huber(left, np.where(usable, sigma, 1.0), _LIMIT), 0.0)
    return left, by_gain, weight


def _error_per_mm2(presses: Sequence[PressLight], terms: Sequence[Array], gain: Array) -> Array:
    """(c,) root mean square over squares of 1 mm² of what is left; robust against a bad press."""
    means: list[list[float]] = [[] for _ in gain]
    for press, rows in zip(presses, terms, strict=True):
        model, _, _ = press.law.change(press.slope, press.share, press.level, gain @ rows.T)
        cells = np.floor(press.places_mm / _CELL_MM).astype(int)
        _, cell = np.unique(cells, axis=0, return_inverse=True)
        for channel, left in enumerate(press.change - model):
            usable = np.isfinite(press.noise[channel])
            size = np.bincount(cell.ravel()[usable], minlength=cell.max() + 1)
            sums = np.bincount(cell.ravel()[usable], left[usable], cell.max() + 1)
            full = size > 0.5 * size.max()
            means[channel] += list(sums[full] / size[full])
    return np.array([np.sqrt(np.mean(np.square(values))) for values in means])


def _explained(presses: Sequence[PressLight], terms: Sequence[Array], gain: Array) -> Array:
    """(p, c) share of the squared change that gains (c, 6) explain."""
    found = []
    for press, rows in zip(presses, terms, strict=True):
        model, _, _ = press.law.change(press.slope, press.share, press.level, gain @ rows.T)
        usable = np.isfinite(press.noise)
        size = np.where(usable, press.change, 0.0) ** 2
        left = np.where(usable, press.change - model, 0.0) ** 2
        found.append(1 - left.sum(axis=1) / np.maximum(size.sum(axis=1), 1e-12))
    return np.array(found)


def _press_gains(
    presses: Sequence[PressLight], terms: Sequence[Array], gain: Array, error: Array
) -> Array:
    """(p, c) gain of each press alone over that of the fit there."""
    found = []
    for press, rows in zip(presses, terms, strict=True):
        at = gain @ rows.T
        left, by_gain, weight = _linear(press, at, error)
        by_factor = by_gain * at
        found.append(
            1 + (weight * by_factor * left).sum(axis=1) / (weight * by_factor**2).sum(axis=1)
        )
    return np.array(found)
