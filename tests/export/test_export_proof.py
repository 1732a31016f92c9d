"""The proofs pass what is right and catch what is wrong, on files as written."""

from __future__ import annotations

import math
import re
from itertools import combinations

import cadquery as cq
import export_samples as samples
import numpy as np
import pytest

from gelslim_cad.export import ExportError
from gelslim_cad.export.glb import glb_bytes
from gelslim_cad.export.mesh import mesh_for, tessellate
from gelslim_cad.export.outline import outline_dxf_bytes
from gelslim_cad.export.print_files import stl_bytes, threemf_bytes
from gelslim_cad.export.step import step_bytes
from gelslim_cad.proof.mesh import prove_3mf, prove_glb, prove_stl
from gelslim_cad.proof.outline import prove_dxf
from gelslim_cad.proof.solids import (
    TOLERANCE_MM3,
    common_volume,
    interferences,
    prove_mould,
)
from gelslim_cad.proof.step import prove_step, read_step


@pytest.fixture(scope="module")
def parts():
    return [samples.part(n, f(), colour=samples.GLASS) for n, f in samples.SHAPES.items()]


def failures(results):
    return [r for r in results if not r.ok]


def failed(results):
    return {r.check for r in failures(results)}


def written(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return path


def test_step_assembly_reopens_with_names_colours_and_volumes(tmp_path, parts):
    path = written(tmp_path, "finger.step", step_bytes(parts, name="finger"))
    results = prove_step(path, parts)
    assert failures(results) == []
    assert len([r for r in results if r.check == "volume"]) == len(parts)
    text = path.read_text()
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "FILE_NAME('finger','1970-01-01T00:00:00'" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    red, green, blue, alpha = samples.GLASS
    colours = re.findall(r"COLOUR_RGB\('',([\d.,]+)\)", text)
    assert {tuple(map(float, c.split(","))) for c in colours} == {(red, green, blue)}
    clear = {float(c) for c in re.findall(r"SURFACE_STYLE_TRANSPARENT\(([\d.]+)\)", text)}
    assert list(clear) == [pytest.approx(1 - alpha)]


def test_step_assembly_keeps_placed_parts_in_place(tmp_path):
    moved = samples.window().moved(cq.Location(cq.Vector(3, 4, 5), cq.Vector(1, 0, 0), 30))
    twin = samples.window().moved(cq.Location(cq.Vector(-30, 0, 0)))
    placed = [samples.part("one", moved), samples.part("two", twin)]
    path = written(tmp_path, "two.step", step_bytes(placed))
    assert failures(prove_step(path, placed)) == []
    for part, read in zip(placed, read_step(path), strict=True):
        assert read.shape.Center().toTuple() == pytest.approx(
            part.solid.Center().toTuple(), abs=1e-8
        )


def test_step_refuses_two_solids_repeated_names_and_nothing():
    two = cq.Compound.makeCompound([samples.box(1, 1, 1), samples.box(1, 1, 1, (3, 0, 0))])
    with pytest.raises(ExportError, match="pair"):
        step_bytes(samples.part("pair", two))
    box = samples.part("box", samples.box(1, 1, 1))
    with pytest.raises(ExportError, match="box"):
        step_bytes([box, box])
    with pytest.raises(ExportError):
        step_bytes([])


def test_step_proof_catches_wrong_count_name_volume_and_rubbish(tmp_path, parts):
    path = written(tmp_path, "plate.step", step_bytes(parts[0]))
    assert failed(prove_step(path, parts[:2])) == {"solids", "name present"}
    other = samples.part("plate", samples.box(40, 20, 6))
    assert failed(prove_step(path, other)) == {"volume"}
    rubbish = written(tmp_path, "rubbish.step", b"not a STEP file")
    assert failed(prove_step(rubbish, parts[0])) == {"solids", "name present"}


def test_step_proof_catches_an_invalid_solid(tmp_path):
    broken = samples.part("broken", samples.open_box())
    path = written(tmp_path, "broken.step", step_bytes(broken))
    assert failed(prove_step(path, broken)) & {"valid solid", "solids"}


@pytest.mark.slow
def test_meshes_as_written(tmp_path, parts):
    meshes = {p.name: mesh_for(p.solid)[0] for p in parts}
    volumes = {p.name: p.solid.Volume() for p in parts}
    for name, mesh in meshes.items():
        path = written(tmp_path, f"{name}.stl", stl_bytes(mesh))
        assert failures(prove_stl(path, volumes[name])) == []
        data = threemf_bytes(name, mesh, "resin", samples.GREY)
        path = written(tmp_path, f"{name}.3mf", data)
        assert failures(prove_3mf(path, name, volumes[name])) == []
        assert failed(prove_3mf(path, "other", volumes[name])) == {"name present"}


def test_mesh_proof_catches_a_leak_a_flip_and_a_coarse_mesh(tmp_path):
    shape = samples.SHAPES["cylinder"]()
    mesh, volume = mesh_for(shape)[0], shape.Volume()
    leaky = written(tmp_path, "leaky.stl", stl_bytes(mesh._replace(faces=mesh.faces[1:])))
    assert "watertight" in failed(prove_stl(leaky, volume))
    faces = mesh.faces.copy()
    faces[:5] = faces[:5, ::-1]
    flipped = written(tmp_path, "flipped.stl", stl_bytes(mesh._replace(faces=faces)))
    assert "winding consistent" in failed(prove_stl(flipped, volume))
    inside_out = written(tmp_path, "in.stl", stl_bytes(mesh._replace(faces=mesh.faces[:, ::-1])))
    assert failed(prove_stl(inside_out, volume)) == {"volume"}
    coarse = written(tmp_path, "coarse.stl", stl_bytes(tessellate(shape, 0.2, 30)))
    assert failed(prove_stl(coarse, volume)) == {"volume"}
    rubbish = written(tmp_path, "rubbish.3mf", b"not a zip")
    assert failed(prove_3mf(rubbish, "a", 1.0)) == {"readable"}


def test_sphere_pole_leaks_elsewhere_and_the_proof_notices(tmp_path):
    shape = samples.pole_on_face()
    assert shape.isValid()
    path = tmp_path / "pole.stl"
    cq.exporters.export(cq.Workplane(obj=shape), str(path), tolerance=0.05, angularTolerance=0.2)
    assert "watertight" in failed(prove_stl(path, shape.Volume()))
    ours = written(tmp_path, "ours.stl", stl_bytes(mesh_for(shape)[0]))
    assert failures(prove_stl(ours, 400 - math.pi * 8 / 3)) == []


def test_3mf_in_another_unit_is_caught(tmp_path):
    import zipfile

    box = mesh_for(samples.box(2, 2, 2))[0]
    good = written(tmp_path, "good.3mf", threemf_bytes("box", box, "resin", samples.GREY))
    assert failures(prove_3mf(good, "box", 8.0)) == []
    with zipfile.ZipFile(good) as old, zipfile.ZipFile(tmp_path / "inch.3mf", "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b'unit="millimeter"', b'unit="inch"'))
    assert "unit is mm" in failed(prove_3mf(tmp_path / "inch.3mf", "box", 8.0))


def test_glb_proof_passes_metres_and_catches_millimetres_and_a_shift(tmp_path, parts):
    path = written(tmp_path, "all.glb", glb_bytes(parts))
    assert failures(prove_glb(path, parts)) == []
    big = [samples.part(p.name, p.solid.scale(1000)) for p in parts[:1]]
    wrong = written(tmp_path, "wrong.glb", glb_bytes(big, tolerances=(100, 20)))
    assert failed(prove_glb(wrong, parts[:1])) == {"bounds in metres"}
    shifted = [samples.part("plate", parts[0].solid.translate(cq.Vector(0, 0, 0.5)))]
    moved = written(tmp_path, "moved.glb", glb_bytes(shifted))
    assert failed(prove_glb(moved, parts[:1])) == {"bounds in metres"}
    assert failed(prove_glb(path, parts[:1])) == {"meshes"}


def test_dxf_proof_passes_and_catches(tmp_path):
    area = samples.drilled_plate_area_mm2()
    path = written(tmp_path, "plate.dxf", outline_dxf_bytes(samples.drilled_plate()))
    assert failures(prove_dxf(path, area)) == []
    assert failed(prove_dxf(path, area * 1.01)) == {"area"}
    assert failed(prove_dxf(path, area, layer="ENGRAVE")) == {"area"}
    import ezdxf

    document = ezdxf.readfile(path)
    document.units = ezdxf.units.IN
    next(iter(document.modelspace().query("LWPOLYLINE"))).closed = False
    document.saveas(tmp_path / "open.dxf")
    assert failed(prove_dxf(tmp_path / "open.dxf", area)) >= {"unit is mm", "open outlines"}
    assert failed(prove_dxf(tmp_path / "none.dxf", area)) == {"readable"}


def test_touching_is_no_interference_and_overlap_is(parts):
    peg = samples.part("peg", cq.Solid.makeCylinder(5, 12))
    block = cq.Workplane("XY").rect(20, 20).extrude(12).faces(">Z").workplane().hole(10).val()
    far = samples.part("far", samples.box(1, 1, 1, (100, 0, 0)))
    beside = samples.part("beside", samples.box(4, 4, 4, (12, 0, 6)))
    fitting = [peg, samples.part("block", block), far, beside]
    assert interferences(fitting) == []
    thick = samples.part("thick", cq.Solid.makeCylinder(5.01, 12))
    (found,) = interferences([thick, *fitting[1:]])
    assert (found.first, found.second) == ("thick", "block")
    assert found.volume_mm3 == pytest.approx(math.pi * (5.01**2 - 25) * 12, rel=1e-6)


def test_a_part_inside_another_interferes():
    inner = samples.part("inner", samples.box(1, 2, 3))
    (found,) = interferences([samples.part("outer", samples.box(9, 9, 9)), inner])
    assert found.volume_mm3 == pytest.approx(6.0)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 9))]
)
def test_pairs_that_overlap_are_those_that_are_compared_one_by_one(seed):
    """Boxes on a lattice, many of which touch, and cylinders in some of them."""
    draw = np.random.default_rng(seed)
    bodies = []
    for number in range(14):
        size, at = draw.integers(1, 4, 3), draw.integers(0, 9, 3)
        solid = cq.Solid.makeBox(*map(float, size)).translate(cq.Vector(*map(float, at)))
        if number % 3 == 0:
            solid = cq.Solid.makeCylinder(0.4 * size[0], float(size[2])).translate(
                cq.Vector(*(at + 0.5))
            )
        bodies.append(samples.part(f"b{number}", solid))
    found = {(p.first, p.second): p.volume_mm3 for p in interferences(bodies)}
    alone = {(a.name, b.name): common_volume(a.solid, b.solid) for a, b in combinations(bodies, 2)}
    assert found == {pair: volume for pair, volume in alone.items() if volume > TOLERANCE_MM3}
    assert 0 < len(found) < len(alone)


@pytest.mark.slow
def test_exact_and_mesh_volumes_agree_on_every_pair(parts):
    from gelslim_cad.proof.solids import _boolean, _mesh_common

    few = [p for p in parts if p.name not in ("busy", "torus", "sphere")]
    for a, b in combinations(few, 2):
        exact = _boolean([a.solid], [b.solid], 0.0)
        assert common_volume(a.solid, b.solid) == exact, (a.name, b.name)
        mesh = _mesh_common(a.solid, b.solid)
        assert exact == pytest.approx(mesh, rel=2e-3, abs=0.05), (a.name, b.name)


def test_mould_cavity_is_the_scaled_gel_to_a_millionth():
    gel = samples.busy_part()
    assert failures(prove_mould(gel.scale(1.012).translate(cq.Vector(9, 8, 7)), gel, 1.012)) == []
    assert len(failures(prove_mould(gel.scale(1.0120009), gel, 1.012))) == 3
    same_volume = samples.box(2, 2, 2)
    assert failed(prove_mould(same_volume, samples.box(4, 2, 1), 1.0)) == {
        "cavity area = gel x scale^2",
        "cavity inertia = gel x scale^5",
    }
