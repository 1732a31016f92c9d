"""Picture of the drawn light against Mitsuba 3."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


NAMES = ("ball", "bar")
COLOURS = ("tab:red", "tab:green")
ROWS = {"ball": 5, "bar": None}
"""Rows of blocks in the middle of the view that a profile is the mean of; None for all."""


def figure(
    found: Mapping[str, tuple[Array, ...]],
    bare: Mapping[str, tuple[Array, ...]],
    half_mm: Mapping[str, float],
) -> bytes:
    """Ball and bar by the twin and by Mitsuba, and the profiles across the finger, as PNG.

    Args:
        found: By the name of the surface the light at rest and pressed by the twin (h, w, 2), then
            by Mitsuba (runs, h, w, 2).
        bare: The same where the twin draws by the slopes of the surface alone.
        half_mm: Half of the width of each view across the finger.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    drawing, axes = plt.subplots(2, 3, figsize=(10, 6.4), width_ratios=(1, 1, 1.5))
    for row, name in zip(axes, NAMES, strict=True):
        _draw_pictures(row[:2], found[name], name)
        for k in range(len(COLOURS)):
            _draw_profile(row[2], found[name], bare[name][1], k, ROWS[name], half_mm[name])
        row[2].set(xlabel="y, mm", ylabel="change of the light")
        row[2].legend(fontsize=8, ncol=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    drawing.tight_layout()
    out = BytesIO()
    drawing.savefig(out, format="png", dpi=90)
    return out.getvalue()


def _draw_pictures(axes: Any, found: tuple[Array, ...], name: str) -> None:
    rest, pressed, judged_rest, judged = found
    white = 1.6 * rest.mean()
    theirs = judged.mean(axis=0) * rest.mean() / judged_rest.mean()
    for plot, picture, title in zip(axes, (pressed, theirs), ("twin", "Mitsuba"), strict=True):
        coloured = np.dstack([picture, np.zeros(picture.shape[:2])]) / white
        plot.imshow(np.clip(coloured, 0, 1) ** (1 / 1.8), interpolation="nearest")
        plot.set(xticks=[], yticks=[], title=f"{name}, {title}")


def _draw_profile(
    plot: Any,
    found: tuple[Array, ...],
    slopes_alone: Array,
    colour: int,
    rows: int | None,
    half_mm: float,
) -> None:
    """The change of one colour across the finger; only the first one stands in the legend."""
    rest, pressed, judged_rest, judged = found
    first = len(rest) // 2 - (rows or 0) // 2
    middle = slice(None) if rows is None else slice(first, first + rows)

    def change(new: Array, old: Array) -> Array:
        light, before = (v[middle, :, colour].mean(axis=0) for v in (new, old))
        return np.asarray(light / before - 1)

    y_mm = np.linspace(-half_mm, half_mm, rest.shape[1])
    labels = ("twin", "slopes alone", "Mitsuba") if colour == 0 else (None, None, None)
    shade = COLOURS[colour]
    plot.plot(y_mm, change(pressed, rest), color=shade, label=labels[0])
    plot.plot(y_mm, change(slopes_alone, rest), color=shade, ls=":", label=labels[1])
    runs = [change(one, judged_rest.mean(axis=0)) for one in judged]
    plot.errorbar(
        y_mm, np.mean(runs, axis=0), np.std(runs, axis=0) / np.sqrt(len(runs)),
        color=shade, fmt="o", ms=3, label=labels[2],
    )  # fmt: skip
