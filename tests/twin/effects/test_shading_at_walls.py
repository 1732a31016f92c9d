"""At the wall of a tool the light changes from node to node, and its lattice errs by more."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from agreement import Trial, seen_apart_px
from effect_samples import FIGURES, LADDER, ball, circumstances
from random_contact_scenes import Finger

from gelslim_twin.effects.grey_values import grey_share
from gelslim_twin.planning.plan import Plan

SHADOW = 4.0
"""What the edge of a shadow adds."""


def test_a_lattice_errs_by_the_share_of_a_node_that_it_steps_over() -> None:
    c = circumstances(footprint=replace(ball(), steepest=lambda _d: math.inf))
    pitch_px = FIGURES.node_pitch_mm * FIGURES.px_per_mm
    by_step = {r.parameters["pixel_step"]: r.error.image_px for r in LADDER["shading"](c)}
    reach = FIGURES.thickness_mm * FIGURES.px_per_mm
    assert by_step[2] / by_step[1] == pytest.approx((SHADOW / pitch_px) / (1 / (8 * reach**2)))
    assert by_step[1] < 0.01 * by_step[2] < by_step[2] < by_step[4] <= by_step[8]
    assert grey_share(c) > 0


@pytest.mark.slow
def test_pictures_of_a_ring_keep_the_error_of_their_lattice(tmp_path: Path) -> None:
    """On the gallery's ring pictures every 8 and every 4 px once had a dot 1.5 px apart."""
    values = {
        "format": "gelslim-scene/1",
        "name": "ring",
        "sensor": {"bundle": Finger("gelslim2", 0.3223).name},
        "indenters": [{"shape": "ring", "outer_radius_mm": 5, "inner_radius_mm": 3}],
        "motion": {
            "waypoints": [{"move": "press", "depth_mm": 0.4, "steps": 1, "duration_s": 1.0}]
        },
        "observe": ["image"],
        "tolerance": {"force_n": 1.0, "image_px": 0.01},
        "effects": {"nonlinearity": "off", "motion_blur": "off", "sensor_noise": "off"},
    }
    one = Trial.of(Finger("gelslim2", 0.3223), values, tmp_path)
    plan = one.full()
    ladder = {r.parameters["pixel_step"]: r for r in LADDER["shading"](one.asked.circumstances)}

    def with_step(step: int) -> Plan:
        parameters = tuple(ladder[step].parameters.items())
        chosen = [
            replace(c, rung_parameters=parameters) if c.effect == "shading" else c
            for c in plan.choices
        ]
        return replace(plan, choices=tuple(chosen))

    finest = one.carried_out(with_step(1))
    last = {len(one.poses) - 1}
    apart = {
        step: seen_apart_px(finest, one.carried_out(with_step(step), finest.states), last)
        for step in (8, 4, 2)
    }
    assert apart[8] > 0.01
    for step, px in apart.items():
        assert px <= ladder[step].error.image_px, step
