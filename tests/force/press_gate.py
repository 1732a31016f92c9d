"""Errors of presses of at least 0.2 N of which nothing is given, on gels hardly or well known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import islice
from pathlib import Path

from frame_errors import LEAST_N, FrameErrors, frame_errors
from pressed_samples import calibration, fine_pad, lit_bundle, reference
from sigma_cases import press_load, seen, strong_presses
from sigma_gate import condition_of, kept_contact, nothing_given

from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from ifem_export.operators.ladder import lumped

GELS = ("gel within its tolerances", "gel known")
"""As specified, or as `calibrate-gel` would find it without an error."""
_MODE = "nothing given"


def press_seeds(number: int) -> list[int]:
    """The first seeds of presses with at least `LEAST_N`."""
    return list(islice(strong_presses(0, LEAST_N), number))


def press_errors(gel: str, seeds: Iterable[int], stored: Path | None = None) -> list[FrameErrors]:
    """Of presses, each in one of the conditions, which take turns.

    Args:
        gel: One of `GELS`.
        seeds: Of the presses.
        stored: Folder for the contacts.
    """
    return [_errors(gel, seed, stored) for seed in seeds]


def _errors(gel: str, seed: int, stored: Path | None) -> FrameErrors:
    load, known = press_load(seed), gel == GELS[1]
    made = load.gel
    pipeline = _known(made.thickness, made.poissons_ratio) if known else nothing_given()
    pipeline.reset()
    picture = kept_contact(_MODE, seed, stored).picture
    found = pipeline.process(seen(picture, condition_of(seed), seed))
    pad = fine_pad(made.thickness, made.poissons_ratio)
    on_nodes = lumped(load.force_n, pad.mesh, lit_bundle().mesh)
    return frame_errors(seed, found, on_nodes, made.young if known else 1.0)


@cache
def _known(thickness: float, poissons_ratio: float) -> ForcePipeline:
    """With a gel that has no tolerances; its modulus, which only scales forces, is the design's."""
    designed = lit_bundle()
    bundle = designed.with_gel(replace(designed.material, poissons_ratio=poissons_ratio))
    bundle = replace(bundle, mesh=designed.mesh.stretched(thickness), tolerances={})
    known = replace(calibration(), geometry_hash=bundle.geometry_hash)
    source = unknown_shape(
        bundle, known, reference().image, gel="linear", settings=JointSettings(gamma=1.0)
    )
    return ForcePipeline(bundle, known, PipelineSettings(gel="linear"), source)
