"""Silicone to mix, against numbers worked by hand."""

from __future__ import annotations

import math

import pytest
from tooling_samples import gelslim2

from gelslim_cad.build.casting import Casting


def test_masses_by_hand() -> None:
    """10 x 10 x 2 mm, no shrinkage: 200 mm³; with 25 % waste 250 mm³ of 1000 kg/m³: 0.25 g."""
    casting = Casting(200.0, 0.0, 1000.0, 4.0, 1.0)
    assert casting.cavity_volume_mm3 == 200
    assert casting.mass_g == pytest.approx(0.25)
    assert casting.mass_a_g == pytest.approx(0.20)
    assert casting.mass_b_g == pytest.approx(0.05)


def test_shrinkage_enlarges_the_cavity_in_all_directions() -> None:
    casting = Casting(729.0, 10.0, 1000.0, 1.0, 1.0)
    assert casting.cavity_volume_mm3 == pytest.approx(1000)


def test_papers_sensor() -> None:
    casting = Casting.of(gelslim2())
    gel = (28 * 28 - (4 - math.pi) * 4) * 2
    assert casting.gel_volume_mm3 == pytest.approx(gel)
    mass = gel / 0.999**3 * 1.25 * 1020e-6
    assert casting.mass_a_g + casting.mass_b_g == pytest.approx(mass)
    assert casting.mass_a_g / casting.mass_b_g == pytest.approx(15)


def test_crown_adds_volume() -> None:
    flat, crowned = Casting.of(gelslim2()), Casting.of(gelslim2(design__gel__crown_height_mm=1.0))
    added = crowned.gel_volume_mm3 - flat.gel_volume_mm3
    area = 28 * 28 - (4 - math.pi) * 4
    assert area / 2 < added < area, "over half the crown's height on average, less than all"


def test_weighable_batch_keeps_the_ratio() -> None:
    one = Casting.of(gelslim2())
    assert one.mass_b_g < 0.25
    batch = one.weighable()
    assert batch.mass_b_g == pytest.approx(0.25), "half a step of 0.01 g is then 2 %"
    assert batch.mass_a_g / batch.mass_b_g == pytest.approx(15)
    assert batch.mass_g == pytest.approx(one.mass_g * batch.batch)
    assert batch.weighable() == batch


def test_lines_for_the_instructions() -> None:
    casting = Casting.of(gelslim2()).weighable()
    rows = {name: (value, unit) for name, _, value, unit in casting.lines()}
    assert rows["part A"][0] + rows["part B"][0] == pytest.approx(rows["mass to mix"][0])
    assert rows["liquid to mix"] == (pytest.approx(casting.mixed_volume_mm3 / 1000), "ml")
    assert rows["waste"] == (25.0, "%")
