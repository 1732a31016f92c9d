"""Wires keep the points they are given, to the last bit, and so are the same in every process."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

cq = pytest.importorskip("cadquery", reason="solids need the [cad] extra")

from gelslim_cad.solids.shapes import (  # noqa: E402
    outline_wire,
    prism,
    rounded_polygon,
    rounded_wire,
)
from gelslim_cad.solids.tooling.fit_coupon import _gauge  # noqa: E402

ROOT = Path(__file__).parents[2]


def star(seed: int) -> list[tuple[float, float]]:
    """Corners of a polygon that goes once round the origin, hollow corners among them."""
    angles = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    radii = np.random.default_rng(seed).uniform(10, 20, angles.size)
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def corners(wire: cq.Wire) -> list[tuple[float, float, float]]:
    return [v.toTuple() for v in wire.Vertices()]


@pytest.mark.parametrize("seed", range(5))
def test_corners_of_an_outline_are_its_points(seed: int) -> None:
    outline = rounded_polygon(star(seed), 0.7)
    wire = outline_wire(outline, 3.7)
    given = [(float(x), float(y), 3.7) for x, y in outline.points_mm]
    assert len(corners(wire)) == len(given) == 80
    assert set(corners(wire)) == set(given)
    assert wire.IsClosed()
    assert wire.isValid()


def test_area_of_an_outline_with_arcs() -> None:
    """A square whose corners are rounded lacks (4 - pi) r^2."""
    square = rounded_polygon([(0, 0), (10, 0), (10, 10), (0, 10)], 2.0)
    assert prism(square, (0, 1)).Volume() == pytest.approx(100 - (4 - math.pi) * 4, rel=1e-12)


def test_corners_of_a_rounded_rectangle_are_on_its_sides() -> None:
    wire = rounded_wire((-3.3, 7.1), (-2.7, 4.9), (0.3, 0.0, 1.1, 0.7), 1.9)
    found = corners(wire)
    assert len(found) == 7
    assert all(x in (-3.3, 7.1) or y in (-2.7, 4.9) for x, y, _ in found)
    assert {z for _, _, z in found} == {1.9}


GAUGE = (
    "import hashlib; from gelslim_cad.export.brep import shape_to_bytes;"
    "from gelslim_cad.solids.tooling.fit_coupon import _gauge as g;"
    "print(hashlib.sha256(shape_to_bytes(g())).hexdigest())"
)


@pytest.mark.slow
def test_the_gauge_is_the_same_in_every_process() -> None:
    """One of its corners was 0 in one process and -1e-16 in the next."""
    from gelslim_cad.export.brep import shape_to_bytes

    expected = hashlib.sha256(shape_to_bytes(_gauge())).hexdigest()
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(8):
        argv = [sys.executable, "-c", GAUGE]
        done = subprocess.run(argv, env=own, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == expected
