"""The kinds of units of work. Each writes some files and checks them by reading them back."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_cad.build.manifest import json_bytes
from gelslim_cad.build.order_files import write_order
from gelslim_cad.build.printing import print_stem
from gelslim_cad.build.work import VOLUME_TOLERANCE, Files, Written
from gelslim_cad.geometry.part import Part
from gelslim_core.files.replaced_folder import scratch_folder

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions
    from gelslim_cad.spec import Spec

PROOF_DECIMALS = 8
LIGHT_JSON = "light.json"
LIGHT_PATHS_JSON = "light_paths.json"
TOLERANCE_JSON = "tolerance.json"
LADDER_JSON = "bundle/ladder.json"
MARKERS_PURPOSE = "marker print, 1:1"
ERROR_PICTURE = "pictures/projection_error.png"
LEDGER_LIMIT = 1e-9
LOST_LIMIT = 1e-9

Proofs = list[Any]
Provers = dict[str, Callable[[Path], Proofs]]
"""What reads a file back and checks it, by the file's suffix."""


def write_part(
    parts: Sequence[Part],
    kerf_mm: float = 0.0,
    overhang_deg: float = 90.0,
    bridge_mm: float = math.inf,
) -> Written:
    """STEP of one part, with print meshes or a laser outline where its process needs them.

    The outline is moved by half of `kerf_mm` out of the part. A printed part is measured with the
    steepest overhang and the widest bridge that need no support.
    """
    from gelslim_cad.export.step import step_bytes
    from gelslim_cad.proof.step import prove_step

    (part,) = parts
    folder = "mould" if "mould" in part.tags else "step"
    files: Files = {f"{folder}/{part.name}.step": (step_bytes(part), "exact solid, AP242")}
    provers: Provers = {".step": lambda path: prove_step(path, part)}
    if part.process == "print":
        provers |= _meshes(part, files, overhang_deg, bridge_mm)
    if part.process in ("laser", "cut") or "outline" in part.tags:
        provers |= _outline(part, files, kerf_mm)
    return Written(files, _on_disk(files, lambda path: provers[path.suffix](path)))


def write_assembly(parts: Sequence[Part], name: str) -> Written:
    """STEP of the whole finger with names and colours."""
    from gelslim_cad.export.step import step_bytes
    from gelslim_cad.proof.step import prove_step

    data = step_bytes(parts, name=name)
    files: Files = {f"step/{name}_assembly.step": (data, "assembly with names and colours, AP242")}
    return Written(files, _on_disk(files, lambda written: prove_step(written, parts)))


def write_models(
    parts: Sequence[Part], name: str, known: Mapping[str, bytes] | None = None, **values: Any
) -> Written:
    """GLB of the finger for viewers, and models for simulators of robots, from the same meshes.

    `values` are `robot_inputs`. A GLB that is `known` is proved, but not written again.
    """
    from gelslim_cad.export.glb import glb_bytes, viewer_tolerances
    from gelslim_cad.export.mesh import face_patches, welded
    from gelslim_cad.proof.mesh import prove_glb
    from gelslim_cad.robot.files import FOLDER, robot_files
    from gelslim_cad.robot.model import record, robot_finger
    from gelslim_cad.robot.proof import prove_robot

    faces = [face_patches(part.solid, *viewer_tolerances(part)) for part in parts]
    path = glb_path(name)
    glb = known[path] if known and path in known else glb_bytes(parts, patches=faces)
    viewer: Files = {path: (glb, "coloured mesh of the assembly, metres")}
    proofs = _on_disk(viewer, lambda written: prove_glb(written, parts))
    meshes = {part.name: welded(patches) for part, patches in zip(parts, faces, strict=True)}
    finger = robot_finger(name, parts, values, meshes)
    files: Files = robot_files(finger, values)
    model = json_bytes(record(finger))
    files[f"{FOLDER}/model.json"] = (model, "masses with sources, frames and contact")
    with scratch_folder() as scratch:
        for place, (data, _) in files.items():
            target = scratch / place
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        proofs += _recorded(prove_robot(scratch / FOLDER, parts, values))
    return Written(viewer | files, proofs)


def glb_path(name: str) -> str:
    """Path of the GLB of a finger."""
    return f"{name}.glb"


