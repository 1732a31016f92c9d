"""Errors and scores of deep contacts of which nothing is known, by the law of the gel."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

from deep_contacts import deep_case
from deep_pictures import Light, deep_bundle, deep_calibration, deep_picture
from frame_errors import FrameErrors, frame_errors
from pressed_samples import reference
from sigma_cases import seen
from sigma_gate import condition_of

from gelslim_force.built_sensor import built_gel
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings

LAWS = ("linear", "auto")


@cache
def _pipeline(designed_ratio: float, law: str, light: Light) -> ForcePipeline:
    bundle, calibration = deep_bundle(designed_ratio, light), deep_calibration()
    settings = PipelineSettings(gel=law)  # type: ignore[arg-type]
    gel = built_gel(bundle, calibration, None, settings)
    picture, linear = reference().image, JointSettings(gamma=1.0)
    source = unknown_shape(bundle, calibration, picture, gel=law, settings=linear, more=gel.more)
    return ForcePipeline(bundle, calibration, settings, source, gel.share)


def deep_scores(law: str, seeds: Iterable[int], light: Light = "guided") -> tuple[FrameErrors, ...]:
    """Of the contacts of some seeds, each in one of the conditions, which take turns."""
    return tuple(_score(law, seed, light) for seed in seeds)


def _score(law: str, seed: int, light: Light) -> FrameErrors:
    pipeline = _pipeline(deep_case(seed).designed_ratio, law, light)
    truth = deep_picture(seed, light)
    pipeline.reset()
    found = pipeline.process(seen(truth.image, condition_of(seed), seed))
    return frame_errors(seed, found, truth.force_n)
