"""A validation as sentences, tables and plots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gelslim.cli.answer import console, say
from gelslim_core.figure import as_png, new_figure

if TYPE_CHECKING:
    from rich.table import Table

    from gelslim_twin.validation.score import Sample, Score, Spread, Validation


NONE = "-"


def print_validation(found: Validation) -> None:
    """Print the experiment, the chains and the paper, the error budget, the other contacts."""
    screen = console()
    tests = found.experiment.tests
    depths = [t.depth_mm for t in tests]
    sizes = [math.hypot(*s.true_n) for s in found.scores]
    say(
        f"Ball of radius {found.experiment.ball.radius_mm:g} mm, pressed {min(depths):.2g} to "
        f"{max(depths):.2g} mm deep at {len(tests)} places, then slid in {len(tests)} directions: "
        f"true forces up to {max(sizes):.2f} N."
    )
    say(f"{found.truth}\n")
    say(
        "Error of the resultant, found minus true: its standard deviation and mean along x, y, z "
        "in N, its root mean square over that of the force, and frames within 15 % of the force:"
    )
    screen.print(_resultants("chain", found.chains))
    print("\nForce field, medians over the frames:")
    screen.print(_fields(found.chains))
    if found.budget:
        say(
            "\nError budget: the paper's one layer on exact markers without noise, one source of "
            "error at a time:"
        )
        screen.print(_resultants("source", found.budget))
    print("\nOther contacts, last frame, N:")
    screen.print(_others(found))
    for name, scores in found.others.items():
        for score in scores:
            for problem in score.problems:
                say(f"{name}, {score.chain}: {problem}.")


def _table(*heads: str) -> Table:
    from rich.table import Table

    table = Table(box=None, padding=(0, 1, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify="right" if number else "left", no_wrap=True)
    return table


def _resultants(title: str, rows: Sequence[Spread]) -> Table:
    from gelslim_twin.validation.score import PAPER_N, PAPER_RELATIVE

    table = _table(title, "deviation", "mean", "error", "good")
    for row in rows:
        table.add_row(
            row.name,
            " ".join(_number(v, "{:.3f}") for v in row.deviation_n),
            " ".join(_number(v, "{:+6.3f}") for v in row.bias_n),
            _number(row.relative, "{:.1%}"),
            _number(row.within, "{:.0%}"),
        )
    paper = " ".join(f"{v:5.3f}" for v in PAPER_N)
    table.add_row("the paper, measured", paper, "", f"{PAPER_RELATIVE:.0%}", "", style="bold")
    return table


def _fields(rows: Sequence[Spread]) -> Table:
    table = _table("chain", "field", "outside", "centre", "direction", "no Fz", "time")
    for row in rows:
        table.add_row(
            row.name,
            _number(row.field_error, "{:.0%}"),
            _number(row.outside_share, "{:.0%}"),
            _number(row.centre_error_mm, "{:.2f} mm"),
            _number(row.direction_error_deg, "{:.1f}°"),
            f"{row.without[2]} of {row.frames}",
            _number(row.milliseconds, "{:.0f} ms"),
        )
    return table


def _others(found: Validation) -> Table:
    table = _table("contact", "Fx", "Fy", "Fz", "field", "outside")
    for name, scores in found.others.items():
        table.add_row(name, *(f"{v:+.3f}" for v in scores[0].true_n), style="bold")
        for score in scores:
            table.add_row(
                f"  {score.chain}",
                *(_number(v, "{:+.3f}") for v in score.found_n),
                _number(score.field_error, "{:.0%}"),
                _number(score.outside_share, "{:.0%}"),
            )
    return table


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else NONE


SHOWN = {
    "ours, shape known": ("#5fb14b", "^"),
    "ours, shape, neo-Hookean": ("#1b6ca8", "o"),
    "paper, depth known": ("#e09d3c", "s"),
    "paper, shape known": ("#c23b3b", "x"),
}
"""Chains that are drawn, with colour and marker."""
_AXES = ("x", "y", "z")
_COLOURS = ("#1b6ca8", "#5fb14b", "#c23b3b")


def resultants_png(found: Validation) -> bytes:
    """Return the four panels of the paper: F_x, F_y, F_z against truth, and the F_x-F_y plane."""
    figure, axes = new_figure(9.0, 8.6, 2, 2)
    for k, axis in enumerate(axes.ravel()[:3]):
        _identity(axis, found.scores, k)
        for name, (colour, marker) in SHOWN.items():
            pairs = _pairs(found.scores, name)
            if len(pairs):
                axis.plot(
                    pairs[:, 0, k], pairs[:, 1, k], marker, color=colour, ms=4, mew=1, label=name
                )
        axis.set_xlabel(f"true F{_AXES[k]}, N")
        axis.set_ylabel(f"found F{_AXES[k]}, N")
        axis.set_aspect("equal", "datalim")
    axes[0, 0].legend(fontsize=8)
    plane = axes[1, 1]
    for name, (colour, marker) in SHOWN.items():
        pairs = _pairs(found.scores, name)
        if len(pairs):
            plane.plot(pairs[:, 1, 0], pairs[:, 1, 1], marker, color=colour, ms=4, mew=1)
    true = np.array([s.true_n for s in found.scores]).reshape(-1, 3)
    plane.plot(true[:, 0], true[:, 1], "+", color="black", ms=7, mew=0.8, label="true")
    plane.legend(fontsize=8)
    plane.set_xlabel("Fx, N")
    plane.set_ylabel("Fy, N")
    plane.set_aspect("equal", "datalim")
    figure.suptitle(
        f"Ball of {found.experiment.ball.radius_mm:g} mm pressed and slid in "
        f"{len(found.experiment.tests)} directions; dashed: identity, dotted: 15 %"
    )
    return as_png(figure)


def budget_png(budget: Sequence[Spread], paper_n: Sequence[float], paper_relative: float) -> bytes:
    """Return the error of each source, in N and as a part of the force, beside the paper's."""
    figure, (left, right) = new_figure(11.0, 0.55 * len(budget) + 1.4, 2, 1)
    rows = np.arange(len(budget))[::-1]
    for k in range(3):
        place = rows + 0.26 * (1 - k)
        left.barh(
            place, [s.deviation_n[k] for s in budget], 0.24, color=_COLOURS[k],
            label=f"F{_AXES[k]}",
        )  # fmt: skip
        left.axvline(paper_n[k], color=_COLOURS[k], ls="--", lw=1)
    left.set_yticks(rows, [s.name for s in budget])
    left.set_xlabel("standard deviation, N (dashed: the paper's)")
    left.legend(fontsize=8, loc="lower right")
    right.barh(rows, [100 * s.relative for s in budget], 0.6, color="#777777")
    right.axvline(100 * paper_relative, color="black", ls="--", lw=1)
    right.set_yticks(rows, [])
    right.set_xlabel("error over force, % (dashed: the paper's 15 %)")
    return as_png(figure)


