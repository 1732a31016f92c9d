"""Picture of a force field, for notebooks."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_force.forces.frame_result import ForceField

Array = NDArray[np.float64]
_MOST_ARROWS = 400


def force_field_png(field: ForceField) -> bytes | None:
    """Draw pressure as colour and tangential traction as arrows, seen from outside the gel.

    Where the normal force is unknown, colour shows the size of the tangential traction.

    Returns:
        The PNG file's bytes; None where matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return None
    figure = Figure(figsize=(5.0, 4.0), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    _draw(figure, figure.add_subplot(), field)
    with io.BytesIO() as file:
        canvas.print_png(file)
        return file.getvalue()


def _draw(figure: Any, axes: Any, field: ForceField) -> None:
    x, y = field.points_mm[:, 0], field.points_mm[:, 1]
    tangential_kpa = 1000 * field.traction_mpa[:, :2]
    pressure_kpa = -1000 * field.traction_mpa[:, 2]
    shown, label = pressure_kpa, "pressure in kPa"
    if not np.isfinite(pressure_kpa).all():
        shown, label = np.hypot(*tangential_kpa.T), "tangential traction in kPa"
    colours = axes.pcolormesh(*_on_lattice(x, y, shown), shading="nearest", cmap="viridis")
    figure.colorbar(colours, ax=axes, label=label)
    step = 1 + len(x) // _MOST_ARROWS
    axes.quiver(x[::step], y[::step], *tangential_kpa[::step].T, color="white", pivot="mid")
    axes.set(xlabel="x in mm", ylabel="y in mm", aspect="equal")


def _on_lattice(x: Array, y: Array, values: Array) -> tuple[Array, Array, Array]:
    """Coordinates (nx,), (ny,) and values (ny, nx) of nodes (c,) on a lattice; NaN between them."""
    columns, i = np.unique(np.round(x, 6), return_inverse=True)
    rows, j = np.unique(np.round(y, 6), return_inverse=True)
    grid = np.full((len(rows), len(columns)), np.nan)
    grid[j, i] = values
    return columns, rows, grid
