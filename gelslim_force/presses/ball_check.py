"""The size of the ball that presses show, and the refusal of another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gelslim_force.presses.gel_fit import BALL_SIGMA, GelPrior, fit_gel
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_model import PressModel
from gelslim_force.presses.seen_press import PressView

BALL_OFF, BALL_SIGMAS = 0.06, 4.0
"""Difference of the ball's size that refuses presses, relative and in standard deviations."""
_FREE_BALL = 0.3


def fitted_ball(
    view: PressView,
    models: Sequence[PressModel],
    loads: Sequence[Load],
    prior: GelPrior | None = None,
) -> tuple[float, float]:
    """Diameter of the ball in mm, and its relative standard deviation, from markers and patches."""
    free = fit_gel(view, models, loads, replace(prior or GelPrior(), ball_sigma=_FREE_BALL))
    sigma = float(np.hypot(np.sqrt(free.covariance[3, 3]), BALL_SIGMA))
    return 2 * view.ball_mm * float(np.exp(free.log_ball)), sigma


def require_ball(
    view: PressView, models: Sequence[PressModel], loads: Sequence[Load], prior: GelPrior
) -> None:
    """Raise PressError where the markers show a ball of another size than the one named."""
    size, sigma = fitted_ball(view, models, loads, prior)
    off = float(np.log(size / (2 * view.ball_mm)))
    if abs(off) > max(BALL_OFF, BALL_SIGMAS * sigma):
        raise PressError(
            "ball",
            f"these presses fit a ball of {size:.1f} ± {size * sigma:.1f} mm, not one of "
            f"{2 * view.ball_mm:g} mm: measure the ball and give its diameter with --ball-mm",
        )
