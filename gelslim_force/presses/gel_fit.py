"""Young's modulus and thickness of a built gel from presses of a ball under known loads.

One fit explains all presses: their loads, the sizes of their patches and the motion of the markers
in the picture. Free are Young's modulus, thickness, Poisson's ratio and skin of the gel within what
the design knows, and of each press its radius of contact, place and friction. For one thickness the
patch gives the depth, and the load then gives the modulus; presses of different size separate
both, because the force of a thin layer grows faster with the patch than that of a thick one. The
markers show the depth and the motion beside the ball, which tell the thickness without a load. A
skin shows in the markers too: it prevents the motion aside, the more the smaller the patch, and
hardly changes load and depth.

The errors that all presses have in common, such as that of the law by which the patch is found,
are parameters of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.light_baseline import ROBUST
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_model import LOCAL, PressModel
from gelslim_force.presses.press_rows import (
    BALL,
    COMMON,
    RATIO,
    SIZE,
    SKIN,
    YOUNG,
    PressRows,
    PressState,
    Scatter,
    marker_sigma_px,
    press_rows,
    seen_patch,
)
from gelslim_force.presses.seen_press import PressView

Array = NDArray[np.float64]
_YOUNG_SIGMA, _THICKNESS_SIGMA = 1.0, 0.2
"""Of the logarithms, before the presses: they hardly matter."""
FREE_RATIO_SIGMA = 0.03
FREE_SKIN_SIGMA = 2.0
"""Of `press_model.skin_parameter`: skins up to some fifty times as stiff as the gel."""
_KNOWN = 1e-9
"""Standard deviation of what is known."""
BALL_SIGMA = 0.002
"""Relative standard deviation of the diameter of a bearing ball, with its measurement."""
_SIZE_SIGMA = 0.01
"""Relative error that the sizes of all patches have in common: the law that finds them."""
_LARGEST_RATIO = 0.4995
_LARGEST_STEP, _MOST_ROUNDS, _SETTLED = 0.3, 20, 1e-4
_WIDEST = 0.97
"""Largest radius of contact over that of the ball."""


@dataclass(frozen=True)
class GelPrior:
    """What is known before the presses.

    Attributes:
        ratio_sigma: Standard deviation of Poisson's ratio; 0 takes the design's value.
        ball_sigma: Relative standard deviation of the diameter of the ball.
        skin: The skin, as in `press_model.skin_parameter`.
        skin_sigma: Standard deviation of it; 0 takes it as known.
    """

    ratio_sigma: float = 0.0
    ball_sigma: float = BALL_SIGMA
    skin: float = 0.0
    skin_sigma: float = 0.0


@dataclass(frozen=True, eq=False)
class FittedPress:
    """One press after the fit.

    Attributes:
        load: As given.
        force_n: Force that the fitted gel gives at this press.
        contact_mm: Radius of contact.
        depth_mm: Depth of the ball.
        place_mm: (2,) on the gel.
        seen_mm: Radius of the patch as seen.
        size_error: Seen over expected radius of the patch, less 1.
        marker_rms_px: What the markers leave unexplained.
        marker_noise_px: What was allowed for.
    """

    load: Load
    force_n: float
    contact_mm: float
    depth_mm: float
    place_mm: Array
    seen_mm: float
    size_error: float
    marker_rms_px: float
    marker_noise_px: float

    @property
    def residual(self) -> float:
        """Load over fitted force, less 1."""
        return self.load.load_n / self.force_n - 1


@dataclass(frozen=True, eq=False)
class FittedGel:
    """The gel after the fit.

    Attributes:
        log_young: ln of Young's modulus in MPa.
        log_thickness: ln of the thickness over that of the design.
        poissons_ratio: Poisson's ratio.
        log_ball: ln of the ball's radius over the given one.
        skin: The skin, as in `press_model.skin_parameter`.
        covariance: (5, 5) of these.
        load_scatter: Factor by which the loads scatter more than stated; at least 1.
        marker_scatter: The same for the markers.
        presses: The presses.
    """

    log_young: float
    log_thickness: float
    poissons_ratio: float
    log_ball: float
    skin: float
    covariance: Array
    load_scatter: float
    marker_scatter: float
    presses: tuple[FittedPress, ...]


def fit_gel(
    view: PressView, models: Sequence[PressModel], loads: Sequence[Load], prior: GelPrior
) -> FittedGel:
    """Fit gel and presses.

    Args:
        view: The sensor.
        models: Its n presses.
        loads: (n,) their loads, all above 0.
        prior: What is known beforehand.

    Returns:
        The gel, with the covariance of its parameters. Where loads or markers scatter more than
        stated, their deviations are enlarged to what they show.
    """
    fit = _Fit(view, tuple(models), tuple(loads), prior)
    state = fit.solved(fit.start())
    wider = replace(fit, scatter=fit.found_scatter(state))
    return _as_found(wider, wider.solved(state))


@dataclass(frozen=True, eq=False)
class _State:
    common: Array
    own: tuple[PressState, ...]
    covariance: Array


@dataclass(frozen=True, eq=False)
class _Fit:
    view: PressView
    models: tuple[PressModel, ...]
    loads: tuple[Load, ...]
    prior: GelPrior
    scatter: Scatter = field(default_factory=Scatter)

    def start(self) -> _State:
        """Unknowns from the patches as seen, and the modulus that the loads then give."""
        common = np.zeros(COMMON)
        common[RATIO] = self.view.bundle.material.poissons_ratio
        common[SKIN] = self.prior.skin
        own = tuple(PressState(m.start(), np.zeros(m.friction_px.shape[-1])) for m in self.models)
        force = [
            model.expected(common[1:SIZE], press.local, press.friction).log_force
            for model, press in zip(self.models, own, strict=True)
        ]
        common[YOUNG] = np.median(np.log([load.load_n for load in self.loads]) - np.array(force))
        return _State(common, own, np.eye(COMMON))

    def sigma_before(self) -> Array:
        """(6,) standard deviations of the common unknowns before the presses."""
        prior = self.prior
        ratio, skin = max(prior.ratio_sigma, _KNOWN), max(prior.skin_sigma, _KNOWN)
        known = [_YOUNG_SIGMA, _THICKNESS_SIGMA, ratio, prior.ball_sigma, skin, _SIZE_SIGMA]
        return np.array(known)

    def rows(self, state: _State) -> list[PressRows]:
        """The data of all presses."""
        return [
            press_rows(self.view, model, load, state.common, own, self.scatter)
            for model, load, own in zip(self.models, self.loads, state.own, strict=True)
        ]

    def found_scatter(self, state: _State) -> Scatter:
        """By how much loads, sizes and markers scatter more than stated; robust, at least 1."""
        rows = self.rows(state)
        heads = np.concatenate([r.heads[:2] for r in rows])
        freedom = np.sqrt(len(rows) / max(len(rows) - 2, 1))
        load = ROBUST * float(np.median(np.abs(heads))) * freedom
        markers = np.concatenate([r.markers.ravel() for r in rows])
        return Scatter(max(1.0, load), max(1.0, float(np.sqrt(np.mean(markers**2)))))

    def solved(self, state: _State) -> _State:
        """Gauss-Newton steps; what belongs to one press alone is eliminated.

        Raises PressError where the presses contradict the model so much that there is no solution.
        """
        before = self.start().common
        for _ in range(_MOST_ROUNDS):
            weight = self.sigma_before() ** -2.0
            hessian, slope = np.diag(weight), weight * (before - state.common)
            parts = []
            for rows in self.rows(state):
                own = rows.by_own.T @ rows.by_own
                mixed = rows.by_own.T @ rows.by_common
                pull = rows.by_own.T @ rows.residual
                eliminated = np.linalg.solve(own, np.column_stack([mixed, pull]))
                hessian += rows.by_common.T @ rows.by_common - mixed.T @ eliminated[:, :-1]
                slope += rows.by_common.T @ rows.residual - mixed.T @ eliminated[:, -1]
                parts.append(eliminated)
            step = _step(hessian, slope, -float(state.common[SKIN]))
            if not np.isfinite(step).all():
                raise PressError(
                    "ball", "no gel explains these presses: check ball, loads and reference picture"
                )
            step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
            state = self._moved(state, step, [e[:, -1] - e[:, :-1] @ step for e in parts],
                                np.asarray(np.linalg.inv(hessian), dtype=float))  # fmt: skip
            if np.abs(step).max() < _SETTLED:
                break
        return state

    def _moved(
        self, state: _State, step: Array, own_steps: list[Array], covariance: Array
    ) -> _State:
        common = state.common + step
        common[RATIO] = min(common[RATIO], _LARGEST_RATIO)
        most = np.log(_WIDEST * self.view.ball_mm) + common[BALL]
        own = []
        for press, change in zip(state.own, own_steps, strict=True):
            local = press.local + np.clip(change[:LOCAL], -_LARGEST_STEP, _LARGEST_STEP)
            local[0] = min(local[0], most)
            own.append(PressState(local, press.friction + change[LOCAL:]))
        return _State(common, tuple(own), covariance)


def _step(hessian: Array, slope: Array, least_skin: float) -> Array:
    """Solution (6,) of the normal equations whose step of the skin is not below `least_skin`."""
    step = np.asarray(np.linalg.solve(hessian, slope), dtype=float)
    if not step[SKIN] < least_skin:
        return step
    free = np.delete(np.arange(COMMON), SKIN)
    step[SKIN] = least_skin
    others = slope[free] - hessian[free, SKIN] * least_skin
    step[free] = np.linalg.solve(hessian[np.ix_(free, free)], others)
    return step


def _as_found(fit: _Fit, state: _State) -> FittedGel:
    presses = []
    for model, load, own in zip(fit.models, fit.loads, state.own, strict=True):
        found = model.expected(state.common[1:SIZE], own.local, own.friction)
        patch = seen_patch(fit.view, model, found)
        left = model.moved_px(fit.view.markers) - found.markers_px
        presses.append(
            FittedPress(
                load,
                float(np.exp(found.log_force + state.common[YOUNG])),
                float(np.exp(own.local[0])),
                found.depth_mm,
                own.local[1:].copy(),
                patch.size_mm,
                patch.size_mm / found.rim_mm - 1,
                float(np.sqrt(np.mean(left**2))),
                float(np.sqrt(np.mean(marker_sigma_px(fit.view, model) ** 2))),
            )
        )
    young, thickness, ratio, ball, skin, _ = (float(v) for v in state.common)
    return FittedGel(
        young, thickness, ratio, ball, skin, state.covariance[:SIZE, :SIZE], fit.scatter.load,
        fit.scatter.marker, tuple(presses),
    )  # fmt: skip
