"""Figures made without a display; the same content gives the same bytes."""

from __future__ import annotations

import io
from typing import Any

DPI = 150


def new_figure(
    width_in: float, height_in: float, columns: int = 1, rows: int = 1
) -> tuple[Any, Any]:
    """A matplotlib figure and its axes (an array of them for several columns or rows)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns)


def as_png(figure: Any, title: str | None = None) -> bytes:
    """The figure as PNG; a `title` is stored in its metadata."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream = io.BytesIO()
    # `savefig` would lay the figure out in a first pass of its own and then draw it.
    FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None, "Title": title})
    return stream.getvalue()
