"""The twin's drawn light of a pressed gel against Mitsuba 3 on the same finger and surface."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

pytest.importorskip(
    "mitsuba",
    reason="Mitsuba 3 is absent: the drawn light was NOT checked against it (extra `mitsuba`)",
)
from bench.models.judged_finger import JudgedFinger
from bench.models.mitsuba_finger import renderer
from bench.optics import drawn_light

pytestmark = pytest.mark.slow
SAMPLES = 1.0 if os.environ.get("DRJIT_LIBLLVM_PATH") else 0.15
"""Share of the samples: Mitsuba's scalar variant is slower."""


@cache
def finger() -> JudgedFinger:
    return JudgedFinger.of_design()


@cache
def mitsuba() -> Any:
    return renderer()


@pytest.mark.parametrize(
    ("name", "share", "slope", "correlation"),
    [
        ("small ripple", 0.5, 0.03, 0.96),
        ("steep ripple", 1.0, 0.03, 0.98),
        ("ball", 0.5, 0.08, 0.97),
        ("bar", 0.5, 0.10, 0.97),
    ],
)
def test_the_change_of_each_colour_is_that_of_mitsuba(
    name: str, share: float, slope: float, correlation: float
) -> None:
    """Slope of the regression, three standard errors allowed; correlation freed of noise."""
    for found in drawn_light.compared(mitsuba(), finger(), name, share * SAMPLES):
        assert found.slope_error < 0.025 / SAMPLES**0.5
        assert found.slope == pytest.approx(1.0, abs=slope + 3 * found.slope_error)
        assert found.contrast == pytest.approx(1.0, abs=slope + 4 * found.slope_error)
        assert found.correlation > correlation - 2 * found.slope_error


def test_slopes_alone_miss_the_shadow_of_a_bar() -> None:
    """The same judge tells the picture without shadows from that with them.

    With fewer samples than these the noise of Mitsuba hides the difference.
    """
    bare = replace(finger(), relief=False)
    for found in drawn_light.compared(mitsuba(), bare, "bar", 0.2):
        assert found.correlation < 0.96
        assert found.residual > 0.12


def test_the_light_at_rest_is_that_of_mitsuba_across_the_finger() -> None:
    found = drawn_light.rest_profile(mitsuba(), finger(), SAMPLES)
    away = found.drawn / found.judged - 1
    assert (away**2).mean() - (found.noise**2).mean() < 0.04**2
