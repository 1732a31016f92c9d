"""Meshes for printing and viewing, read back with trimesh and held to closed forms."""

from __future__ import annotations

import io
import json
import math
import zipfile

import cadquery as cq
import export_samples as samples
import numpy as np
import pytest
import trimesh
from sampled import quick
from shipped_fingers import dimensions

from gelslim_cad.export import ExportError
from gelslim_cad.export.glb import glb_bytes, viewer_tolerances
from gelslim_cad.export.mesh import (
    RUNGS,
    bad_edges,
    face_patches,
    mesh_for,
    print_mesh,
    rotation,
    tessellate,
    volume_mm3,
    welded,
)
from gelslim_cad.export.print_files import stl_bytes, threemf_bytes
from gelslim_cad.solids.guide import light_guide

VOLUMES_MM3 = {
    "plate": samples.drilled_plate_area_mm2() * 6,
    "window": samples.window_volume_mm3(),
    "frustum": 9 / 3 * (144 + 36 + 72),
    "cylinder": math.pi * 25 * 12,
    "sphere": 4 / 3 * math.pi * 216,
    "cone": math.pi * 25 * 8 / 3,
    "torus": 2 * math.pi**2 * 8 * 4,
    "dimple": 400 - math.pi * 1 * (3 * 3 - 1) / 3,
}


def from_stl(mesh):
    return trimesh.load_mesh(io.BytesIO(stl_bytes(mesh)), file_type="stl")


@pytest.mark.parametrize(
    "name", quick(sorted(samples.SHAPES), sorted(samples.SHAPES)[::2].__contains__)
)
def test_stl_is_watertight_and_keeps_the_volume(name):
    shape = samples.SHAPES[name]()
    mesh, _ = mesh_for(shape)
    read = from_stl(mesh)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume == pytest.approx(VOLUMES_MM3.get(name, shape.Volume()), rel=1e-3)
    assert len(mesh.faces) == len(read.faces)


def test_ladder_takes_the_coarsest_rung_that_qualifies():
    shape = samples.SHAPES["cylinder"]()
    mesh, rung = mesh_for(shape, 1e-3)
    taken = RUNGS.index(rung)
    coarser = tessellate(shape, *RUNGS[taken - 1])
    assert taken > 0
    assert abs(volume_mm3(coarser) / VOLUMES_MM3["cylinder"] - 1) > 1e-3
    assert len(mesh_for(shape, 1e-2)[0].faces) < len(mesh.faces)
    with pytest.raises(ExportError):
        mesh_for(shape, 1e-9)


def test_a_cached_tessellation_changes_nothing():
    shape = samples.drilled_plate()
    coarse = stl_bytes(tessellate(shape, 0.2, 30))
    shape.tessellate(0.01, 0.05)
    assert stl_bytes(tessellate(shape, 0.2, 30)) == coarse
    fresh = samples.drilled_plate()
    tessellate(fresh, 0.2, 30)
    fine = tessellate(fresh, 0.005, 3)
    assert stl_bytes(fine) == stl_bytes(tessellate(samples.drilled_plate(), 0.005, 3))
    assert len(stl_bytes(fine)) > 3 * len(coarse)


@pytest.mark.parametrize("rung", RUNGS[:5])
def test_a_sphere_pole_on_the_solid_does_not_leak(rung):
    ball = cq.Workplane("XY").sphere(2)
    plate = cq.Workplane("XY").box(10, 10, 4)
    for shape in (
        samples.pole_on_face(),
        plate.cut(ball).val(),
        plate.cut(ball.translate((5, 0, 0))).val(),
        ball.cut(cq.Workplane("XY").box(9, 9, 9).translate((4.5, 4.5, 0))).val(),
    ):
        assert from_stl(tessellate(shape, *rung)).is_watertight


def test_a_solid_that_touches_itself_is_refused_with_the_place():
    assert samples.tangent_cuts().isValid()
    with pytest.raises(ExportError, match=r"\[2\.0, "):
        mesh_for(samples.tangent_cuts())


def test_bad_edges_finds_holes_and_flips():
    mesh = tessellate(samples.box(2, 2, 2), 0.1, 20)
    assert len(bad_edges(mesh)) == 0
    assert len(bad_edges(mesh._replace(faces=mesh.faces[1:]))) == 3
    flipped = mesh.faces.copy()
    flipped[0] = flipped[0, ::-1]
    assert len(bad_edges(mesh._replace(faces=flipped))) == 3


@pytest.mark.parametrize(("linear", "angular"), [(0, 10), (-1, 10), (0.1, 0), (math.nan, 10)])
def test_tolerances_must_be_positive(linear, angular):
    with pytest.raises(ExportError, match=f"{angular}"):
        tessellate(samples.box(1, 1, 1), linear, angular)


def test_inside_out_solid_is_refused():
    inside_out = cq.Shape.cast(samples.box(1, 1, 1).wrapped.Reversed())
    with pytest.raises(ExportError):
        mesh_for(inside_out)


