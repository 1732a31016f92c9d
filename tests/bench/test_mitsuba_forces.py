"""Forces of the command line from pictures that Mitsuba 3 drew of contacts of known force."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.bench_data import DOCS
from bench.force.mitsuba_forces import Trial
from bench.page.mitsuba_scores import CALIBRATED, GEL_KNOWN, LINEAR, TRACED, Scores

STORED = json.loads((DOCS / "data" / "mitsuba_forces.json").read_text("utf-8"))


def hold(record: Mapping[str, Any], way: str) -> None:
    """Errors and deviations that are claimed for both lights."""
    some = Scores.of(record, way)
    assert some.unknown == 0
    assert np.median(np.abs(some.normal_error)) < 0.12
    assert np.median(some.shear_error_n) < 0.012
    assert np.median(some.centre_off_mm) < 0.3


@pytest.mark.parametrize("way", [TRACED, CALIBRATED])
def test_stored_forces_keep_their_errors_and_deviations(way: str) -> None:
    hold(STORED, way)
    z = Scores.of(STORED, way).z[:, :3]
    assert (np.sqrt((z**2).mean(axis=0)) < 1.5).all()


def test_stored_forces_of_a_known_gel_are_within_three_percent() -> None:
    """What is left of the error is that of the method: light, markers, mesh and camera."""
    some = Scores.of(STORED, GEL_KNOWN)
    assert some.unknown == 0
    assert np.median(np.abs(some.normal_error)) < 0.03
    assert abs(some.normal_error.mean()) < 0.02
    assert np.median(some.shear_error_n) < 0.002
    assert (np.sqrt((some.z[:, :3] ** 2).mean(axis=0)) < 1.3).all()


def test_deep_shapes_are_read_by_the_law_at_large_strain() -> None:
    """Contacts of a neo-Hookean gel that another method solved, in another renderer's light."""
    some = Scores.of(STORED, GEL_KNOWN, "shape")
    assert len(some.truth) >= 7
    assert some.unknown == 0
    assert np.median(np.abs(some.normal_error)) < 0.05
    assert abs(some.normal_error.mean()) < 0.03
    assert np.abs(some.z[:, 2]).max() < 2.5
    by_linear = Scores.of(STORED, LINEAR, "shape").normal_error
    by_auto = Scores.of(STORED, TRACED, "shape").normal_error
    assert (by_linear < by_auto).all()


@pytest.mark.slow
def test_forces_from_pictures_drawn_anew(tmp_path: Path) -> None:
    """Four contacts with a quarter of the light that the stored forces have."""
    pytest.importorskip(
        "mitsuba",
        reason="Mitsuba 3 is absent: forces were NOT judged on its pictures (extra `mitsuba`)",
    )
    if not os.environ.get("DRJIT_LIBLLVM_PATH"):
        pytest.skip("DRJIT_LIBLLVM_PATH names no libLLVM: forces were NOT judged by Mitsuba")
    hold(Trial(tmp_path, 4, 0, 2_000_000, presses=0).scored(), TRACED)
