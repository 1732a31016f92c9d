"""The PDF read with pypdf, and rasterised to measure what a ruler would measure."""

import io
import shutil
import subprocess

import numpy as np
import pypdf
import pytest
from scipy import ndimage

from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.pdf import SCALE_BAR_MM, render_pdf
from ifem_export.markers.grid import build_marker_grid

DPI = 400
PX_MM = 25.4 / DPI
needs_poppler = pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="pdftoppm is missing")


def page_mm(content):
    (page,) = pypdf.PdfReader(io.BytesIO(content)).pages
    return float(page.mediabox.width) * 25.4 / 72, float(page.mediabox.height) * 25.4 / 72


@pytest.mark.parametrize(
    ("size_mm", "expected_mm"),
    [
        ((24, 26), (210, 297)),
        ((200, 40), (297, 210)),
        ((260, 120), (297, 420)),
        ((900, 300), (936, 426)),
    ],
)
def test_page_is_the_smallest_paper_that_holds_the_gel(size_mm, expected_mm):
    grid = build_marker_grid(8, 8, 0.9, 0.4)
    content = render_pdf(grid, Outline.rounded_rectangle(*size_mm))
    assert page_mm(content) == pytest.approx(expected_mm, abs=0.05)


def test_text_tells_how_to_print_and_which_side(grid, outline):
    for mirrored, view in ((False, "Outside view"), (True, "Inside view (mirrored)")):
        reader = pypdf.PdfReader(io.BytesIO(render_pdf(grid, outline, mirrored=mirrored)))
        text = reader.pages[0].extract_text()
        for words in ("Print at 100 %", "50 mm", "tip", view, f"{len(grid)} dots"):
            assert words in text
        assert reader.trailer["/Root"]["/ViewerPreferences"]["/PrintScaling"] == "/None"


def raster(tmp_path, content):
    """Return the page as grey values with rows from the bottom up."""
    path = tmp_path / "page.pdf"
    path.write_bytes(content)
    out = subprocess.run(
        ["pdftoppm", "-r", str(DPI), "-gray", str(path)], capture_output=True, check=True
    ).stdout
    kind, size, depth, pixels = out.split(b"\n", 3)
    assert (kind, depth) == (b"P5", b"255")
    wide, tall = map(int, size.split())
    return np.frombuffer(pixels, np.uint8)[: wide * tall].reshape(tall, wide)[::-1]


def longest_run(lines):
    best = 0
    for line in lines:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(int), [0]])))
        best = max([best, *(edges[1::2] - edges[::2])])
    return best


@needs_poppler
@pytest.mark.parametrize(("mirrored", "sign"), [(False, 1.0), (True, -1.0)])
def test_printed_page_measures_true(tmp_path, grid, outline, mirrored, sign):
    dark = raster(tmp_path, render_pdf(grid, outline, mirrored=mirrored)) < 128
    corner = dark[: int(75 / PX_MM), : int(80 / PX_MM)]
    assert longest_run(corner) * PX_MM == pytest.approx(SCALE_BAR_MM, abs=0.2)
    assert longest_run(corner.T) * PX_MM == pytest.approx(SCALE_BAR_MM, abs=0.2)

    low, high = int(120 / PX_MM), int(220 / PX_MM)
    left, right = int(93.5 / PX_MM), int(116.5 / PX_MM)
    labels, count = ndimage.label(dark[low:high, left:right])
    centres = np.array(ndimage.center_of_mass(labels > 0, labels, np.arange(1, count + 1)))
    area = ndimage.sum_labels(labels > 0, labels, np.arange(1, count + 1)) * PX_MM**2
    dots = (area > 0.07) & (area < 0.5)
    xy = (centres[dots][:, ::-1] + 0.5) * PX_MM
    xy -= (xy.min(axis=0) + xy.max(axis=0)) / 2
    expected = grid.positions_mm * [1.0, sign]
    assert len(xy) == len(grid)
    apart = np.linalg.norm(xy[:, None] - expected[None], axis=-1)
    assert apart.min(axis=1).max() < 0.06
    size = np.sqrt(4 * area[dots] / np.pi)
    np.testing.assert_allclose(size, grid.diameter_mm[apart.argmin(axis=1)], atol=0.05)
