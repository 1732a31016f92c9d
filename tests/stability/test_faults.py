"""Specs that once broke a build: each is now built, or refused before any CAD."""

from __future__ import annotations

from pathlib import Path

import pytest

from .case import run_case

FAULTS = sorted((Path(__file__).parent / "faults").glob("*.yaml"))


def test_there_are_faults() -> None:
    assert len(FAULTS) >= 7


@pytest.mark.parametrize("path", FAULTS, ids=lambda p: p.stem)
def test_fault_stays_fixed(path: Path) -> None:
    outcome = run_case(path, "solids", lambda stage: None)
    assert outcome.status in ("built", "refused"), (outcome.reasons, outcome.detail)
    if outcome.status == "refused":
        assert outcome.reasons
        assert all(outcome.rules[rule] for rule in outcome.reasons)
