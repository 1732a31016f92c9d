"""Forces from pictures by Mitsuba 3 beside the truth: scores, table and figure of the page."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Record = Mapping[str, Any]
TRACED, CALIBRATED = ("light as traced", "light calibrated")
"""What is told of the light beside the camera's calibration."""
GEL_KNOWN = "gel known, light as traced"
LINEAR = "light as traced, `--gel linear`"
"""Of contacts at large strain only."""
COLOURS = {TRACED: "#c4580a", CALIBRATED: "#1f4e8c", GEL_KNOWN: "#2d8a57"}
LABELS = ("F_x", "F_y", "F_z")
_NORMAL_95 = 1.96


@dataclass(frozen=True, eq=False)
class Scores:
    """Contacts found with one light, beside the truth; NaN where a component is unknown.

    Attributes:
        truth: (n, 6) force in N and torque in N mm.
        found: (n, 6).
        sigma: (n, 6).
        centre_off_mm: (n,) distance of the centres of pressure.
    """

    truth: Array
    found: Array
    sigma: Array
    centre_off_mm: Array

    @classmethod
    def of(cls, record: Record, way: str, kind: str = "") -> Scores:
        """Those of the contacts whose name starts with `kind`."""
        rows = record["ways"][way]["rows"]
        pairs = [
            (true, row)
            for true, row in zip(record["truth"], rows, strict=True)
            if row is not None and true["name"].startswith(kind)
        ]
        truth, found, sigma = (
            np.array(part, dtype=float).reshape(-1, 6)
            for part in (
                [true["wrench"] for true, _ in pairs],
                [row["wrench"] for _, row in pairs],
                [row["sigma"] for _, row in pairs],
            )
        )
        centres = [[true["centre_mm"], row["centre_mm"]] for true, row in pairs]
        off = np.diff(np.array(centres, dtype=float).reshape(-1, 2, 2), axis=1)[:, 0]
        return cls(truth, found, sigma, np.hypot(*off.T))

    @property
    def z(self) -> Array:
        """(n, 6) error over the standard deviation."""
        return (self.found - self.truth) / self.sigma

    @property
    def unknown(self) -> int:
        """Contacts whose normal force is unknown."""
        return int(np.isnan(self.found[:, 2]).sum())

    @property
    def normal_error(self) -> Array:
        """Relative errors of the normal forces that are known."""
        every = self.found[:, 2] / self.truth[:, 2] - 1
        return np.asarray(every[np.isfinite(every)])

    @property
    def shear_error_n(self) -> Array:
        """Lengths of the errors of the tangential force."""
        return np.hypot(*(self.found - self.truth)[:, :2].T)


def table(record: Record) -> str:
    """Errors and scores as a Markdown table."""
    linear = {"given tractions": "press", "balls": "ball"}
    kinds = {**linear, "shapes at large strain": "shape", "**all**": ""}
    lines = [
        f"The finger `gelslim2` with {record['rays'] / 1e6:.3g} million rays of each colour on its "
        "gel; three numbers are those of F_x, F_y and F_z.",
        "",
        "| contacts | number | F_z unknown | median \\|error\\| of F_z | mean error of F_z | "
        "median error of the shear, mN | centre of pressure off, mm | RMS of error/σ | "
        "within 1.96 σ |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for way in record["ways"]:
        for name, kind in kinds.items():
            some = Scores.of(record, way, kind)
            if len(some.truth) and (way != LINEAR or kind):
                lines.append(_line(f"{way}, {name}", some))
    return "\n".join(lines)


def _line(name: str, some: Scores) -> str:
    z = some.z[:, :3]
    rms = [math.sqrt(np.nanmean(column**2)) for column in z.T]
    held = [100 * float(np.nanmean(np.abs(c[np.isfinite(c)]) < _NORMAL_95)) for c in z.T]
    error = some.normal_error
    cells = [
        name,
        f"{len(some.truth)}",
        f"{some.unknown}",
        f"{100 * np.median(np.abs(error)):.1f} %",
        f"{100 * error.mean():+.1f} %",
        f"{1000 * np.nanmedian(some.shear_error_n):.2g}",
        f"{np.nanmedian(some.centre_off_mm):.2f}",
        ", ".join(f"{value:.2f}" for value in rms),
        ", ".join(f"{value:.0f}" for value in held) + " %",
    ]
    return "| " + " | ".join(cells) + " |"


def drawn(record: Record) -> bytes:
    """Found against true forces with their deviations, a panel for each direction, as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(11.0, 3.9), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 3)
    for k, axes in enumerate(panels):
        for way, shift in zip(COLOURS, (-0.004, 0.0, 0.004), strict=True):
            some = Scores.of(record, way)
            axes.errorbar(
                some.truth[:, k] + shift, some.found[:, k], some.sigma[:, k],
                fmt="o", ms=3.5, lw=0.9, color=COLOURS[way], label=way,
            )  # fmt: skip
        low, high = axes.get_xlim()
        axes.plot([low, high], [low, high], color="#9aa3ad", lw=0.8, zorder=0)
        axes.set(xlabel=f"true ${LABELS[k]}$, N", ylabel=f"found ${LABELS[k]}$, N")
    panels[0].legend(fontsize=8, frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
