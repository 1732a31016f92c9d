"""Relative errors of the forces of frames, beside their scores."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sigma_gate import Score

from gelslim_force.forces.frame_result import FrameResult

Array = NDArray[np.float64]
LEAST_N = 0.2
"""Normal force from which relative errors count."""


@dataclass(frozen=True)
class FrameErrors:
    """Forces of a contact against the truth.

    Attributes:
        score: Of the force.
        normal: Error of F_z over F_z.
        shear: Error of the tangential force over F_z.
        centre_mm: Error of the centre of pressure.
        field: Error of the nodal forces, relative in the Euclidean norm.
    """

    score: Score
    normal: float = 0.0
    shear: float = 0.0
    centre_mm: float = 0.0
    field: float = 0.0


def frame_errors(seed: int, found: FrameResult, force_n: Array, scale: float = 1.0) -> FrameErrors:
    """Of a frame.

    Args:
        seed: Of the contact.
        found: The frame.
        force_n: (c, 3) true forces on the nodes of the bundle.
        scale: Modulus of the gel over that which the pipeline has, where it is known.
    """
    true = force_n.sum(axis=0)
    if found.wrench is None or not found.normal_known or found.problems or found.field is None:
        return FrameErrors(Score(seed, tuple(true.tolist()), problem="; ".join(found.problems)))
    off = scale * found.wrench.force_n - true
    sigma = scale * found.wrench.standard_deviation[:3]
    push, points = -force_n[:, 2], found.field.points_mm[:, :2]
    centre = push @ points / push.sum()
    field_off = np.linalg.norm(scale * found.field.force_n - force_n)
    return FrameErrors(
        Score(seed, tuple(true.tolist()), tuple(off.tolist()), tuple(sigma.tolist())),
        float(off[2] / true[2]),
        float(np.hypot(*off[:2]) / -true[2]),
        float(np.hypot(*(found.field.centre_of_pressure_mm - centre))),
        float(field_off / np.linalg.norm(force_n)),
    )


def error_summary(some: Iterable[FrameErrors]) -> dict[str, float]:
    """Of contacts with at least `LEAST_N`: medians, and what else counts of F_z.

    That is the 95th percentile, and the mean of the errors with their sign, with its own standard
    deviation.
    """
    counted = [s for s in some if s.score.error_n and -s.score.true_n[2] >= LEAST_N]
    normal = np.array([s.normal for s in counted])
    return {
        "contacts": len(counted),
        "normal": float(np.median(np.abs(normal))),
        "normal_95": float(np.percentile(np.abs(normal), 95)),
        "bias": float(np.median(normal)),
        "mean": float(normal.mean()),
        "mean_sigma": float(normal.std(ddof=1) / np.sqrt(len(normal))),
        "shear": float(np.median([s.shear for s in counted])),
        "centre_mm": float(np.median([s.centre_mm for s in counted])),
        "field": float(np.median([s.field for s in counted])),
    }
