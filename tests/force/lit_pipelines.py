"""Pipelines of the lit sensor of `pressed_samples`, for what is known of the object."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from pressed_samples import calibration, lit_bundle, reference

from gelslim_force.joint.checked_indenter import CheckedIndenter
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import WITNESS, JointSettings
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import indenter_source, open_sensor
from gelslim_force.settings import PipelineSettings


@cache
def witness(settings: JointSettings = JointSettings()) -> UnknownShape:  # noqa: B008
    """Forces of an unknown shape; the drawn camera and the drawn gel are linear."""
    linear, rest = replace(settings, gamma=1.0), reference().image
    return unknown_shape(lit_bundle(), calibration(), rest, gel="linear", settings=linear)


@cache
def opened(mode: str) -> ForcePipeline:
    """By the mode `unknown`, `none`, `depth` (that the test gives) or the name of an indenter."""
    if mode in ("none", "depth"):
        return ForcePipeline(lit_bundle(), calibration(), PipelineSettings(gel="linear"))
    if mode == "unknown":
        return opened("none").with_normal(witness())
    source = indenter_source(lit_bundle(), calibration(), reference().image, mode)
    return opened("none").with_normal(source)


@cache
def checked(name: str) -> ForcePipeline:
    """A named indenter that light and markers confirm."""
    named = opened(name).normal
    return opened("none").with_normal(CheckedIndenter(named, witness(WITNESS)))  # type: ignore[arg-type]


@cache
def grey_pipeline() -> ForcePipeline:
    """Of the same sensor with a mono camera: forces of any object from the markers alone."""
    bundle = replace(lit_bundle(), camera={**lit_bundle().camera, "picture": "mono"})
    rest = np.rint(reference().image.mean(axis=2)).astype(np.uint8)
    return open_sensor(bundle, reference=rest, settings=PipelineSettings(gel="linear"))
