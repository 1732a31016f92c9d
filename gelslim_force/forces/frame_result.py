"""What the pipeline knows after one frame."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as default
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.immutable import Immutable
from gelslim_force.forces.record import RecordReader, plain
from gelslim_force.forces.wrench import Wrench
from gelslim_force.tracking.tracks import Tracks

Array = NDArray[np.float64]
RECORD_FORMAT = "gelslim-frame-result/1"
_MOST_ARROWS = 400


@dataclass(frozen=True, eq=False)
class ForceField(Immutable):
    """Motion and forces at the c nodes of the pad's outer surface (`PadMesh.surface` order).

    In a notebook a force field shows itself as a picture, if matplotlib is installed. Its arrays
    are read-only.

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
        by_linear_law: Whether a deep contact has the forces of a linear gel because the law at
            large strain knows no such motion.
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
    by_linear_law: bool = False

    def to_record(self) -> dict[str, Any]:
        """The attributes as values that JSON holds; null where unknown."""
        record: dict[str, Any] = plain(self)
        return record

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> ForceField:
        """Read what `to_record` gave. Raises RecordError."""
        read = RecordReader(record, "field")
        points = read.reals("points_mm", None, 3)
        count = len(points)
        return cls(
            points_mm=points,
            displacement_mm=read.reals("displacement_mm", count, 3),
            force_n=read.reals("force_n", count, 3),
            traction_mpa=read.reals("traction_mpa", count, 3),
            contact=read.truths("contact", count),
            centre_of_pressure_mm=read.reals("centre_of_pressure_mm", 2),
            slip_margin=read.real("slip_margin"),
            misfit=read.real("misfit"),
            low_pass_mm=read.known_reals("low_pass_mm", 2),
            by_linear_law="by_linear_law" in record and bool(read.truths("by_linear_law")),
        )

    def summary(self) -> dict[str, Any]:
        """How the field was smoothed, as plain numbers; empty for masked forces."""
        if self.low_pass_mm is None:
            return {}
        return {"low_pass_mm": [round(float(width), 4) for width in self.low_pass_mm]}

    def _repr_png_(self) -> bytes | None:
        """Picture for a notebook; None where matplotlib is not installed."""
        return _png(self)


@dataclass(frozen=True, eq=False)
class FrameResult(Immutable):
    """What one frame gave.

    A frame that could not be read, or whose markers were not found, has no tracks, field and
    wrench. In a notebook a result with a force field shows the field. Arrays and mappings are
    read-only.

    Attributes:
        index: Number of the frame, from 0.
        time_s: When it was taken, since the first frame or by a clock of the caller.
        tracks: The markers in the picture.
        marker_displacement_mm: (m, 3) of the followed markers, in the order of the tracks; NaN
            where unknown.
        field: Forces at the nodes of the surface.
        wrench: Resultant force and torque.
        normal_known: Whether the normal motion, and thus the normal force, is known.
        stage_ms: Time in ms per stage: track, drift, look, normal, displace, interpolate, force,
            wrench.
        problems: What was wrong with the frame, one sentence each.
        extra: Further findings, such as the fitted contact patch and the drift.
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

    def to_record(self) -> dict[str, Any]:
        """All attributes as values that JSON holds, for messages and logs of other programs.

        Arrays are lists, what is unknown is null, and `format` names the schema, which
        `docs/force_formats.md` describes. The values of `extra` become lists, objects, numbers and
        text.
        """
        return {"format": RECORD_FORMAT, **plain(self)}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> FrameResult:
        """Read what `to_record` gave. Raises RecordError for a field that is missing or wrong."""
        read = RecordReader(record, "result")
        if read.value("format") != RECORD_FORMAT:
            raise read.wrong("format", RECORD_FORMAT)
        tracks, field, wrench = (read.value(name) for name in ("tracks", "field", "wrench"))
        problems, stages = read.value("problems"), RecordReader(read.value("stage_ms"), "stage_ms")
        if not isinstance(problems, list) or not all(isinstance(p, str) for p in problems):
            raise read.wrong("problems", "a list of texts")
        return cls(
            index=int(read.integers("index")),
            time_s=read.real("time_s"),
            tracks=None if tracks is None else _tracks(tracks),
            marker_displacement_mm=read.known_reals("marker_displacement_mm", None, 3),
            field=None if field is None else ForceField.from_record(field),
            wrench=None if wrench is None else Wrench.from_record(wrench),
            normal_known=bool(read.truths("normal_known")),
            stage_ms={name: stages.real(name) for name in stages.record},
            problems=tuple(problems),
            extra=RecordReader(read.value("extra"), "extra").record,
            stamp_s=read.known_real("stamp_s"),
            sensor_s=read.known_real("sensor_s"),
        )

    @property
    def coverage(self) -> float:
        """Share of the markers seen and verified; 0 without tracks."""
        return 0.0 if self.tracks is None else self.tracks.coverage

    def _repr_png_(self) -> bytes | None:
        """Picture of the force field for a notebook; None without one, or without matplotlib."""
        return None if self.field is None else _png(self.field)


def _tracks(record: Mapping[str, Any]) -> Tracks:
    read = RecordReader(record, "tracks")
    status = read.integers("status", None)
    count = len(status)
    return Tracks(
        read.reals("positions_px", count, 2),
        read.reals("displacement_px", count, 2),
        status,
        read.integers("dots", count),
    )


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
