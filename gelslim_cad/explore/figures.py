"""Pictures of an exploration: thickness against what it costs, and the map of what is feasible."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from gelslim_cad.checks import RULES
from gelslim_cad.explore.judge import REFUSED
from gelslim_cad.explore.pareto import THICKNESS, TRADES, Figure, front
from gelslim_cad.explore.space import Axis, shown
from gelslim_cad.explore.study import Exploration
from gelslim_core.figure import as_png, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREY, FRONT = "#c9ced6", "#c0392b"
PALETTE = (
    "#e69f00", "#56b4e9", "#cc79a7", "#f0e442", "#0072b2", "#d55e00", "#999999", "#8c6bb1",
    "#a6761d", "#666666", "#e7969c", "#17becf",
)  # fmt: skip
"""Colours of what binds; green is kept for feasible cells."""
LEAST_ROOM = 0.05
"""Room above and below in a Pareto plot, as a part of the value."""
MOST_TICKS = 9
MOST_PANELS = 9


def pareto_png(found: Exploration) -> bytes:
    """Thickness against keystone, blur and, where known, brightness and force error."""
    goals = [g for g in TRADES if g.name in found.columns]
    across = 2
    down = -(-len(goals) // across)
    figure, panels = new_figure(11, 4.1 * down, columns=across, rows=down)
    panels = np.ravel(panels)
    for panel, goal in itertools.zip_longest(panels, goals):
        if goal is None:
            panel.axis("off")
        else:
            _trade(panel, found, goal)
    figure.suptitle(
        f"{found.space.spec.name}: {found.space.count} designs, "
        f"{len(found.rows_where('feasible'))} feasible"
    )
    return as_png(figure)


def _trade(panel: Axes, found: Exploration, goal: Figure) -> None:
    x, y = found.columns[THICKNESS.name], found.columns[goal.name]
    for status, look in (("infeasible", {"color": GREY, "s": 6}), ("feasible", {"s": 12})):
        rows = [k for k in found.rows_where(status) if y[k] is not None]
        if not rows:
            continue
        colours: dict[str, Any] = {}
        axis = found.space.axes[0]
        if status == "feasible" and axis.numeric:
            colours = {"c": [found.columns[axis.path][k] for k in rows], "cmap": "viridis"}
        drawn = panel.scatter([x[k] for k in rows], [y[k] for k in rows], **look, **colours)
        if colours:
            bar = panel.figure.colorbar(drawn, ax=panel, pad=0.01)
            bar.set_label(axis.path.removeprefix("design."), fontsize=8)
    rows = [k for k in found.rows_where("feasible") if y[k] is not None]
    if rows:
        best = front([x[k] for k in rows], goal.costs([y[k] for k in rows]))
        line = [rows[k] for k in best]
        panel.plot(
            [x[k] for k in line], [y[k] for k in line], "o-", color=FRONT, ms=4, mfc="none",
            drawstyle="steps-post", label="Pareto front",
        )  # fmt: skip
        _focus(panel, [x[k] for k in rows], [y[k] for k in rows])
        panel.legend(loc="best", fontsize=8, framealpha=0.9)
    else:
        panel.set_title("no feasible design", fontsize=9)
    unit = f" in {goal.unit}" if goal.unit else ""
    panel.set_xlabel("finger thickness in mm")
    panel.set_ylabel(f"{goal.words}{unit}, {goal.wish} is better")
    panel.grid(alpha=0.3)


def _focus(panel: Axes, x: list[float], y: list[float]) -> None:
    """Show the feasible designs large: infeasible ones may lie anywhere.

    Values that differ less than the limit they all lie at stay a line: its scatter is the solver's.
    """
    for values, limit, least in ((x, panel.set_xlim, 0.0), (y, panel.set_ylim, LEAST_ROOM)):
        low, high = min(values), max(values)
        room = max(0.25 * (high - low), least * abs(high)) or 0.1 * abs(high) or 1.0
        limit(low - room, high + room)


def feasibility_png(found: Exploration) -> bytes:
    """Feasible cells green, the others in the colour of what binds, over the first two axes.

    One panel per value of the third axis; where there are more axes or values, a cell is feasible
    if one of its designs is, and else shows what binds most often.
    """
    from matplotlib.patches import Patch

    axes = found.space.axes
    cells = _cells(found)
    panels_over = axes[2] if len(axes) > 2 else None
    places = list(range(cells.shape[2]))
    if len(places) > MOST_PANELS:
        places = sorted({round(p) for p in np.linspace(0, cells.shape[2] - 1, MOST_PANELS)})
    names = [n for n in dict.fromkeys(cells.ravel()) if n]
    colours = dict(zip(names, itertools.cycle(PALETTE), strict=False))
    across = min(3, len(places))
    down = -(-len(places) // across)
    figure, panels = new_figure(1.5 + 4.2 * across, 1.7 + 3.6 * down, across, down)
    panels = np.ravel(panels)
    for panel, k in itertools.zip_longest(panels, places):
        if k is None:
            panel.axis("off")
            continue
        _map(panel, cells[:, :, k], axes, colours)
        if panels_over is not None:
            label = panels_over.path.removeprefix("design.")
            panel.set_title(f"{label} = {shown(panels_over.values[k])}", fontsize=9)
    if len(axes) > len(cells.shape):
        others = ", ".join(a.path.removeprefix("design.") for a in axes[cells.ndim :])
        figure.suptitle(f"feasible for at least one value of {others}", fontsize=10)
    marks: list[Any] = [Patch(color="#2e9e5b", label="feasible, within the black line")]
    marks += [Patch(color=colours[n], label=_told(n)) for n in names]
    legend_below(figure, marks, "feasible, or what binds")
    return as_png(figure)


def legend_below(figure: Any, marks: list[Any], title: str) -> Any:
    """A legend under the panels in as many columns, at most three, as the figure is wide for.

    The figure grows by the rows that this takes beyond the first.
    """
    row_in = 0.18
    for columns in range(min(3, len(marks)), 0, -1):
        legend = figure.legend(
            handles=marks, loc="outside lower center", ncols=columns, fontsize=8, title=title
        )
        wide = legend.get_window_extent(figure.canvas.get_renderer()).width
        if wide <= figure.bbox.width or columns == 1:
            break
        legend.remove()
    figure.set_figheight(figure.get_figheight() + row_in * (-(-len(marks) // columns) - 1))
    return legend


def _told(binding: str) -> str:
    """A rule by its title, anything else as it is."""
    if binding == REFUSED:
        return "refused by the spec (column reason)"
    return f"{RULES[binding].title} ({binding})" if binding in RULES else binding


def _cells(found: Exploration) -> Any:
    """What binds (first, second, third axis); empty text where a design is feasible."""
    shape = (*found.space.shape, 1, 1, 1)[: max(3, len(found.space.axes))]
    grid = np.array(
        [
            "" if s == "feasible" else b
            for s, b in zip(found.columns["status"], found.columns["binding"], strict=True)
        ],
        dtype=object,
    ).reshape(*shape[:3], -1)
    cells = np.empty(grid.shape[:3], dtype=object)
    for place in np.ndindex(cells.shape):
        values = list(grid[place])
        cells[place] = "" if "" in values else max(sorted(set(values)), key=values.count)
    return cells


def _map(panel: Axes, cells: Any, axes: tuple[Axis, ...], colours: dict[str, str]) -> None:
    from matplotlib.colors import to_rgb

    image = np.array(
        [[to_rgb(colours[n] if n else "#2e9e5b") for n in column] for column in cells.T]
    )
    panel.imshow(image, origin="lower", aspect="auto", interpolation="nearest")
    for ends in borders(cells == ""):
        panel.plot(*ends, color="black", lw=1.6, solid_capstyle="projecting")
    first, second = axes[0], axes[1] if len(axes) > 1 else None
    _ticks(panel.set_xticks, first)
    panel.set_xlabel(first.path.removeprefix("design."))
    if second is None:
        panel.set_yticks([])
    else:
        _ticks(panel.set_yticks, second)
        panel.set_ylabel(second.path.removeprefix("design."))


def borders(feasible: Any) -> list[tuple[list[float], list[float]]]:
    """Edges between feasible cells (columns, rows) and others, as ends in x and in y: for eyes that
    do not tell the colours apart."""
    found = [
        ([k + 0.5, k + 0.5], [j - 0.5, j + 0.5])
        for k, j in np.argwhere(feasible[1:] != feasible[:-1])
    ]
    across = np.argwhere(feasible[:, 1:] != feasible[:, :-1])
    return found + [([k - 0.5, k + 0.5], [j + 0.5, j + 0.5]) for k, j in across]


def _ticks(put: Any, axis: Axis) -> None:
    count = len(axis.values)
    places = range(0, count, -(-count // MOST_TICKS))
    put(places, [shown(axis.values[p]) for p in places], fontsize=8)
