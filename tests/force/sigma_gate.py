"""Whether the standard deviations of forces hold: scores over random contacts.

A mode says what is known of the normal motion, a condition how the picture is disturbed. The score
of a component is its error over its standard deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pressed_samples import calibration, reference
from sigma_cases import (
    CONDITIONS,
    Contact,
    ball,
    press,
    seen,
    specified_bundle,
    spread_normal,
)

from gelslim_force.built_sensor import BuiltGel, built_gel
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import normal_source
from gelslim_force.settings import PipelineSettings

Array = NDArray[np.float64]
MODES = ("nothing given", "depth given", "ball given")
WIDE = "nothing given, Poisson's ratio ± 0.02"
"""A mode beside these, on gels as `sigma_cases.MadeGel.drawn` gives them with a seed."""
COMPONENTS = ("F_x", "F_y", "F_z")
RMS, COVERAGE = (0.8, 1.3), (0.90, 0.98)
"""What the gate asks for."""
_95 = 1.959964
_LINEAR = PipelineSettings(gel="linear")
"""The law of the gels that the contacts are drawn on."""


@dataclass(frozen=True)
class Score:
    """A frame's forces against the truth, three values each; none where no force was given."""

    seed: int
    true_n: tuple[float, ...]
    error_n: tuple[float, ...] = ()
    sigma_n: tuple[float, ...] = ()
    problem: str = ""


@cache
def linear_gel(wide: bool = False) -> BuiltGel:
    """The gel as specified; its share of the covariance is that of a gel whose law is linear."""
    gel = built_gel(specified_bundle(wide), calibration(), None, PipelineSettings(gel="auto"))
    assert gel.share is not None
    return replace(gel, share=replace(gel.share, thickness_mm=np.inf))


@cache
def nothing_given(wide: bool = False) -> ForcePipeline:
    """Forces by light and markers, on a gel as specified."""
    bundle, gel = specified_bundle(wide), linear_gel(wide)
    source = unknown_shape(
        bundle,
        calibration(),
        reference().image,
        gel="linear",
        settings=JointSettings(gamma=1.0),
        more=gel.more,
    )
    return ForcePipeline(bundle, calibration(), _LINEAR, source, gel.share)


@cache
def _depth_given() -> ForcePipeline:
    return ForcePipeline(specified_bundle(), calibration(), _LINEAR, gel=linear_gel().share)


@cache
def _ball_given(radius_mm: float) -> ForcePipeline:
    source = normal_source(linear_gel(), reference().image, f"sphere:{radius_mm:g}")
    return ForcePipeline(specified_bundle(), calibration(), _LINEAR, source, linear_gel().share)


def contact_of(mode: str, seed: int) -> Contact:
    """The contact of a case."""
    return ball(seed) if mode == "ball given" else press(seed, mode == WIDE)


def score(mode: str, condition: str, seed: int, contact: Contact) -> Score:
    """Process one frame of a contact."""
    given: dict[str, Any] = {}
    if mode in ("nothing given", WIDE):
        pipeline = nothing_given(mode == WIDE)
    elif mode == "depth given":
        pipeline, given = _depth_given(), _given_depth(contact.height_mm, seed)
    else:
        pipeline = _ball_given(contact.radius_mm)
    pipeline.reset()
    found = pipeline.process(seen(contact.picture, condition, seed), **given)
    true_n = tuple(contact.force_n.tolist())
    if found.wrench is None or not found.normal_known or found.problems:
        return Score(seed, true_n, problem="; ".join(found.problems))
    off = found.wrench.force_n - contact.force_n
    sigma = found.wrench.standard_deviation[:3]
    return Score(seed, true_n, tuple(off.tolist()), tuple(sigma.tolist()))


def _given_depth(height_mm: Array, seed: int) -> dict[str, Any]:
    """Heights with an error, of scale or offset, and the standard deviation that it has."""
    rng = np.random.default_rng([34, seed])
    if seed // len(CONDITIONS) % 2:
        sigma = np.exp(rng.uniform(np.log(0.01), np.log(0.08))) * np.abs(height_mm)
    else:
        sigma = np.minimum(np.exp(rng.uniform(np.log(0.002), np.log(0.02))), np.abs(height_mm))
    off = spread_normal(seed)
    return {"normal_mm": height_mm + off * sigma, "normal_sigma_mm": sigma}


def condition_of(seed: int) -> str:
    """The condition of a case: they take turns, so that all cases are independent."""
    return CONDITIONS[seed % len(CONDITIONS)]


def scores(
    mode: str, seeds: Iterable[int], stored: Path | None = None
) -> Mapping[str, list[Score]]:
    """Scores by condition. Contacts are kept in the folder `stored`, if it is given."""
    found: dict[str, list[Score]] = {condition: [] for condition in CONDITIONS}
    for seed in seeds:
        condition = condition_of(seed)
        found[condition].append(score(mode, condition, seed, kept_contact(mode, seed, stored)))
    return found


def kept_contact(mode: str, seed: int, folder: Path | None) -> Contact:
    """The contact of a case, read from the folder or made and kept there, if one is given."""
    if folder is None:
        return contact_of(mode, seed)
    kind = {"ball given": "ball", WIDE: "wide"}.get(mode, "press")
    path = folder / f"{kind}-{seed}.npz"
    if not path.exists():
        made = contact_of(mode, seed)
        np.savez_compressed(path, **vars(made))
    with np.load(path) as kept:
        return Contact(
            kept["picture"], kept["force_n"], kept["height_mm"], float(kept["radius_mm"])
        )


@dataclass(frozen=True)
class Summary:
    """Of the scores of one component."""

    cases: int
    rms: float
    mean: float
    covered: float
    error_n: float
    sigma_n: float


def summaries(some: Iterable[Score]) -> list[Summary]:
    """For F_x, F_y and F_z, of the frames that gave forces."""
    given = [s for s in some if s.error_n]
    error, sigma = (np.array([getattr(s, name) for s in given]) for name in ("error_n", "sigma_n"))
    z = error / sigma
    return [
        Summary(
            len(given),
            float(np.sqrt((z[:, k] ** 2).mean())),
            float(z[:, k].mean()),
            float((np.abs(z[:, k]) < _95).mean()),
            float(np.median(np.abs(error[:, k]))),
            float(np.median(sigma[:, k])),
        )
        for k in range(3)
    ]
