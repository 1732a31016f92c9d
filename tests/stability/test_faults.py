"""Specs that once broke a build: each is now built, or refused before any CAD."""

from __future__ import annotations

from pathlib import Path

import pytest

from .case import run_case

FAULTS = sorted((Path(__file__).parent / "faults").glob("*.yaml"))

LATER = (
    "lattice_too_small_for_anchors",
    "mirror_at_tip_ledge",
    "mirror_seat_in_camera_clamp",
    "view_under_ledge_wide_gel",
)


def test_there_are_faults() -> None:
    assert len(FAULTS) >= 7


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, id=p.stem, marks=pytest.mark.slow if p.stem in LATER else ()) for p in FAULTS],
)
def test_fault_stays_fixed(path: Path) -> None:
    outcome = run_case(path, "solids", lambda stage: None)
    assert outcome.status in ("built", "refused"), (outcome.reasons, outcome.detail)
    if outcome.status == "refused":
        assert outcome.reasons
        assert all(outcome.rules[rule] for rule in outcome.reasons)
