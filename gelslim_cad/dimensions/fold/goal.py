"""What makes one fold better than another.

Limits of the view come first, then those of the housing, then the goal: the thinnest finger, the
shortest, the one with the most pixels across a marker, or a weighted sum of the three.
"""

from __future__ import annotations

from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger
from gelslim_optics.camera.refraction_newton import choose

FEASIBLE = 1e-9
"""Limits missed by no more than this count as kept."""
BEYOND_MM, INFEASIBLE_MM = 1e5, 1e6
"""Scores from here on are of candidates that miss limits of the housing, or of the view."""
CLASH_WEIGHT = 1000.0
LENGTH_TIE, USE_TIE_MM, KEYSTONE_TIE_MM = 1e-4, 2e-3, 1e-3
"""What decides among equals, in this order: length, use of the picture, keystone."""


def besides_depth(p: FoldProblem, length_mm: Array, least_px: Array, tie: Array) -> Array:
    """The goal but for the depth, in mm."""
    return (p.length_worth + LENGTH_TIE) * length_mm - p.pixel_worth_mm * least_px + tie


def tie_mm(use: Array, keystone: Array) -> Array:
    """What use of the picture and keystone count among equals."""
    return KEYSTONE_TIE_MM * keystone - USE_TIE_MM * use


def score(p: FoldProblem, missed: Array, beyond: Array, depth: Array, besides: Array) -> Array:
    """What the search makes least.

    Args:
        p: The limits and the goal.
        missed: Sum of the parts by which limits of the view are missed.
        beyond: See `beyond_mm`.
        depth: Below the window, mm.
        besides: The rest of the goal.
    """
    kept = choose(beyond > FEASIBLE, BEYOND_MM + beyond, p.depth_worth * depth + besides)
    return choose(missed > FEASIBLE, INFEASIBLE_MM * (1 + missed), kept)


def beyond_mm(housing_mm: tuple[Array, ...]) -> Array:
    """How far candidates are outside what the housing allows, in mm; 0 where all limits hold.

    Args:
        housing_mm: Missed thickness and length, which a larger envelope would allow, and then
            what is in each other's way, which nothing makes good.
    """
    found = larger(larger(housing_mm[0], housing_mm[1]), 0.0)
    for k in range(2, len(housing_mm)):
        found = larger(found, CLASH_WEIGHT * housing_mm[k])
    return found


SHARED = (besides_depth, tie_mm, score, beyond_mm)
