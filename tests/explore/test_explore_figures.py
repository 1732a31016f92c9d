"""Pictures of an exploration hold what they say: nothing runs out of the figure."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.patches import Patch

from gelslim_cad.checks import RULES
from gelslim_cad.explore.figures import _focus, borders, legend_below
from gelslim_core.figure import new_figure


@pytest.mark.parametrize("count", [1, 2, 3, 12])
def test_legend_lies_inside_the_narrowest_figure(count: int) -> None:
    # Two long titles once ran out at both sides of a figure with one panel.
    longest = sorted((f"{r.title} ({r.id})" for r in RULES.values()), key=len)[-count:]
    figure, _ = new_figure(5.7, 5.3)
    legend = legend_below(figure, [Patch(label=t) for t in longest], "feasible, or what binds")
    figure.canvas.draw()
    box = legend.get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.width
    assert box.y0 >= 0
    assert box.y1 <= figure.bbox.height / 2


def test_short_names_stand_side_by_side() -> None:
    figure, _ = new_figure(5.7, 5.3)
    legend = legend_below(figure, [Patch(label=t) for t in "abc"], "")
    figure.canvas.draw()
    assert len({round(t.get_window_extent().y0) for t in legend.get_texts()}) == 1


def test_the_black_line_goes_around_the_feasible_cells() -> None:
    cells = np.array([[True, True, False], [True, False, False]])
    found = {tuple(map(tuple, ends)) for ends in borders(cells)}
    assert found == {
        ((0.5, 0.5), (0.5, 1.5)),
        ((-0.5, 0.5), (1.5, 1.5)),
        ((0.5, 1.5), (0.5, 0.5)),
    }
    assert borders(np.ones((3, 3), bool)) == []


def test_values_at_one_limit_stay_a_line() -> None:
    """All designs at the blur limit once filled the panel with the solver's last digits."""
    _, panels = new_figure(4, 4)
    panel = np.ravel(panels)[0]
    _focus(panel, [15.0, 18.0], [0.16664, 0.16667])
    low, high = panel.get_ylim()
    assert low < 0.16 < 0.172 < high
    assert panel.get_xlim() == (14.25, 18.75)
