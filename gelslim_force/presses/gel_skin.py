"""The skin of a built gel: as the design has it, or as presses of a ball tell it.

A skin prevents the motion aside, which the markers show; load and depth for a given patch hardly
change. Where presses are explained without the skin that is there, modulus and thickness make up
for it and come out too high.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.presses.gel_fit import FREE_SKIN_SIGMA, FittedGel, GelPrior, fit_gel
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_model import PressModel, skin_length_mm, skin_parameter
from gelslim_force.presses.seen_press import PressView
from ifem_export.elements.skin import layers_of

Array = NDArray[np.float64]
CONTRADICTS = 3.5
"""Standard deviations by which presses differ from the skin of the design before it is told."""


@dataclass(frozen=True)
class SkinFigure:
    """A membrane stiffness N = E t of coat and fabric together.

    Attributes:
        n_per_mm: The stiffness.
        sigma_n_per_mm: Its standard deviation, that of the modulus included.
    """

    n_per_mm: float
    sigma_n_per_mm: float


def known_skin(view: PressView, ratio_sigma: float = 0.0) -> GelPrior:
    """What is known of a sensor before its presses, the skin as the bundle has it."""
    return GelPrior(ratio_sigma, skin=_designed(view, view.bundle.material.youngs_modulus_mpa))


def free_skin(view: PressView, ratio_sigma: float = 0.0) -> GelPrior:
    """The same, with an unknown skin."""
    return replace(known_skin(view, ratio_sigma), skin_sigma=FREE_SKIN_SIGMA)


def fit_known_skin(
    view: PressView, models: Sequence[PressModel], loads: Sequence[Load], ratio_sigma: float
) -> FittedGel:
    """Fit the gel in the skin of the design, whose stiffness does not change with the modulus."""
    prior = known_skin(view, ratio_sigma)
    found = fit_gel(view, models, loads, prior)
    if prior.skin == 0:
        return found
    skin = _designed(view, float(np.exp(found.log_young)))
    return fit_gel(view, models, loads, replace(prior, skin=skin))


def skin_figure(view: PressView, found: FittedGel) -> SkinFigure:
    """The membrane stiffness that a fit with a free skin found."""
    slopes = skin_slopes(view, found)
    variance = slopes @ found.covariance @ slopes
    return SkinFigure(_stiffness(view, found), float(np.sqrt(variance)))


def skin_slopes(view: PressView, found: FittedGel) -> Array:
    """(5,) derivatives of the membrane stiffness by the parameters of a fit."""
    stiffness = _stiffness(view, found)
    unit = _share(view) * float(np.exp(found.log_young)) * view.thickness_mm
    return np.array([stiffness, 0.0, 0.0, 0.0, stiffness + unit])


def contradiction(found: FittedGel, free: FittedGel) -> float:
    """By how many standard deviations presses differ from the skin that a fit took as known."""
    return float((free.skin - found.skin) / np.sqrt(free.covariance[4, 4]))


def _stiffness(view: PressView, found: FittedGel) -> float:
    plane = skin_length_mm(found.skin, view.thickness_mm) * float(np.exp(found.log_young))
    return _share(view) * plane


def _share(view: PressView) -> float:
    """Membrane stiffness N over plane stiffness N/(1 - ν²), as in the design."""
    skin = layers_of(view.bundle.skin)
    return skin.stiffness_n_per_mm / skin.plane_stiffness_n_per_mm


def _designed(view: PressView, young_mpa: float) -> float:
    skin = view.bundle.skin
    plane = 0.0 if skin is None else skin.plane_stiffness_n_per_mm
    return skin_parameter(plane / young_mpa, view.thickness_mm)
