"""Motion of a pad under a ball: that of axisymmetric elements, and what the pad's edges add."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pressed_disc import PressedDisc
from pressed_samples import FinePad, surface_splines
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
Motion = Callable[[Array], Array]
"""Places (n, 2) at rest to motions (n, 3)."""


def ball_motion(
    disc: PressedDisc, pad: FinePad, place_mm: Array, push_n: float, young: float = 1.0
) -> Motion:
    """Motion under a ball that pushes.

    Args:
        disc: The ball on an endless layer.
        pad: The pad, whose edges are taken into account under Hertz's pressure.
        place_mm: (2,) middle of the contact.
        push_n: Normal force.
        young: Modulus over that of the pad.
    """
    push = push_n / young
    contact_mm, outward, height = disc.at_force(push / pad.gel.youngs_modulus_mpa)
    share = round_share(pad.points_mm, place_mm, contact_mm)
    edges = through(pad, pad.by_edges(np.outer(share, [0.0, 0.0, -push])))
    out, down = CubicSpline(disc.r_mm, outward), CubicSpline(disc.r_mm, height)

    def motion(places_mm: Array) -> Array:
        away = places_mm - place_mm
        r = np.minimum(np.hypot(*away.T), disc.r_mm[-2])
        lateral = away * (out(r) / np.maximum(r, 1e-9))[:, None]
        return edges(places_mm) + np.column_stack([lateral, down(r)])

    return motion


def round_share(points_mm: Array, place_mm: Array, contact_mm: float) -> Array:
    """(n,) share of Hertz's pressure that each of the nodes (n, 3) takes."""
    away = ((points_mm[:, :2] - place_mm) ** 2).sum(axis=1)
    share = np.sqrt(np.maximum(1 - away / contact_mm**2, 0.0))
    return np.asarray(share / share.sum())


def through(pad: FinePad, moved_mm: Array) -> Motion:
    """The motion whose values at the surface nodes are (n, 3)."""
    splines = surface_splines(pad.points_mm, moved_mm)
    return lambda places: np.column_stack([s.ev(*places.T) for s in splines])