def write_mould(parts: Sequence[Part], scale: float) -> Written:
    """Check that the mould's cavity is the gel enlarged by the shrinkage; no file is written."""
    from gelslim_cad.proof.solids import prove_mould

    cavity, gel = parts
    return Written({}, _recorded(prove_mould(cavity.solid, gel.solid, scale)))


def write_bundle_files(
    parts: Sequence[Part], spec: str, known: Mapping[str, bytes] | None = None
) -> Written:
    """The sensor's bundle with its ladder, read back, and the pad for ParaView.

    A ladder that is `known` is not measured again.
    """
    from gelslim_cad.sensor import (
        ladder_inputs,
        make_bundle,
        marker_grid,
        measured_ladder,
        pad_mesh,
    )
    from ifem_export.bundle.files import load_bundle, write_bundle
    from ifem_export.mesh.vtu import write_vtu
    from ifem_export.operators.operator_ladder import OperatorLadder

    found, d = _derived(spec)
    # Made from the inputs of the ladder alone, so that no other value can change it unnoticed.
    inputs = ladder_inputs(d)
    grid = marker_grid(inputs)
    mesh, _ = pad_mesh(inputs, grid)
    if known and LADDER_JSON in known:
        ladder = OperatorLadder.from_record(json.loads(known[LADDER_JSON]))
    else:
        ladder = measured_ladder(inputs, mesh, timed=False)
    bundle = make_bundle(found, d, mesh, grid, ladder=ladder, operator=ladder.balanced().label)
    with scratch_folder() as scratch:
        folder = scratch / "bundle"
        write_bundle(folder, bundle)
        load_bundle(folder, verify=True)
        write_vtu(folder / "pad.vtu", mesh)
        return Written(
            {
                f"bundle/{p.name}": (p.read_bytes(), "sensor bundle")
                for p in sorted(folder.iterdir())
            }
        )


@lru_cache(maxsize=1)
def _derived(spec: str) -> tuple[Spec, Dimensions]:
    """A spec from its JSON, with its dimensions; the units of one build share them."""
    from gelslim_cad.dimensions import derive
    from gelslim_cad.spec import Spec

    found = Spec.model_validate_json(spec)
    return found, derive(found)


def write_light(parts: Sequence[Part], **values: Any) -> Written:
    """Trace light through this guide and through straight ones; `values` are `light_inputs`."""
    from gelslim_cad.light.figures import irradiance_png, paths_png, ratio_png, shown_paths
    from gelslim_cad.light.study import study_light, study_record

    study = study_light(values)
    record = json_bytes(study_record(study))
    files: Files = {
        LIGHT_JSON: (record, "light guide: certificate, flux ledger, comparison, exposure"),
        LIGHT_PATHS_JSON: (json_bytes(shown_paths(values)), "light paths of the 3D view"),
        "pictures/light_paths.png": (paths_png(values), "picture of the light"),
        "pictures/irradiance.png": (irradiance_png(values, study), "picture of the light"),
        "pictures/light_ratio.png": (ratio_png(study), "picture of the light"),
    }
    return Written(files, _light_proofs(study))


def write_markers(parts: Sequence[Part], **values: Any) -> Written:
    """Drawings of the marker print in every format; `values` are `marker_inputs`."""
    from gelslim_cad.markers.write import render_marker_drawings
    from gelslim_cad.sensor import marker_grid, print_outline

    made = render_marker_drawings(
        marker_grid(values),
        print_outline(values),
        film_kerf_mm=values["manufacturing.kerf.film_mm"],
    )
    return Written({f"markers/{name}": (data, MARKERS_PURPOSE) for name, data in made.items()})


def write_view(parts: Sequence[Part], **values: Any) -> Written:
    """Map of the projection errors; `values` are `view_inputs`."""
    from gelslim_cad.report.view_figures import projection_png

    return Written({ERROR_PICTURE: (projection_png(values), "picture of the projection error")})


def write_tolerance(parts: Sequence[Part], spec: str) -> Written:
    """Yields of built fingers, their causes and the errors of their forces."""
    from gelslim_cad.tolerance.study import BUILD_SAMPLES, study_record, tolerance_study

    found, d = _derived(spec)
    study = tolerance_study(found, samples=BUILD_SAMPLES, d=d)
    data = json_bytes(study_record(study))
    return Written({TOLERANCE_JSON: (data, "yields of the rules, causes, force errors")})


