"""DXF outlines, read back with ezdxf and measured with shapely and closed forms."""

from __future__ import annotations

import io
import math

import cadquery as cq
import export_samples as samples
import ezdxf
import pytest
from ezdxf.path import make_path
from shapely.geometry import Polygon

from gelslim_cad.export import ExportError
from gelslim_cad.export.contour import frame_of
from gelslim_cad.export.outline import flat_face, kept_area_mm2, outline_dxf_bytes
from gelslim_cad.markers.kerf import KerfError
from gelslim_cad.proof.outline import prove_dxf


def read(data: bytes):
    document = ezdxf.read(io.StringIO(data.decode("utf-8")))
    assert not document.audit().has_errors
    assert document.dxfversion == "AC1024"
    assert document.units == ezdxf.units.MM
    assert document.layers.get("NOTES").dxf.plot == 0
    (note,) = [e for e in document.modelspace() if e.dxf.layer == "NOTES"]
    assert note.dxftype() == "TEXT"
    return [e for e in document.modelspace() if e is not note]


def polygon(entity) -> Polygon:
    return Polygon([(p.x, p.y) for p in make_path(entity).flattening(1e-4)])


def test_plate_with_round_corners_and_holes():
    entities = read(outline_dxf_bytes(samples.drilled_plate()))
    outer = [e for e in entities if e.dxftype() == "LWPOLYLINE"]
    holes = [e for e in entities if e.dxftype() == "CIRCLE"]
    assert len(outer) == 1
    assert outer[0].closed
    assert len(outer[0]) == 8
    assert sorted(abs(b) for b in outer[0].get_points("b") for b in b) == pytest.approx(
        [0] * 4 + [math.tan(math.pi / 8)] * 4, abs=1e-8
    )
    assert [h.dxf.radius for h in holes] == [2.0] * 4
    assert [tuple(h.dxf.center)[:2] for h in holes] == [(-14, -5), (-14, 5), (14, -5), (14, 5)]
    area = polygon(outer[0]).area - 4 * math.pi * 4
    assert area == pytest.approx(samples.drilled_plate_area_mm2(), rel=1e-5)
    assert {e.dxf.layer for e in entities} == {"CUT"}


def test_concave_profile_with_arcs_both_ways():
    profile = cq.Workplane(samples.window()).faces(">X").val()
    (outline,) = read(outline_dxf_bytes(profile))
    bulges = [b for (b,) in outline.get_points("b") if b]
    assert sorted(math.copysign(1, b) for b in bulges) == [-1, -1, 1, 1]
    assert polygon(outline).area == pytest.approx(samples.window_volume_mm3() / 30, rel=1e-4)
    assert polygon(outline).is_valid


@pytest.mark.parametrize("plane", ["XY", "XZ", "YZ", "YX", "ZY"])
def test_outline_is_never_mirrored_by_where_the_plate_lies(plane):
    """An L of 6 x 4 with its notch at the far corner, drawn in each plane of the part."""
    solid = (
        cq.Workplane(plane)
        .polyline([(0, 0), (6, 0), (6, 1), (1, 1), (1, 4), (0, 4)])
        .close()
        .extrude(2)
        .val()
    )
    (outline,) = read(outline_dxf_bytes(solid))
    shape = polygon(outline)
    frame = frame_of(flat_face(solid).normalAt().toTuple())
    centre = solid.Center()
    expected = [
        sum(a * b for a, b in zip(centre.toTuple(), v, strict=True)) for v in (frame.u, frame.v)
    ]
    assert shape.area == pytest.approx(9)
    assert [shape.centroid.x, shape.centroid.y] == pytest.approx(expected, abs=1e-6)
    assert shape.exterior.is_ccw


def test_ellipse_becomes_fine_chords():
    ellipse = cq.Workplane("XY").ellipse(8, 4).extrude(2).val()
    (cut,) = read(outline_dxf_bytes(ellipse))
    assert polygon(cut).area == pytest.approx(math.pi * 32, rel=1e-3)


def test_a_circle_cut_into_arcs_is_a_circle_again():
    half = cq.Workplane("XY").moveTo(3, 0).threePointArc((0, 3), (-3, 0))
    wire = half.threePointArc((0, -3), (3, 0)).close().wire().val()
    (entity,) = read(outline_dxf_bytes(cq.Face.makeFromWires(wire)))
    assert entity.dxftype() == "CIRCLE"
    assert entity.dxf.radius == pytest.approx(3)


@pytest.mark.parametrize(
    "shape",
    [
        samples.frustum_loft,
        samples.window,
        lambda: cq.Workplane("XY").sphere(3).val(),
        lambda: cq.Solid.makeCylinder(2, 3).Faces()[0],
        lambda: samples.box(1, 1, 1).Vertices()[0],
    ],
)
def test_what_cannot_be_cut_is_refused(shape):
    with pytest.raises(ExportError):
        outline_dxf_bytes(shape())


def test_kerf_moves_the_outline_out_and_the_holes_in(tmp_path):
    plate, kerf = samples.drilled_plate(), 0.24
    data = outline_dxf_bytes(plate, kerf, "plate, cast acrylic")
    entities = read(data)
    (outer,) = [polygon(e) for e in entities if e.dxftype() == "LWPOLYLINE"]
    nominal = [e for e in read(outline_dxf_bytes(plate)) if e.dxftype() == "LWPOLYLINE"]
    true = polygon(nominal[0]).buffer(kerf / 2, quad_segs=1000)
    assert outer.symmetric_difference(true).area < 1e-4 * true.area
    assert [h.dxf.radius for h in entities if h.dxftype() == "CIRCLE"] == pytest.approx([1.88] * 4)
    kept = kept_area_mm2(flat_face(plate), kerf)
    assert kept == pytest.approx(true.area - 4 * math.pi * 1.88**2, rel=1e-5)
    path = tmp_path / "plate.dxf"
    path.write_bytes(data)
    assert all(p.ok for p in prove_dxf(path, kept))
    assert not all(p.ok for p in prove_dxf(path, float(flat_face(plate).Area())))
    with pytest.raises(KerfError, match="narrower"):
        outline_dxf_bytes(plate, 4.5)


def test_note_says_which_side_stays():
    for kerf, words in ((0.0, "let the cutter compensate"), (0.3, "0.15 mm outside the part")):
        data = outline_dxf_bytes(samples.drilled_plate(), kerf, "plate")
        document = ezdxf.read(io.StringIO(data.decode("utf-8")))
        (note,) = [e for e in document.modelspace() if e.dxf.layer == "NOTES"]
        assert words in note.dxf.text
        assert note.dxf.text.startswith("plate, 40.00 x 20.00 mm: inside the outer line stays")
