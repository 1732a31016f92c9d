"""Bounds of the contact's effects against the laws that they stand for."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from effect_samples import (
    APART,
    BALL_MM,
    BOUND,
    FIGURES,
    IS_NULL,
    MOTION,
    SCALE,
    ball,
    circumstances,
    same,
)
from pydantic import ValidationError

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.contact import (
    PronyTerm,
    RelaxationParameters,
    dragged_mm,
    moved_mm,
    solver_error,
)
from gelslim_twin.effects.contact_estimate import nonlinear_excess
from gelslim_twin.effects.effect import Bound, geometry, optics, picture

REACH_MM = math.sqrt(2 * BALL_MM * 0.35 - 0.35**2)
"""Radius of the ball's disc below the surface."""


def test_contact_is_its_whole_force_and_motion() -> None:
    c = circumstances()
    px = SCALE * math.hypot(0.35, c.contact.sideways_mm)
    same(BOUND["normal_contact"](c), geometry(px, 1.25 * c.contact.normal_n))
    same(BOUND["perspective"](c), optics(728.0))
    same(BOUND["drawing"](c), picture(0.6 * SCALE))
    same(BOUND["refraction"](c), optics(FIGURES.lifted_px(FIGURES.lift_mm(43.0))))


def path_mm(c: Circumstances) -> float:
    """Way of the farthest point of the tool, and the depth."""
    turned = math.pi * (12 * REACH_MM + 3 * 0.35) / 180
    return 0.8 + turned + math.sqrt(0.35**2 + c.contact.sideways_mm**2)


@pytest.mark.parametrize("mu", [1e-3, 0.05, 0.9, 4.0])
def test_friction_is_limited_by_the_cone_and_by_the_path(mu: float) -> None:
    c = circumstances(mu)
    t, path = c.contact, path_mm(c)
    assert dragged_mm(c) == pytest.approx(path)
    cone_n, path_n = mu * 1.25 * t.stick_n, path * t.shear_n_per_mm
    assert (cone_n < path_n) == (mu < 4)
    side_n = min(cone_n, path_n)
    aside_mm = min(path, 4 * side_n / t.shear_n_per_mm)
    assert (aside_mm < path) == (mu < 0.9)
    stiffer_n = 1.25 * min(mu, 1.0) * (t.stick_n - t.normal_n)
    whole_n = math.hypot(side_n, stiffer_n) * (1 + t.nonlinear_excess)
    assert moved_mm(c) == pytest.approx(aside_mm)
    same(BOUND["friction"](c), geometry(aside_mm * SCALE, whole_n))


def test_nothing_sticks_without_friction_or_contact() -> None:
    for c in (circumstances(0.0), circumstances(0.7, motion=APART)):
        assert BOUND["friction"](c) == Bound()
        assert moved_mm(c) == 0
    assert IS_NULL["friction"](circumstances(0.0))
    assert not IS_NULL["friction"](circumstances(0.7))


@pytest.mark.parametrize("mu", [0.0, 0.02])
def test_large_strain_is_the_excess_of_force_and_sideways_motion(mu: float) -> None:
    """Half the depth and what friction drags, twice; a node at an edge by the whole depth."""
    c = circumstances(mu)
    excess = c.contact.nonlinear_excess
    assert excess > nonlinear_excess(0.35 / 1.9) > 0.05
    seen = 2 * SCALE * excess * (0.175 + moved_mm(c))
    expected = Bound(excess * c.force_n, 0.35 * SCALE + seen, seen, seen)
    same(BOUND["nonlinearity"](c), expected)
    assert BOUND["nonlinearity"](circumstances(mu, motion=APART)) == Bound()
    assert IS_NULL["nonlinearity"](circumstances(mu, motion=APART))
    assert not IS_NULL["nonlinearity"](c)


@pytest.mark.parametrize(
    ("change", "node"),
    [({"twist_deg": 0.0, "tilt_deg": 0.0}, True), ({"lateral_mm": 0.0, "tilt_deg": 0.0}, True),
     ({"lateral_mm": 0.0, "twist_deg": 0.0}, True),
     ({"lateral_mm": 0.0, "twist_deg": 0.0, "tilt_deg": 0.0}, False)],
)  # fmt: skip
def test_walls_that_slide_hold_or_lose_one_node(change: dict[str, float], node: bool) -> None:
    """Its share of the area, in every kind of sideways motion; a press alone loses none."""
    walls = replace(ball(), steepest=lambda _d: math.inf)
    motion = replace(MOTION, **change)
    c = circumstances(0.4, footprint=walls, motion=motion)
    lost = 27.0 * 19.0 / 1300 / c.contact.area_mm2 if node else 0.0
    share = c.contact.nonlinear_excess + lost
    assert BOUND["nonlinearity"](c).force_n == pytest.approx(share * c.force_n)
    needle = replace(walls, area_mm2=lambda _d: 0.01)
    c = circumstances(0.4, footprint=needle, motion=motion)
    share = c.contact.nonlinear_excess + (1.0 if node else 0.0)
    assert BOUND["nonlinearity"](c).force_n == pytest.approx(share * c.force_n)


def test_relaxation_loses_what_the_series_forgets() -> None:
    terms = (PronyTerm(fraction=0.2, time_s=0.6), PronyTerm(fraction=0.1, time_s=25.0))
    c = circumstances(relaxation=RelaxationParameters(terms=terms))
    lost = 0.3 - 0.2 * math.exp(-1.7 / 0.6) - 0.1 * math.exp(-1.7 / 25)
    whole = c.force_n * (1 + c.contact.nonlinear_excess)
    same(BOUND["relaxation"](c), Bound(force_n=lost * whole))
    assert not IS_NULL["relaxation"](c)
    with pytest.raises(ValidationError, match="sum to 1"):
        RelaxationParameters(terms=tuple(PronyTerm(fraction=0.5, time_s=t) for t in (1.0, 2.0)))
    none = RelaxationParameters(terms=(PronyTerm(fraction=0.0, time_s=1.0),))
    assert IS_NULL["relaxation"](circumstances(relaxation=none))
    assert IS_NULL["relaxation"](circumstances())


def test_a_tool_that_meets_nothing_leaves_no_error() -> None:
    """At a depth too, where the pad is missed: no area, no nodes, no walls over nodes."""
    beside = replace(ball(), area_mm2=lambda _d: 0.0, steepest=lambda _d: math.inf)
    c = circumstances(footprint=beside)
    assert solver_error(c, 1e-2) == Bound()
    assert BOUND["nonlinearity"](c).force_n == 0
    assert moved_mm(c) == 0


def test_a_tip_of_few_nodes_costs_the_square_of_its_width_in_nodes() -> None:
    """From 4 to 7 nodes across: as the pitch squared, so inversely to the surface's nodes."""
    c = circumstances()
    area_mm2 = c.sensor.length_mm * c.sensor.width_mm
    width_mm = c.footprint.width_mm(c.contact.depth_mm)

    def nodes_and_px(across: float) -> tuple[int, float]:
        nodes = round(area_mm2 * (across / width_mm) ** 2)
        finer = replace(c, sensor=replace(c.sensor, surface_nodes=nodes))
        assert finer.contact_nodes < 50
        return nodes, solver_error(finer, 1e-2).displacement_px

    (few, large_px), (many, small_px) = nodes_and_px(4.0), nodes_and_px(7.0)
    assert large_px / small_px == pytest.approx(many / few)
    assert nodes_and_px(1.0)[1] == pytest.approx(nodes_and_px(3.0)[1])
