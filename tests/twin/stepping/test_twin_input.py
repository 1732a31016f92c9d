"""What a twin refuses, and that a step which fails leaves it as it was."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stepping_rig import DT_S, at, linear_twin

import gelslim
from gelslim_twin.effects.contact import MOST_FORCE
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.request import OVERESTIMATE, Request
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.stepping.twin import Twin


def test_the_public_names_are_these_classes() -> None:
    assert gelslim.Twin is Twin
    assert gelslim.Body is Body
    assert issubclass(StepError, gelslim.GelslimError)


@pytest.mark.parametrize(
    "settings",
    [
        {"observe": ("forces",)},
        {"observe": ()},
        {"observe": ("force", "force")},
        {"observe": (3,)},
        {"tolerance": {"torque": "2%"}},
        {"tolerance": {"force": "2px"}},
        {"tolerance": {"force": 0.0}},
        {"tolerance": {"force": float("nan")}},
        {"tolerance": {"force": True}},
        {"tolerance": {"image": "2%"}},
        {"tolerance": {"image": -1.0}},
        {"friction": -0.1},
        {"friction": float("nan")},
        {"friction": "rough"},
        {"effects": {"wear": "on"}},
        {"effects": {"nonlinearity": "maybe"}},
        {"effects": {"relaxation": {"terms": [{"fraction": 2.0, "time_s": 1.0}]}}},
        {"effects": {"viscoelasticity": {"terms": [{"fraction": 0.2, "time_s": 1.0}]}}},
        {"effects": {"sliding_friction": {"use": "on", "kinetic": 0.3}}},
        {"effects": {"adhesion": {"work_j_m2": 1.0}}},
        {"effects": {"shading": object()}},
        {"seed": -1},
    ],
)
def test_settings_that_are_refused(pad: Path, settings: dict[str, Any]) -> None:
    with pytest.raises(StepError):
        Twin(pad, **settings)


def test_a_bundle_must_be_there_and_hold_what_is_observed(pad: Path, tmp_path: Path) -> None:
    with pytest.raises(StepError, match="no such folder"):
        Twin(tmp_path / "none")
    for folder, observe in ((tmp_path, ("force",)), (pad, ("image",))):
        with pytest.raises(gelslim.GelslimError):
            Twin(folder, observe)


def test_the_compliance_is_kept_for_the_next_twin(pad: Path, tmp_path: Path) -> None:
    Twin(pad, keep=tmp_path / "kept").prepare()
    again = Twin(pad, keep=tmp_path / "kept")
    assert again._shared.mechanics.compliance._made.all()
    (tmp_path / "file").write_text("")
    with pytest.raises(StepError, match="keep"):
        Twin(pad, keep=tmp_path / "file")


@pytest.mark.parametrize("dt", [0.0, -0.002, float("nan"), float("inf"), "soon", None])
def test_times_that_are_refused(pad: Path, dt: Any) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    with pytest.raises(StepError, match="dt"):
        twin.step(at(0, 0, 3.9), dt)


def test_bodies_come_before_the_first_step(pad: Path) -> None:
    twin = linear_twin(pad)
    with pytest.raises(StepError, match="no body"):
        twin.step(at(0, 0, 3.9), DT_S)
    for wrong in ("key.stl", Sphere(shape="sphere", radius_mm=4.0), None):
        with pytest.raises(StepError, match="is no body"):
            twin.add(wrong)  # type: ignore[arg-type]
    twin.add(Body.sphere(4.0))
    twin.step(at(0, 0, 3.9), DT_S)
    with pytest.raises(StepError, match="reset"):
        twin.add(Body.sphere(4.0))
    twin.reset()
    twin.add(Body.sphere(4.0))
    assert len(twin.bodies) == 2


def test_a_failed_step_changes_nothing(pad: Path) -> None:
    twin, other = linear_twin(pad, friction=0.5), linear_twin(pad, friction=0.5)
    for one in (twin, other):
        one.add(Body.sphere(4.0))
        one.step(at(0.1, 0.0, 3.8), DT_S)
    before = twin.state
    for bad in (np.full((4, 4), np.nan), np.zeros(6), at(0, 0, 2.1)):
        with pytest.raises(StepError):
            twin.step(bad, DT_S)
    assert twin.state is before
    found, known = (one.step(at(0.3, 0.0, 3.75), DT_S) for one in (twin, other))
    np.testing.assert_array_equal(found.force_n, known.force_n)


@pytest.mark.parametrize("share", [0.05, 0.02, 0.01, 0.003])
def test_the_solver_takes_half_of_the_force_tolerance(share: float) -> None:
    tolerance = Request(force_share=share).solver_tolerance
    assert OVERESTIMATE * MOST_FORCE * tolerance**0.5 <= share / 2
    assert Request.read(("force",), {"force": f"{100 * share:g}%"}).force_share == share


def test_the_smallest_of_several_pixels_counts() -> None:
    read = Request.read("image", {"markers": "0.3px", "image": 0.1, "displacement": 0.2})
    assert read.image_px == 0.1
    assert read.observe == ("image",)
