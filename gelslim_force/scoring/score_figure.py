"""A figure of found forces over labels, with their stated deviations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gelslim_core.figure import as_png, new_figure
from gelslim_force.outputs.wrench_csv import AXES

if TYPE_CHECKING:
    from gelslim_force.scoring.run_score import RunScore

_NAMES = {
    "fx_n": "$F_x$, N", "fy_n": "$F_y$, N", "fz_n": "$F_z$, N",
    "tx_nmm": "$T_x$, N mm", "ty_nmm": "$T_y$, N mm", "tz_nmm": "$T_z$, N mm",
}  # fmt: skip
_MOST_POINTS = 2000
"""Points of one axis; of more, an even choice is drawn."""


def score_figure(score: RunScore) -> bytes:
    """A PNG with found over label for each axis that has labels; bars are 1.96 deviations."""
    columns = min(3, len(score.axes))
    rows = -(-len(score.axes) // columns)
    figure, drawn = new_figure(3.3 * columns, 3.2 * rows, columns, rows)
    places = np.atleast_1d(drawn).ravel()
    for axes, axis in zip(places, score.axes, strict=False):
        k = AXES.index(axis.axis)
        found, sigma, label = (part[:, k] for part in (score.found, score.sigma, score.label))
        both = np.flatnonzero(np.isfinite(found) & np.isfinite(label))
        both = both[:: 1 + len(both) // _MOST_POINTS]
        bars = 1.96 * np.nan_to_num(sigma[both])
        axes.errorbar(
            label[both], found[both], yerr=bars, fmt=".", markersize=4, elinewidth=0.6,
            color="#1f5a96", ecolor="#9bb8d6", zorder=2,
        )  # fmt: skip
        ends = np.array([label[both].min(), label[both].max()]) if len(both) else np.zeros(2)
        axes.plot(ends, ends, color="#555555", linewidth=0.8, zorder=1)
        axes.set_title(f"{_NAMES[axis.axis]}: RMS {axis.rms:.3g}", fontsize=9)
        axes.set_xlabel("label", fontsize=8)
        axes.set_ylabel("found, ± 1.96 σ", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=5)
    for axes in places[len(score.axes) :]:
        axes.set_axis_off()
    return as_png(figure, "gelslim score")