def _light_proofs(study: Any) -> tuple[dict[str, Any], ...]:
    """The fluxes add up to that of the sources, and no ray is lost."""
    lost = max(g.value("lost") for g in (study.light, study.glued, study.air_gap))
    gap = max(g.ledger_gap() for g in (study.light, study.glued, study.air_gap))
    return (
        _light_proof(
            "flux ledger closes",
            gap <= LEDGER_LIMIT,
            gap,
            f"sums to 1 within {LEDGER_LIMIT:g}",
        ),
        _light_proof("no light is lost", lost <= LOST_LIMIT, lost, "share of rays lost at corners"),
    )


def _light_proof(check: str, ok: bool, value: float, detail: str) -> dict[str, Any]:
    rounded = round(value, 12)
    return {"file": LIGHT_JSON, "check": check, "ok": ok, "value": rounded, "detail": detail}


def _meshes(part: Part, files: Files, overhang_deg: float, bridge_mm: float) -> Provers:
    from gelslim_cad.export.mesh import mesh_for, print_mesh
    from gelslim_cad.export.print_files import stl_bytes, threemf_bytes
    from gelslim_cad.printability.measures import measure
    from gelslim_cad.proof.mesh import prove_3mf, prove_stl

    mesh, _ = mesh_for(part.solid, VOLUME_TOLERANCE)
    placed = print_mesh(mesh, part.print_rotation_deg)
    stem = print_stem(part)
    files[f"{stem}.stl"] = (
        stl_bytes(placed),
        f"print orientation, mm, {len(mesh.faces)} triangles",
    )
    files[f"{stem}.3mf"] = (
        threemf_bytes(part.name, placed, part.material, part.colour),
        "print orientation, with unit and colour",
    )
    found = asdict(measure(placed, part.solid, overhang_deg, bridge_mm))
    files[f"{stem}.json"] = (json_bytes(found), "walls, overhangs and holes, measured for printing")
    volume = float(part.solid.Volume())
    return {
        ".json": lambda path: [],
        ".stl": lambda path: prove_stl(path, volume),
        ".3mf": lambda path: prove_3mf(path, part.name, volume),
    }


def _outline(part: Part, files: Files, kerf_mm: float) -> Provers:
    from gelslim_cad.export.outline import flat_face, kept_area_mm2, outline_dxf_bytes
    from gelslim_cad.proof.outline import prove_dxf

    kerf = f"kerf {kerf_mm:g} mm" if kerf_mm else "kerf not compensated"
    files[f"laser/{part.name}.dxf"] = (
        outline_dxf_bytes(part.solid, kerf_mm, f"{part.name}, {part.material}"),
        f"cutting outline, R2010, mm; {part.material}; {kerf}",
    )
    area = kept_area_mm2(flat_face(part.solid), kerf_mm)
    return {".dxf": lambda written: prove_dxf(written, area)}


def _on_disk(files: Files, prove: Callable[[Path], Proofs]) -> tuple[dict[str, Any], ...]:
    """Write the files to a scratch folder, read each back and prove it there."""
    results: Proofs = []
    with scratch_folder() as scratch:
        for path, (data, _) in files.items():
            target = scratch / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            results += prove(target)
    return _recorded(results)


def _recorded(results: Proofs) -> tuple[dict[str, Any], ...]:
    """Proofs for the manifest, rounded because the kernel's last bits differ from run to run."""
    return tuple(asdict(replace(r, value=round(r.value, PROOF_DECIMALS))) for r in results)


WRITERS: dict[str, Callable[..., Written]] = {
    "part": write_part,
    "assembly": write_assembly,
    "models": write_models,
    "order": write_order,
    "markers": write_markers,
    "mould": write_mould,
    "view": write_view,
    "light": write_light,
    "bundle": write_bundle_files,
    "tolerance": write_tolerance,
}
"""The function that does each kind of unit."""


def load_libraries(kinds: Collection[str]) -> None:
    """Import what units of these kinds share and what takes long to import.

    A process that does this before it forks its workers spares each of them the import.
    """
    if not {"part", "bundle", "light"}.isdisjoint(kinds):
        from gelslim_core.first_kernel import load_numba

        load_numba()
    if not {"part", "models"}.isdisjoint(kinds):
        import trimesh  # noqa: F401
    if "part" in kinds:
        import gelslim_cad.printability.thickness_kernel  # noqa: F401
