"""Errors and scores of deep contacts of which nothing is known, by the law of the gel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from deep_contacts import deep_case
from deep_pictures import Light, deep_bundle, deep_calibration, deep_picture
from numpy.typing import NDArray
from pressed_samples import Pressed, reference
from sigma_cases import seen
from sigma_gate import Score, condition_of

from gelslim_force.built_sensor import built_gel
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings

Array = NDArray[np.float64]
LAWS = ("linear", "auto")
LEAST_N = 0.2
"""Normal force from which relative errors count."""


@dataclass(frozen=True)
class DeepScore:
    """Forces of a deep contact against the truth.

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


@cache
def _pipeline(designed_ratio: float, law: str, light: Light) -> ForcePipeline:
    bundle, calibration = deep_bundle(designed_ratio, light), deep_calibration()
    settings = PipelineSettings(gel=law)  # type: ignore[arg-type]
    gel = built_gel(bundle, calibration, None, settings)
    picture, linear = reference().image, JointSettings(gamma=1.0)
    source = unknown_shape(bundle, calibration, picture, gel=law, settings=linear, more=gel.more)
    return ForcePipeline(bundle, calibration, settings, source, gel.share)


def deep_scores(law: str, seeds: Iterable[int], light: Light = "guided") -> tuple[DeepScore, ...]:
    """Of the contacts of some seeds, each in one of the conditions, which take turns."""
    return tuple(_score(law, seed, light) for seed in seeds)


def _score(law: str, seed: int, light: Light) -> DeepScore:
    pipeline = _pipeline(deep_case(seed).designed_ratio, law, light)
    truth = deep_picture(seed, light)
    pipeline.reset()
    return _compared(seed, pipeline.process(seen(truth.image, condition_of(seed), seed)), truth)


def _compared(seed: int, found: FrameResult, truth: Pressed) -> DeepScore:
    true_n = tuple(truth.wrench[:3].tolist())
    if found.wrench is None or not found.normal_known or found.problems or found.field is None:
        return DeepScore(Score(seed, true_n, problem="; ".join(found.problems)))
    off = found.wrench.force_n - truth.wrench[:3]
    sigma = found.wrench.standard_deviation[:3]
    push, points = -truth.force_n[:, 2], found.field.points_mm[:, :2]
    centre = push @ points / push.sum()
    field_off = np.linalg.norm(found.field.force_n - truth.force_n)
    return DeepScore(
        Score(seed, true_n, tuple(off.tolist()), tuple(sigma.tolist())),
        float(off[2] / truth.wrench[2]),
        float(np.hypot(*off[:2]) / -truth.wrench[2]),
        float(np.hypot(*(found.field.centre_of_pressure_mm - centre))),
        float(field_off / np.linalg.norm(truth.force_n)),
    )


def deep_summary(some: Iterable[DeepScore]) -> dict[str, float]:
    """Medians, and the 95th percentile of F_z, of contacts with at least `LEAST_N`."""
    counted = [s for s in some if s.score.error_n and -s.score.true_n[2] >= LEAST_N]
    normal = np.array([s.normal for s in counted])
    return {
        "contacts": len(counted),
        "normal": float(np.median(np.abs(normal))),
        "normal_95": float(np.percentile(np.abs(normal), 95)),
        "bias": float(np.median(normal)),
        "shear": float(np.median([s.shear for s in counted])),
        "centre_mm": float(np.median([s.centre_mm for s in counted])),
        "field": float(np.median([s.field for s in counted])),
    }
