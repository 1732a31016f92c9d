"""A wrench and a force field show themselves in a notebook."""

from __future__ import annotations

import re
import sys

import numpy as np
import pytest

from gelslim_force.forces.frame_result import ForceField, FrameResult, _on_lattice
from gelslim_force.forces.wrench import Wrench

PNG = b"\x89PNG\r\n\x1a\n"


def wrench(normal_known: bool = True) -> Wrench:
    covariance = np.diag(np.array([0.01, 0.02, 0.03, 0.4, 0.5, 0.6]) ** 2)
    force, torque = np.array([0.3, -0.2, -1.0]), np.array([4.0, -5.0, 0.25])
    if not normal_known:
        force[2] = torque[0] = torque[1] = np.nan
        covariance[[2, 3, 4]] = np.nan
    return Wrench(force, torque, covariance)


def cells(table: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", table)[1:]
    return [[re.sub(r"<.*?>", "", c) for c in re.findall(r"<td>(.*?)</td>", r)] for r in rows]


def test_a_wrench_is_a_table_with_its_uncertainty_and_units() -> None:
    assert cells(wrench()._repr_html_()) == [
        ["Fx", "+0.300", "0.010", "N"],
        ["Fy", "-0.200", "0.020", "N"],
        ["Fz", "-1.000", "0.030", "N"],
        ["Tx", "+4.00", "0.40", "N mm"],
        ["Ty", "-5.00", "0.50", "N mm"],
        ["Tz", "+0.25", "0.60", "N mm"],
    ]


def test_what_is_not_known_is_called_unknown() -> None:
    rows = cells(wrench(normal_known=False)._repr_html_())
    assert [row[1:3] == ["unknown", "unknown"] for row in rows] == [
        False, False, True, True, True, False,
    ]  # fmt: skip


def field(normal_known: bool = True) -> ForceField:
    """A lattice of cells that are not square, without its corner."""
    x, y = np.meshgrid(np.arange(9) * 0.5, np.arange(7) * 0.8)
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])[1:]
    traction = np.random.default_rng(0).normal(0, 0.01, points.shape)
    if not normal_known:
        traction[:, 2] = np.nan
    return ForceField(
        points, 0 * points, 0.4 * traction, traction, np.ones(len(points), bool), np.zeros(2), 0.5
    )


@pytest.mark.parametrize("normal_known", [True, False])
def test_a_force_field_is_a_picture(normal_known: bool) -> None:
    pytest.importorskip("matplotlib")
    shown = field(normal_known)
    picture = shown._repr_png_()
    assert picture is not None
    assert picture.startswith(PNG)
    result = FrameResult(0, 0.0, field=shown)
    assert result._repr_png_() == picture
    assert FrameResult(0, 0.0)._repr_png_() is None


def test_values_stand_at_their_nodes() -> None:
    points = field().points_mm
    x, y, values = _on_lattice(points[:, 0], points[:, 1], points[:, 0] + 10 * points[:, 1])
    assert (len(x), len(y), values.shape) == (9, 7, (7, 9))
    assert np.isnan(values[0, 0])
    expected = x[None, :] + 10 * y[:, None]
    assert values.ravel()[1:] == pytest.approx(expected.ravel()[1:])


def test_without_matplotlib_the_text_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("matplotlib", "matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, name, None)
    assert field()._repr_png_() is None
    assert "ForceField" in repr(field())


def test_a_printed_wrench_is_one_line_and_says_what_is_unknown() -> None:
    text = str(wrench(normal_known=False))
    assert "\n" not in text
    assert text.count("unknown") == 3
    assert text.count("±") == 3
    assert str(wrench()).count("±") == 6
