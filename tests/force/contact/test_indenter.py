"""Shapes of indenters and the words that name them."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.contact.indenter import Cylinder, Flat, IndenterError, Sphere, parse_indenter


def test_words_name_shapes():
    assert parse_indenter("sphere:10") == Sphere(10.0)
    assert parse_indenter(" Cylinder:6 ") == Cylinder(6.0)
    assert parse_indenter("cylinder:6@-30") == Cylinder(6.0, -30.0)
    assert parse_indenter("flat:5") == Flat(radius_mm=5.0)
    assert parse_indenter("flat:4x8") == Flat(half_sizes_mm=(2.0, 4.0))
    assert parse_indenter("sphere:1e1") == Sphere(10.0)


@pytest.mark.parametrize(
    "text",
    ["", "sphere", "sphere:", "sphere:0", "sphere:-3", "sphere:nan", "sphere:1e9", "ball:3",
     "cylinder:6@", "flat:4x", "flat:x8", "flat:4x8x2", "sphere:10mm", "flat:0x4"],
)  # fmt: skip
def test_other_words_are_refused_with_the_forms(text):
    with pytest.raises(IndenterError, match="sphere:RADIUS"):
        parse_indenter(text)


def test_profile_is_the_circle_and_does_not_cancel():
    r = np.array([0.0, 1e-7, 3.0, 10.0, 10.1])
    h = Sphere(10.0).profile(r, 0 * r)
    assert h[1] == pytest.approx(1e-14 / 20, rel=1e-9)
    assert h[2] == pytest.approx(10 - np.sqrt(91.0), rel=1e-13)
    assert h[3] == 10.0
    assert h[4] == np.inf
    # x runs along the cylinder's axis
    np.testing.assert_allclose(Cylinder(10.0).profile(5.0, r), h)


def test_flat_profile_ends_at_its_outline():
    box = Flat(half_sizes_mm=(2.0, 4.0))
    assert box.profile([2.0, 2.1, 0.0], [4.0, 0.0, -4.1]).tolist() == [0.0, np.inf, np.inf]
    assert Flat(radius_mm=1.0).profile([0.6, 0.8], [0.8, 0.7]).tolist() == [0.0, np.inf]
    for bad in ({}, {"radius_mm": 1.0, "half_sizes_mm": (1.0, 1.0)}, {"half_sizes_mm": (1.0, 0.0)}):
        with pytest.raises(IndenterError):
            Flat(**bad)
