"""Relaxation of linear viscoelastic gels: a Prony series, and its factors over one time step.

With the modulus G(t) = G(0) g(t), g(t) = 1 - sum of g_i (1 - exp(-t / tau_i)), a quantity that
follows the history of x is x - sum of g_i (x - q_i), with one internal variable per term,
q_i' = x' - q_i / tau_i. For an x that runs straight over a step of length t

    q_i <- exp(-t / tau_i) q_i + (1 - exp(-t / tau_i)) tau_i / t (change of x),

which is exact for any step (Taylor, Pister and Goudreau 1970).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class PronySeries:
    """g(t) = 1 - sum of fractions (1 - exp(-t / times)); no terms: an elastic gel."""

    fractions: tuple[float, ...] = ()
    times_s: tuple[float, ...] = ()

    @property
    def is_null(self) -> bool:
        """Whether nothing decays."""
        return not any(self.fractions)

    def factors(self, step_s: float) -> Iterator[tuple[float, float, float]]:
        """Of each term its fraction, the share of q_i that a step keeps, and that of the change.

        A step of 0 s is a jump.
        """
        for fraction, time_s in zip(self.fractions, self.times_s, strict=True):
            ratio = step_s / time_s
            # (1 - exp(-x)) / x is 1 at 0.
            mean = -math.expm1(-ratio) / ratio if ratio > 0 else 1.0
            yield fraction, math.exp(-ratio), mean
