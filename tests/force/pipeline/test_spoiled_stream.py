"""Thousands of frames with faults at random: no false force, and soon right again.

GELSLIM_SOAK_FRAMES is the number of frames of each stream; 10,000 take some minutes.
"""

from __future__ import annotations

import os

import pytest
from lit_pipelines import checked, grey_pipeline, opened
from pressed_samples import Pressed, pressed
from pressed_shapes import ball, pressed_shape
from spoiled_stream import least_press_n, mono, soak, stream, untouched, widest_sigma_n

from gelslim_force.pipeline import ForcePipeline

pytest.importorskip("PIL")
FRAMES = int(os.environ.get("GELSLIM_SOAK_FRAMES", "300"))
TRACTIONS = (13, 32, 35)
BALL_MM = 6.0


def presses(mode: str) -> list[tuple[Pressed, Pressed]]:
    """Tractions of any shape, or presses of the ball that is named."""
    if mode != "named":
        return [(pressed(seed, share=0.5), pressed(seed)) for seed in TRACTIONS]
    places = ((1.0, -1.0), (-3.0, 2.0))
    return [
        tuple(pressed_shape(ball(BALL_MM), d, place, 0.0, 3) for d in (0.3, 0.5))  # type: ignore[misc]
        for place in places
    ]


def chain_of(mode: str) -> ForcePipeline:
    """Objects of unknown shape, also in grey pictures, without a normal source, or a named ball."""
    if mode == "markers":
        return grey_pipeline()
    return checked(f"sphere:{BALL_MM:g}") if mode == "named" else opened(mode)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["unknown", "markers", "none", "named"])
def test_no_fault_is_a_force_and_the_next_frames_are_right(mode: str) -> None:
    """No more than one force in 10,000 frames is off by four of its standard deviations."""
    chain = chain_of(mode)
    chain.reset()
    frames = stream(untouched(), presses(mode), FRAMES, seed=5)
    found = soak(chain, mono(frames) if mode == "markers" else frames)
    assert found.frames == FRAMES
    assert found.spoiled.total() > 0.09 * FRAMES
    assert len(found.false) <= FRAMES // 10_000, found.false
    assert not found.late
    assert found.largest_n < least_press_n(mode == "markers")
    assert found.widest_n < widest_sigma_n(mode == "markers")
