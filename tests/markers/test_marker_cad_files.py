"""DXF, stencil, Gerber and CSV, each read back with another reader."""

import csv
import io
import re
import uuid

import ezdxf
import numpy as np
import pytest
from outline_area import area_mm2
from pygerber.gerberx3.api.v2 import FileTypeEnum, GerberFile

from gelslim_cad.markers.dxf import render_dxf
from gelslim_cad.markers.gerber import (
    render_gerber,
    render_gerber_alignment,
    render_gerber_profile,
)
from gelslim_cad.markers.nodes import COLUMNS, nearest_nodes, render_csv
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.stencil import lay_out_stencil, render_stencil


def reopened(tmp_path, content):
    path = tmp_path / "written.dxf"
    path.write_bytes(content)
    document = ezdxf.readfile(path)
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    assert document.dxfversion == "AC1024"
    assert document.header["$INSUNITS"] == 4
    return document


def circles(document, layer):
    found = document.modelspace().query(f'CIRCLE[layer=="{layer}"]')
    return np.array([[c.dxf.center.x, c.dxf.center.y, 2 * c.dxf.radius] for c in found])


def closed_area(polyline):
    assert polyline.closed
    points = polyline.get_points("xyb")
    return area_mm2(Outline([p[:2] for p in points], [p[2] for p in points]))


def test_dxf_has_the_dots_and_a_closed_outline(tmp_path, grid, outline):
    document = reopened(tmp_path, render_dxf(grid, outline))
    found = circles(document, "MARKERS")
    np.testing.assert_allclose(found[:, :2], grid.positions_mm, atol=1e-6)
    np.testing.assert_allclose(found[:, 2], grid.diameter_mm, atol=1e-6)
    assert len(document.modelspace().query("CIRCLE")) == len(grid)
    (border,) = document.modelspace().query('*[layer=="OUTLINE"]')
    assert border.dxftype() == "LWPOLYLINE"
    assert closed_area(border) == pytest.approx(area_mm2(outline), rel=1e-6)
    words = [t.dxf.text for t in document.modelspace().query("TEXT")]
    assert any("Outside" in w for w in words)


def test_stencil_is_cuttable(tmp_path, grid, outline):
    sheet = lay_out_stencil(grid, outline)
    document = reopened(tmp_path, render_stencil(sheet))
    holes = circles(document, "HOLES")
    np.testing.assert_allclose(holes[:, :2], grid.positions_mm, atol=1e-6)
    np.testing.assert_allclose(holes[:, 2], grid.diameter_mm, atol=1e-6)
    pins = circles(document, "ALIGNMENT")
    np.testing.assert_allclose(pins[:, 2], 3.0, atol=1e-6)
    assert not outline.contains(pins[:, :2]).any()
    assert sheet.sheet.contains(pins[:, :2]).all()
    (border,) = document.modelspace().query('*[layer=="SHEET"]')
    wide, tall, radius = 48.0, 50.0, 2.0
    assert closed_area(border) == pytest.approx(wide * tall - (4 - np.pi) * radius**2, rel=1e-5)
    for entity in document.modelspace():
        assert entity.dxftype() == "CIRCLE" or entity.closed


def test_stencil_pins_fit_in_one_way_only(grid, outline):
    square = Outline.rounded_rectangle(27.0, 27.0)
    for gel in (outline, square):
        pins = lay_out_stencil(grid, gel).alignment_mm
        for turn in range(4):
            for flip in (1.0, -1.0):
                if turn == 0 and flip == 1.0:
                    continue
                c, s = np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)
                moved = (pins @ np.array([[c, -s], [s, c]])) * [1.0, flip]
                moved += pins.mean(axis=0) - moved.mean(axis=0)
                miss = np.linalg.norm(pins[:, None] - moved[None], axis=-1).min(axis=1).max()
                assert miss > 1.0


def commands(content, file_type):
    parsed = GerberFile.from_str(content.decode(), FileTypeEnum.INFER_FROM_ATTRIBUTES).parse()
    assert parsed.get_file_type() == file_type
    return parsed, list(parsed._command_buffer)


def flashes(drawn):
    return np.array(
        [
            [float(v.value) for v in (d.flash_point.x, d.flash_point.y, d.aperture.diameter)]
            for d in drawn
        ]
    )


def test_gerber_flashes_each_dot_once(grid, outline):
    content = render_gerber(grid, outline)
    _, drawn = commands(content, FileTypeEnum.PASTE)
    assert {type(d).__name__ for d in drawn} == {"Flash2"}
    found = flashes(drawn)
    expected = np.column_stack([grid.positions_mm, grid.diameter_mm])
    for table in (found, expected):
        table[:] = np.round(table, 6) + 0.0
    np.testing.assert_allclose(
        found[np.lexsort(found.T)], expected[np.lexsort(expected.T)], atol=2e-6
    )
    assert content.count(b"%ADD") == 2


