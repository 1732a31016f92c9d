"""Errors of presses of at least 0.2 N of which nothing is given, on sensors known more or less."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
from frame_errors import LEAST_N, FrameErrors, frame_errors
from pressed_samples import calibration, fine_pad, light_map, lit_bundle, reference
from sigma_cases import MadeGel, press_load, seen, specified_bundle, strong_presses
from sigma_gate import condition_of, kept_contact, linear_gel

from gelslim_force.joint.light.calibration import TERMS, LightCalibration
from gelslim_force.joint.light.view import source_channels
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.presses.gel_share import GelShare
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import lumped

LIGHT_SIGMA = 0.05
"""Deviation of the gain that a calibration leaves; `calibrate-light` gives 2 to 8 %."""
_NOTHING_ELSE = 1e-6
"""Light that the gains leave unexplained: none."""
_MODE = "nothing given"


@dataclass(frozen=True)
class Knowledge:
    """What is known of a sensor beside its design.

    Attributes:
        gel: Its gel, as `calibrate-gel` would find it without an error; else within its tolerances.
        light: The gain of its light up to `LIGHT_SIGMA`; else within 20 %.
    """

    gel: bool
    light: bool


KNOWLEDGE = {
    "gel and light within their tolerances": Knowledge(gel=False, light=False),
    "light calibrated": Knowledge(gel=False, light=True),
    "gel known": Knowledge(gel=True, light=False),
    "gel known, light calibrated": Knowledge(gel=True, light=True),
}


def press_seeds(number: int) -> list[int]:
    """The first seeds of presses with at least `LEAST_N`."""
    return list(islice(strong_presses(0, LEAST_N), number))


def press_errors(known: str, seeds: Iterable[int], stored: Path | None = None) -> list[FrameErrors]:
    """Of presses, each in one of the conditions, which take turns.

    Args:
        known: One of `KNOWLEDGE`.
        seeds: Of the presses.
        stored: Folder for the contacts.
    """
    return [_errors(KNOWLEDGE[known], seed, stored) for seed in seeds]


def _errors(known: Knowledge, seed: int, stored: Path | None) -> FrameErrors:
    load = press_load(seed)
    made = load.gel
    light = _calibrated_light(load.light_gain, seed) if known.light else None
    pipeline = _known_gel(made, light) if known.gel else _specified_gel(light)
    picture = kept_contact(_MODE, seed, stored).picture
    found = pipeline.process(seen(picture, condition_of(seed), seed))
    pad = fine_pad(made.thickness, made.poissons_ratio)
    on_nodes = lumped(load.force_n, pad.mesh, lit_bundle().mesh)
    return frame_errors(seed, found, on_nodes, made.young if known.gel else 1.0)


def _specified_gel(light: LightCalibration | None) -> ForcePipeline:
    bundle, gel = specified_bundle(), linear_gel()
    return _pipeline(bundle, light, gel.more, gel.share)


def _known_gel(made: MadeGel, light: LightCalibration | None) -> ForcePipeline:
    """With a gel that has no tolerances; its modulus, which only scales forces, is the design's."""
    designed = lit_bundle()
    material = replace(designed.material, poissons_ratio=made.poissons_ratio)
    built = designed.with_gel(material, made.thickness)
    return _pipeline(replace(built, tolerances={}), light)


def _pipeline(
    bundle: Bundle,
    light: LightCalibration | None,
    more: Sequence[tuple[Bundle, float]] = (),
    share: GelShare | None = None,
) -> ForcePipeline:
    known = replace(calibration(), geometry_hash=bundle.geometry_hash)
    source = unknown_shape(
        bundle, known, reference().image, gel="linear",
        settings=JointSettings(gamma=1.0), light=light, more=more,
    )  # fmt: skip
    return ForcePipeline(bundle, known, PipelineSettings(gel="linear"), source, share)


def _calibrated_light(gain: float, seed: int) -> LightCalibration:
    """As found with an error that is drawn; the same for all places and colours."""
    found = gain * np.exp(np.random.default_rng([seed, 3]).normal(0, LIGHT_SIGMA))
    channels = source_channels(light_map())
    terms = np.zeros((len(channels), TERMS))
    terms[:, 0] = found
    return LightCalibration(
        geometry_hash=lit_bundle().geometry_hash,
        channels=tuple(channels),
        middle_mm=np.zeros(2),
        half_mm=np.ones(2),
        gain=terms,
        covariance=np.zeros((len(channels), TERMS, TERMS)),
        gamma=1.0,
        gain_sigma=LIGHT_SIGMA,
        light_error=_NOTHING_ELSE,
        ball_mm=6.0,
    )
