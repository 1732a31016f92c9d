"""What the pipeline knows after one frame."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as default
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import Wrench
from gelslim_force.tracking.tracks import Tracks

Array = NDArray[np.float64]
_MOST_ARROWS = 400


@dataclass(frozen=True, eq=False)
class ForceField:
    """Motion and forces at the c nodes of the pad's outer surface (`PadMesh.surface` order).

    In a notebook a force field shows itself as a picture, if matplotlib is installed.

    Attributes:
        points_mm: (c, 3) nodes at rest.
        displacement_mm: (c, 3); z is NaN where the normal motion is unknown.
        force_n: (c, 3) on the gel; z is NaN where the normal motion is unknown.
        traction_mpa: (c, 3) force divided by the node's share of the surface; the pressure is -z.
        contact: (c,) nodes in contact, as known or as found by their force.
        centre_of_pressure_mm: (2,); NaN where nothing pushes.
        slip_margin: 1 - |tangential| / (friction |normal|) of the resultant; NaN where unknown.
        misfit: Share of the motion that the masked forces do not explain; 0 for other methods.
        low_pass_mm: (2,) standard deviation of the low-pass, tangential and normal; None for
            masked forces.
    """

    points_mm: Array
    displacement_mm: Array
    force_n: Array
    traction_mpa: Array
    contact: NDArray[np.bool_]
    centre_of_pressure_mm: Array
    slip_margin: float
    misfit: float = 0.0
    low_pass_mm: Array | None = None

    def _repr_png_(self) -> bytes | None:
        """Picture for a notebook; None where matplotlib is not installed."""
        return _png(self)


@dataclass(frozen=True, eq=False)
class FrameResult:
    """What one frame gave.

    A frame that could not be read, or whose markers were not found, has no tracks, field and
    wrench. In a notebook a result with a force field shows the field.

    Attributes:
        index: Number of the frame, from 0.
        time_s: When it was taken, since the first frame or by a clock of the caller.
        tracks: The markers in the picture.
        marker_displacement_mm: (m, 3) of the followed markers, in the order of the tracks; NaN
            where unknown.
        field: Forces at the nodes of the surface.
        wrench: Resultant force and torque.
        normal_known: Whether the normal motion, and thus the normal force, is known.
        stage_ms: Time in ms per stage: track, look, normal, displace, interpolate, force, wrench.
        problems: What was wrong with the frame, one sentence each.
        extra: Further findings, such as the fitted contact patch.
        stamp_s: When it was taken, in seconds since 1970 (UTC); None if that is not known.
        sensor_s: The same by the clock of the camera or its driver; None without one.
    """

    index: int
    time_s: float
    tracks: Tracks | None = None
    marker_displacement_mm: Array | None = None
    field: ForceField | None = None
    wrench: Wrench | None = None
    normal_known: bool = False
    stage_ms: Mapping[str, float] = default(default_factory=dict)
    problems: tuple[str, ...] = ()
    extra: Mapping[str, Any] = default(default_factory=dict)
    stamp_s: float | None = None
    sensor_s: float | None = None

    @property
    def coverage(self) -> float:
        """Share of the markers seen and verified; 0 without tracks."""
        return 0.0 if self.tracks is None else self.tracks.coverage

    def _repr_png_(self) -> bytes | None:
        """Picture of the force field for a notebook; None without one, or without matplotlib."""
        return None if self.field is None else _png(self.field)


def _png(field: ForceField) -> bytes | None:
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
