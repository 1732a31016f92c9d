"""The SVG read back with an XML parser, and its outline by the rules of the SVG standard."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.svg import render_svg
from ifem_export.markers.grid import build_marker_grid

NS = {"s": "http://www.w3.org/2000/svg"}


def group(root, name):
    return root.find(f".//s:g[@id='{name}']", NS)


def circles(root):
    found = group(root, "markers").findall("s:circle", NS)
    return np.array([[float(c.get(k)) for k in ("cx", "cy", "r")] for c in found])


def origin(root):
    text = root.find("s:g", NS).get("transform")
    return [float(v) for v in re.fullmatch(r"translate\((\S+) (\S+)\)", text).groups()]


def test_page_is_in_millimetres_one_to_one(grid, outline):
    root = ET.fromstring(render_svg(grid, outline))
    wide, tall = (
        float(re.fullmatch(r"([\d.]+)mm", root.get(k)).group(1)) for k in ("width", "height")
    )
    assert [float(v) for v in root.get("viewBox").split()] == [0, 0, wide, tall]
    assert wide > 24 + 8
    assert tall > 26 + 8
    # Everything that is drawn lies on the page.
    at = circles(root)[:, :2] + origin(root)
    assert (at > 0).all()
    assert (at < [wide, tall]).all()


@pytest.mark.parametrize(("mirrored", "sign"), [(False, -1.0), (True, 1.0)])
def test_dots_are_where_the_grid_says_and_nowhere_else(grid, outline, mirrored, sign):
    root = ET.fromstring(render_svg(grid, outline, mirrored=mirrored))
    found = circles(root)
    np.testing.assert_allclose(found[:, 0], grid.positions_mm[:, 0], atol=1e-6)
    np.testing.assert_allclose(found[:, 1], sign * grid.positions_mm[:, 1], atol=1e-6)
    np.testing.assert_allclose(2 * found[:, 2], grid.diameter_mm, atol=1e-6)
    assert len(root.findall(".//s:circle", NS)) == len(grid)
    anchors = root.findall(".//s:circle[@class='anchor']", NS)
    assert [int(a.get("id")[1:]) for a in anchors] == np.flatnonzero(grid.kind).tolist()


def test_each_view_says_which_it_is_and_where_the_tip_is(grid, outline):
    for mirrored, words in ((False, "Outside view"), (True, "Inside view (mirrored)")):
        root = ET.fromstring(render_svg(grid, outline, mirrored=mirrored))
        texts = [t.text for t in group(root, "notes").findall("s:text", NS)]
        assert "tip" in texts
        assert any(t.startswith(words) for t in texts)
        corners = group(root, "notes").find("s:polygon", NS).get("points").split()
        xy = np.array([[float(v) for v in c.split(",")] for c in corners])
        assert xy[:, 0].min() > 12.0
        assert xy[np.argmax(xy[:, 0]), 1] == pytest.approx(0.0, abs=1e-6)


def test_outline_arcs_turn_the_right_way(grid, outline):
    path = group(ET.fromstring(render_svg(grid, outline)), "outline").find("s:path", NS).get("d")
    points = np.array(walk(path)) * [1, -1]
    # Each point of the walked path lies on the outline: 3 mm corners inside the rectangle.
    inner = np.clip(points, [-9, -10], [9, 10])
    np.testing.assert_allclose(np.hypot(*(points - inner).T), 3.0, atol=1e-4)


def walk(path):
    """Follow M, L, A (circular) and Z by the endpoint rules of SVG 1.1, appendix F.6.5."""
    tokens = iter(path.split())
    here, points = None, []
    for token in tokens:
        if token == "Z":
            break
        if token in "ML":
            here = np.array([float(next(tokens)), float(next(tokens))])
            points.append(here)
            continue
        assert token == "A"
        rx, ry, _, large, sweep, x, y = (float(next(tokens)) for _ in range(7))
        assert rx == ry
        end = np.array([x, y])
        half = (here - end) / 2
        factor = np.sqrt(max(rx**2 / (half @ half) - 1, 0.0)) * (-1 if large == sweep else 1)
        centre = factor * np.array([half[1], -half[0]]) + (here + end) / 2
        start, stop = (np.arctan2(*(p - centre)[::-1]) for p in (here, end))
        angle = (stop - start) % (2 * np.pi) if sweep else -((start - stop) % (2 * np.pi))
        turns = start + angle * np.linspace(0.1, 1.0, 10)
        points += list(centre + rx * np.column_stack([np.cos(turns), np.sin(turns)]))
        here = end
    return points


def test_scale_bar_is_10_mm_long(grid, outline):
    bar = group(ET.fromstring(render_svg(grid, outline)), "scale-bar").find(
        "s:path[@id='scale-bar-10mm']", NS
    )
    assert re.fullmatch(r"M \S+ \S+ h 10", bar.get("d"))


def test_registration_crosses_lie_outside_the_gel(grid, outline):
    crosses = group(ET.fromstring(render_svg(grid, outline)), "registration").findall("s:path", NS)
    at = np.array([[float(v) for v in c.get("d").split()[1:3]] for c in crosses])
    np.testing.assert_allclose(np.abs(at), np.tile([16.0, 17.0], (4, 1)), atol=1e-3)


def test_a_dot_that_crosses_the_outline_is_refused(outline):
    grid = build_marker_grid(27, 27, 1.0, 0.4)
    with pytest.raises(ValueError, match=r"\b729\b"):
        render_svg(grid, outline)
    with pytest.raises(ValueError, match="729 of 729"):
        render_svg(grid, Outline.rounded_rectangle(0.1, 0.1))