def test_normals_are_those_of_the_surface():
    patches = face_patches(samples.SHAPES["torus"](), 0.1, 20)
    nodes = np.concatenate([p.nodes_mm for p in patches])
    normals = np.concatenate([p.normals for p in patches])
    ring = nodes * [1, 1, 0] / np.linalg.norm(nodes[:, :2], axis=1, keepdims=True) * 8
    np.testing.assert_allclose(normals, (nodes - ring) / 2, atol=1e-6)


def test_3mf_names_colours_and_unit():
    window = samples.window()
    data = threemf_bytes("window <1>", mesh_for(window)[0], "acrylic & co", samples.GLASS)
    scene = trimesh.load_scene(io.BytesIO(data), file_type="3mf")
    assert scene.units == "millimeter"
    assert set(scene.geometry) == {"window <1>"}
    assert scene.geometry["window <1>"].is_watertight
    assert scene.geometry["window <1>"].volume == pytest.approx(window.Volume(), rel=1e-3)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert {i.date_time for i in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        model = archive.read("3D/3dmodel.model").decode()
    assert 'name="acrylic &amp; co" displaycolor="#99CCF259"' in model


def glb_json(data: bytes) -> dict:
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    size = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + size])


def test_glb_holds_one_node_per_part_with_extras_and_linear_colours():
    screw = samples.part(
        "screw",
        samples.box(2, 4, 8, (1, 2, 3)),
        colour=samples.GLASS,
        quantity=4,
        process="buy",
        explode_mm=(0.0, 0.0, 12.5),
    )
    document = glb_json(glb_bytes([screw, samples.part("body", samples.drilled_plate())]))
    root, first, second = document["nodes"]
    assert root["children"] == [1, 2]
    assert [first["name"], second["name"]] == ["screw", "body"]
    assert first["extras"] == {
        "explode_mm": [0.0, 0.0, 12.5],
        "process": "buy",
        "quantity": 4,
        "material": "resin",
        "chord_deg": 20.0,
    }
    glass, grey = document["materials"]
    assert glass["alphaMode"] == "BLEND"
    assert "alphaMode" not in grey
    assert glass["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(
        [0.318547, 0.603827, 0.890005, 0.35], abs=1e-5
    )


def test_glb_is_in_metres_with_the_gel_facing_up():
    part = samples.part("block", samples.box(2, 4, 8, (1, 2, 3)))
    scene = trimesh.load_scene(io.BytesIO(glb_bytes([part])), file_type="glb")
    np.testing.assert_allclose(scene.bounds, [[0, -0.001, -0.004], [0.002, 0.007, 0.0]], atol=1e-7)
    mesh = next(iter(scene.geometry.values()))
    # 6 faces of 4 corners: no vertex is shared, so the edges stay sharp.
    assert len(mesh.vertices) == 24
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(64e-9, rel=1e-6)
    with pytest.raises(ExportError):
        glb_bytes([])


def test_the_bend_of_a_guide_has_fine_chords():
    """Its faces turn by 0.5 degrees at most, or by the sharp angle of an edge."""
    guide = light_guide(dimensions("gelslim2"))
    patches = face_patches(guide.solid, *viewer_tolerances(guide))
    mesh = welded(patches)
    angles = np.degrees(trimesh.Trimesh(mesh.vertices_mm, mesh.faces).face_adjacency_angles)
    bends = angles[(angles > 1e-3) & (angles < 10)]
    assert len(bends) > 300
    assert bends.max() < 0.51
    document = glb_json(glb_bytes([guide]))
    assert document["nodes"][1]["extras"]["chord_deg"] == 0.5


def test_rotation_turns_about_x_then_y_then_z():
    np.testing.assert_array_equal(rotation((90, 0, 0)) @ [0, 1, 0], [0, 0, 1])
    np.testing.assert_array_equal(rotation((90, 90, 0)) @ [0, 1, 0], [1, 0, 0])
    np.testing.assert_array_equal(rotation((0, 0, -90)) @ [1, 0, 0], [0, -1, 0])


@pytest.mark.parametrize("angles", [(0, 0, 0), (180, 0, 0), (90, 0, 90), (20, -35, 70)])
def test_print_orientation_sits_centred_on_the_plate(angles):
    part = samples.part(
        "window", samples.window().translate(cq.Vector(5, 6, 70)), print_rotation_deg=angles
    )
    mesh = print_mesh(mesh_for(part.solid)[0], angles)
    low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
    np.testing.assert_allclose((low + high)[:2], 0, atol=1e-5)
    assert low[2] == 0
    assert from_stl(mesh).is_watertight
    turned = part.solid
    for axis, angle in zip(((1, 0, 0), (0, 1, 0), (0, 0, 1)), angles, strict=True):
        turned = turned.rotate(cq.Vector(), cq.Vector(*axis), angle)
    sides = turned.BoundingBox()
    np.testing.assert_allclose(high - low, [sides.xlen, sides.ylen, sides.zlen], atol=0.05)
