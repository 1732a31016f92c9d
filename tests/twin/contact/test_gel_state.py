"""States of the gel between two solved steps."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_twin.contact.gel_state import GelState


def state(seed: int, touch: int) -> GelState:
    rng = np.random.default_rng(seed)
    return GelState(
        rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), np.full(5, touch, dtype=np.int8)
    )


@pytest.mark.parametrize("part", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_a_state_between_two_lies_on_the_line_between_them(part: float) -> None:
    first, later = state(1, 0), state(2, 1)
    found = first.blended(later, part)
    for name in ("displacement_mm", "force_n"):
        start, end = getattr(first, name), getattr(later, name)
        assert getattr(found, name) == pytest.approx(start + part * (end - start), abs=1e-12)
    assert np.all(found.touch == (0 if part < 0.5 else 1))


def test_a_state_at_rest_has_nothing() -> None:
    rest = GelState.at_rest(4)
    assert not rest.displacement_mm.any()
    assert not rest.force_n.any()
    assert not rest.touch.any()
