"""Write the marker files of one design into a folder."""

from __future__ import annotations

from pathlib import Path

from gelslim_cad.markers.nodes import NearestNodes, render_csv
from gelslim_cad.markers.outline import Outline
from gelslim_core.files.replaced_file import replace_file
from ifem_export.markers.grid import MarkerGrid

MARKER_TABLE = "markers.csv"
FIRST_FILE = "markers-Alignment.gbr"
"""The file that is written first; it names its generator."""


def render_marker_files(
    grid: MarkerGrid, nodes: NearestNodes, outline: Outline, *, film_kerf_mm: float = 0.0
) -> dict[str, bytes]:
    """Return the content of every marker file by its name, as `render_marker_drawings` does."""
    drawings = render_marker_drawings(grid, outline, film_kerf_mm=film_kerf_mm)
    return {MARKER_TABLE: render_csv(grid, nodes), **drawings}


def render_marker_drawings(
    grid: MarkerGrid, outline: Outline, *, film_kerf_mm: float = 0.0
) -> dict[str, bytes]:
    """Return the marker files that do not depend on the mesh; the stencil's paths keep the kerf.

    Raises ValueError when a dot crosses the outline, or is narrower than the kerf.
    """
    from gelslim_cad.markers.dxf import render_dxf
    from gelslim_cad.markers.gerber import (
        render_gerber,
        render_gerber_alignment,
        render_gerber_profile,
    )
    from gelslim_cad.markers.pdf import render_pdf
    from gelslim_cad.markers.stencil import lay_out_stencil, render_stencil
    from gelslim_cad.markers.svg import render_svg

    sheet = lay_out_stencil(grid, outline)
    return {
        "markers.svg": render_svg(grid, outline),
        "markers_mirrored.svg": render_svg(grid, outline, mirrored=True),
        "markers.dxf": render_dxf(grid, outline),
        "markers.pdf": render_pdf(grid, outline),
        "markers_mirrored.pdf": render_pdf(grid, outline, mirrored=True),
        "markers-F_Paste.gbr": render_gerber(grid, outline),
        "markers-Edge_Cuts.gbr": render_gerber_profile(outline),
        "markers-Alignment.gbr": render_gerber_alignment(sheet),
        "stencil.dxf": render_stencil(sheet, film_kerf_mm),
    }


def write_marker_files(
    directory: Path, grid: MarkerGrid, nodes: NearestNodes, outline: Outline
) -> list[Path]:
    """Write every marker file into `directory` and return the paths, sorted by name.

    All files are rendered before the first one is written, and each is replaced as a whole.
    Raises ValueError as `render_marker_files`, OSError when the folder cannot be written.
    """
    files = render_marker_files(grid, nodes, outline)
    directory.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        replace_file(directory / name, content)
    return [directory / name for name in sorted(files)]
