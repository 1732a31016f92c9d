"""Errors and scores of deep contacts of which nothing is known, by the law of the gel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
from deep_contacts import deep_case
from deep_pictures import Light, deep_bundle, deep_calibration, deep_picture
from frame_errors import FrameErrors, frame_errors
from pressed_samples import reference
from sigma_cases import seen
from sigma_gate import condition_of

from gelslim_force.built_sensor import built_gel
from gelslim_force.joint.fit_state import GelMotion
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.joint.strained_gel import Excess
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from gelslim_force.tracking.marker_noise import noise_px as marker_noise

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


def after_a_weaker_contact(seed: int) -> float:
    """Largest change of a force, in standard deviations, where the frame before had less of it.

    The contact of the frame before has eight tenths of the forces and of the motion.
    """
    pipeline = _pipeline(deep_case(seed).designed_ratio, "auto", "guided")
    image, source = deep_picture(seed).image, pipeline.normal
    assert isinstance(source, UnknownShape)
    pipeline.reset()
    alone = pipeline.process(image)
    assert alone.wrench is not None
    assert alone.tracks is not None
    estimator, markers_px = source.estimator, alone.tracks.positions_px
    noise_px = marker_noise(source.reference, markers_px - source.reference.positions_px)
    frame = estimator.frame(image, markers_px, noise_px)
    found = estimator.estimate(frame)
    assert found is not None
    motion, share = found.motion, 0.8
    excess = Excess(share * motion.excess.moved_mm, motion.excess.pad)
    weaker = replace(
        found,
        force_n=share * found.force_n,
        displacement_mm=share * found.displacement_mm,
        motion=GelMotion(motion.responses, motion.nodes, share * motion.force_n, excess),
    )
    after = estimator.estimate(frame, weaker)
    assert after is not None
    change = (after.force_n - found.force_n).sum(axis=0)
    return float(np.max(np.abs(change) / alone.wrench.standard_deviation[:3]))


def _score(law: str, seed: int, light: Light) -> FrameErrors:
    pipeline = _pipeline(deep_case(seed).designed_ratio, law, light)
    truth = deep_picture(seed, light)
    pipeline.reset()
    found = pipeline.process(seen(truth.image, condition_of(seed), seed))
    return frame_errors(seed, found, truth.force_n)
