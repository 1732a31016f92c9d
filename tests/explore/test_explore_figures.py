"""Pictures of an exploration hold what they say: nothing runs out of the figure."""

from __future__ import annotations

import pytest

pytest.importorskip("matplotlib")

from matplotlib.patches import Patch

from gelslim_cad.checks import RULES
from gelslim_cad.explore.figures import legend_below
from gelslim_cad.figure import new_figure


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