def fields_png(found: Validation, sample: Sample) -> bytes:
    """Return the nodal forces of one frame: truth, then every chain with normal forces."""
    fields: list[tuple[str, Any]] = [("true", sample.truth.force_n)]
    for name in SHOWN:
        result = sample.results.get(name)
        if result is not None and result.field is not None:
            fields.append((name, np.nan_to_num(result.field.force_n)))
    figure, axes = new_figure(3.3 * len(fields), 3.9, len(fields), 1)
    points, touched = found.points_mm, sample.truth.touch > 0
    middle = points[touched, :2].mean(axis=0) if touched.any() else np.zeros(2)
    reach = 1.9 * max(float(np.ptp(points[touched, :2], axis=0).max() / 2), 1.5)
    most = float(np.abs(sample.truth.force_n[:, 2]).max())
    longest = float(np.hypot(*sample.truth.force_n[:, :2].T).max()) or 1.0
    near = (np.abs(points[:, :2] - middle) < reach).all(axis=1)
    shown = None
    for axis, (name, force) in zip(np.atleast_1d(axes), fields, strict=True):
        shown = axis.tripcolor(
            points[:, 0], points[:, 1], -1000 * force[:, 2], cmap="RdBu_r", shading="gouraud",
            vmin=-1000 * most, vmax=1000 * most,
        )  # fmt: skip
        axis.quiver(
            points[near, 0], points[near, 1], force[near, 0], force[near, 1], color="black",
            angles="xy", scale_units="xy", scale=longest, width=0.005,
        )  # fmt: skip
        axis.tricontour(points[:, 0], points[:, 1], touched.astype(float), [0.5],
                        colors="#2a9d2a", linewidths=1.2)  # fmt: skip
        axis.set(xlim=middle[0] + np.array([-reach, reach]), title=name, xlabel="x, mm")
        axis.set_ylim(middle[1] - reach, middle[1] + reach)
        axis.set_aspect("equal")
    figure.colorbar(shown, ax=axes, label="push per node, mN", shrink=0.8)
    figure.suptitle(f"{sample.name}, last frame: nodal forces; green: true contact")
    return as_png(figure)


def _pairs(scores: Sequence[Score], chain: str) -> Any:
    """Return true and found forces, (n, 2, 3)."""
    return np.array([(s.true_n, s.found_n) for s in scores if s.chain == chain])


def _identity(axis: Any, scores: Sequence[Score], k: int) -> None:
    values = np.array([s.true_n[k] for s in scores])
    ends = np.array([min(values.min(), 0.0), max(values.max(), 0.0)]) * 1.1
    axis.plot(ends, ends, "--", color="black", lw=0.8)
    for share in (0.85, 1.15):
        axis.plot(ends, share * ends, ":", color="#888888", lw=0.8)