def test_gerber_profile_is_one_closed_path_with_true_arcs(outline):
    content = render_gerber_profile(outline)
    parsed, drawn = commands(content, FileTypeEnum.PROFILE)
    assert [type(d).__name__ for d in drawn].count("CCArc2") == 4
    assert len(drawn) == 8
    starts = [(float(d.start_point.x.value), float(d.start_point.y.value)) for d in drawn]
    ends = [(float(d.end_point.x.value), float(d.end_point.y.value)) for d in drawn]
    assert ends == [*starts[1:], starts[0]]
    for arc in drawn:
        if type(arc).__name__ != "CCArc2":
            continue
        centre = np.array([float(arc.center_point.x.value), float(arc.center_point.y.value)])
        np.testing.assert_allclose(np.abs(centre), [9.0, 10.0], atol=2e-6)
    info = parsed.get_info()
    assert float(info.width_mm) == pytest.approx(24.0, abs=0.11)
    assert float(info.height_mm) == pytest.approx(26.0, abs=0.11)


def test_gerber_alignment_holes_match_the_stencil(grid, outline):
    sheet = lay_out_stencil(grid, outline)
    _, drawn = commands(render_gerber_alignment(sheet), FileTypeEnum.OTHER)
    np.testing.assert_allclose(
        flashes(drawn), np.column_stack([sheet.alignment_mm, np.full(4, 3.0)]), atol=2e-6
    )


@pytest.mark.parametrize("layer", ["paste", "profile", "alignment"])
def test_gerber_files_carry_their_attributes(layer, grid, outline):
    """Each of the header's attributes once, before the first command, with legal values."""
    made, function, use = {
        "paste": (render_gerber(grid, outline), "Paste,Top", "Material"),
        "profile": (render_gerber_profile(outline), "Profile,NP", "Profile"),
        "alignment": (
            render_gerber_alignment(lay_out_stencil(grid, outline)),
            "Other,Alignment",
            "Other,Alignment hole",
        ),
    }[layer]
    text = made.decode("ascii")
    found = dict(re.findall(r"%TF\.(\w+),([^*%]*)\*%", text))
    assert found["FileFunction"] == function
    assert found["FilePolarity"] == "Positive"
    assert found["Part"].split(",")[0] in ("Single", "Array", "Coupon", "Other")
    name, identifier, revision = found["ProjectId"].split(",")
    assert (name, revision) == ("marker print", "1")
    assert str(uuid.UUID(identifier)) == identifier
    assert found["SameCoordinates"] == "sensor frame"
    assert len(found["GenerationSoftware"].split(",")) == 3
    assert text.count("%TF.") == len(found) == 6
    assert text.rindex("%TF.") < text.index("%FSLAX46Y46*%") < text.index("D10*")
    uses = re.findall(r"%TA\.AperFunction,([^*]+)\*%", text)
    assert set(uses) == {use}
    assert len(uses) == text.count("%ADD")


def test_gerber_refuses_a_coordinate_beyond_the_format():
    with pytest.raises(ValueError, match="20000 mm"):
        render_gerber_profile(Outline.polygon([(0, 0), (2e4, 0), (0, 1)]))


def test_csv_carries_every_marker_and_its_node(grid, nodes):
    rows = list(csv.DictReader(io.StringIO(render_csv(grid, nodes).decode("ascii"))))
    assert tuple(rows[0]) == COLUMNS
    assert [int(r["marker_id"]) for r in rows] == list(range(len(grid)))
    xy = np.array([[float(r["x_mm"]), float(r["y_mm"])] for r in rows])
    np.testing.assert_allclose(xy, grid.positions_mm, atol=1e-6)
    lattice = np.array([[int(r["row"]), int(r["column"])] for r in rows])
    np.testing.assert_array_equal(lattice, np.column_stack([grid.row, grid.column]))
    assert [r["kind"] == "anchor" for r in rows] == (grid.kind == 1).tolist()
    np.testing.assert_allclose([float(r["diameter_mm"]) for r in rows], grid.diameter_mm)
    assert [int(r["node_id"]) for r in rows] == nodes.node_id.tolist()


def test_nearest_nodes_agree_with_brute_force_and_break_ties_by_id(grid, nodes):
    axis = np.linspace(-12, 12, 43)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    apart = np.linalg.norm(grid.positions_mm[:, None] - points[None], axis=-1)
    least = apart.min(axis=1)
    np.testing.assert_allclose(nodes.distance_mm, least, atol=1e-12)
    first = [int(np.flatnonzero(a <= low + 1e-9)[0]) for a, low in zip(apart, least, strict=True)]
    np.testing.assert_array_equal(nodes.node_id - 100, first)
    square = np.array([(1.0, 1), (1, -1), (-1, 1), (-1, -1)])
    for kind in (np.int32, np.int64):
        middle = nearest_nodes(np.zeros((1, 2)), square, np.array([9, 4, 7, 5], dtype=kind))
        assert middle.node_id.tolist() == [4]
