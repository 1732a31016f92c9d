"""URDF, MJCF and USD loaded by other programs: mass, inertia and frames are those of the CAD."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_samples import WrittenFinger
from scipy.spatial.transform import Rotation

from gelslim_cad.robot.mass import combined_mass, part_mass
from gelslim_cad.robot.proof import prove_robot

PEERS = "NOT TESTED: needs the [peers] extra, pip install {}"
TENTH_PERCENT = 1e-3


def peer(module: str, package: str) -> Any:
    return pytest.importorskip(module, reason=PEERS.format(package))


def cad(written: WrittenFinger) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and tensor from the solids, in the mount's frame."""
    gel = written.d["material.gel.density_kg_m3"]
    found = combined_mass(part_mass(p, gel).properties for p in written.parts)
    return found.mass_kg, found.centre_m + written.finger.frames.gel[:3, 3], found.inertia_kg_m2


def require_same(
    written: WrittenFinger, mass: float, centre: np.ndarray, tensor: np.ndarray
) -> None:
    expected = cad(written)
    assert mass == pytest.approx(expected[0], rel=TENTH_PERCENT)
    assert centre == pytest.approx(expected[1], abs=TENTH_PERCENT * np.abs(expected[1]).max())
    assert tensor == pytest.approx(expected[2], abs=TENTH_PERCENT * np.abs(expected[2]).max())


def quaternion(wxyz: Any) -> np.ndarray:
    w, x, y, z = (float(v) for v in wxyz)
    return Rotation.from_quat([x, y, z, w]).as_matrix()


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_mujoco_reads_mass_inertia_and_frames(which: str, request: pytest.FixtureRequest) -> None:
    mujoco = peer("mujoco", "mujoco")
    written: WrittenFinger = request.getfixturevalue(which)
    model = mujoco.MjModel.from_xml_path(str(written.folder / "finger.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    body = model.body("finger").id
    axes = quaternion(model.body_iquat[body])
    tensor = axes @ np.diag(model.body_inertia[body]) @ axes.T
    require_same(written, model.body_mass[body], model.body_ipos[body], tensor)
    frames = written.finger.frames
    assert data.site("gel").xpos == pytest.approx(frames.gel[:3, 3], abs=1e-8)
    assert data.site("mount").xpos == pytest.approx([0, 0, 0])
    camera = data.camera("camera")
    assert camera.xpos == pytest.approx(frames.optical[:3, 3], abs=1e-8)
    # MuJoCo's cameras look along -z with y up.
    seen = camera.xmat.reshape(3, 3) @ np.diag([1, -1, -1])
    assert seen == pytest.approx(frames.optical[:3, :3], abs=1e-7)
    half = written.d["camera.image_height_px"] / 2 / written.d["view.focal_px"]
    assert np.tan(model.cam_fovy[0] / 2 * (1 if model.cam_fovy[0] < 4 else np.pi / 180)) == (
        pytest.approx(half)
    )
    # What is seen does not collide; what collides is not doubled.
    for geom in range(model.ngeom):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or ""
        assert bool(model.geom_contype[geom]) == name.startswith("collision")


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_another_reader_of_urdf_finds_mass_inertia_and_frames(
    which: str, request: pytest.FixtureRequest
) -> None:
    yourdfpy = peer("yourdfpy", "yourdfpy")
    written: WrittenFinger = request.getfixturevalue(which)
    robot = yourdfpy.URDF.load(
        str(written.folder / "finger.urdf"),
        mesh_dir=str(written.folder),
        load_collision_meshes=True,
    )
    link = robot.link_map["finger"].inertial
    assert link.origin[:3, :3] == pytest.approx(np.eye(3))
    require_same(written, link.mass, link.origin[:3, 3], link.inertia)
    assert robot.base_link == "mount"
    frames = written.finger.frames
    for name, frame in (("gel", frames.gel), ("camera_optical", frames.optical)):
        assert robot.get_transform(name, "mount") == pytest.approx(frame, abs=1e-8)
    # Meshes are found, in metres.
    sizes = robot.scene.bounds[1] - robot.scene.bounds[0]
    assert 0.01 < sizes.min() < sizes.max() < 0.3
    assert len(robot.link_map["finger"].collisions) == len(written.finger.collisions)


def test_mujoco_reads_the_urdf_too(written: WrittenFinger) -> None:
    mujoco = peer("mujoco", "mujoco")
    model = mujoco.MjModel.from_xml_path(str(written.folder / "finger.urdf"))
    body = model.body("finger").id
    axes = quaternion(model.body_iquat[body])
    tensor = axes @ np.diag(model.body_inertia[body]) @ axes.T
    require_same(written, model.body_mass[body], model.body_ipos[body], tensor)
    assert model.nmesh == len(written.finger.pieces)


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_usd_reads_mass_inertia_frames_and_schemas(
    which: str, request: pytest.FixtureRequest
) -> None:
    peer("pxr", "usd-core")
    from pxr import Usd, UsdGeom, UsdPhysics, UsdShade

    written: WrittenFinger = request.getfixturevalue(which)
    stage = Usd.Stage.Open(str(written.folder / "finger.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    body = stage.GetDefaultPrim()
    assert body.HasAPI(UsdPhysics.RigidBodyAPI)
    mass = UsdPhysics.MassAPI(body)
    quat = mass.GetPrincipalAxesAttr().Get()
    axes = quaternion((quat.GetReal(), *quat.GetImaginary()))
    moments = np.diag(np.array(mass.GetDiagonalInertiaAttr().Get(), dtype=float))
    require_same(
        written,
        mass.GetMassAttr().Get(),
        np.array(mass.GetCenterOfMassAttr().Get()),
        axes @ moments @ axes.T,
    )
    frames = written.finger.frames
    for name, frame in (
        ("mount", np.eye(4)),
        ("gel", frames.gel),
        ("camera_optical", frames.optical),
        ("camera", frames.graphics),
    ):
        prim = UsdGeom.Xformable(stage.GetPrimAtPath(f"/finger/{name}"))
        found = np.array(prim.ComputeLocalToWorldTransform(0)).T
        assert found == pytest.approx(frame, abs=1e-8), name
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/finger/camera"))
    view = camera.GetCamera(0).GetFieldOfView(camera.GetCamera(0).FOVVertical)
    half = written.d["camera.image_height_px"] / 2 / written.d["view.focal_px"]
    assert np.tan(np.radians(view) / 2) == pytest.approx(half, rel=1e-6)
    meshes = [p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    assert len(meshes) == len(written.finger.pieces)
    for prim in meshes:
        mesh = UsdGeom.Mesh(prim)
        count = len(mesh.GetPointsAttr().Get())
        assert max(mesh.GetFaceVertexIndicesAttr().Get()) == count - 1
        assert UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), count
        )[0]
        extent = np.array(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
        assert np.array(mesh.GetExtentAttr().Get()) == pytest.approx(extent, abs=1e-6)
        hull = prim.GetName().startswith("collision")
        assert prim.HasAPI(UsdPhysics.CollisionAPI) == hull
        if not hull:
            assert UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    gel = stage.GetPrimAtPath("/finger/collision_gel")
    material, _ = UsdShade.MaterialBindingAPI(gel).ComputeBoundMaterial("physics")
    friction = UsdPhysics.MaterialAPI(material.GetPrim()).GetStaticFrictionAttr().Get()
    assert friction == pytest.approx(written.finger.contact.friction)


def proofs(written: WrittenFinger, folder: Path) -> set[tuple[str, str]]:
    """File and check of what fails."""
    return {(p.file, p.check) for p in prove_robot(folder, written.parts, written.d) if not p.ok}


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_the_proof_accepts_what_was_written(which: str, request: pytest.FixtureRequest) -> None:
    written: WrittenFinger = request.getfixturevalue(which)
    assert proofs(written, written.folder) == set()


@pytest.mark.slow
def test_the_proof_refuses_files_that_were_changed(written: WrittenFinger, tmp_path: Path) -> None:
    def changed(file: str, old: str, new: str) -> set[tuple[str, str]]:
        folder = tmp_path / "copy"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(written.folder, folder)
        text = (folder / file).read_text()
        assert old in text
        (folder / file).write_text(text.replace(old, new, 1))
        return proofs(written, folder)

    mass = f"{written.finger.mass.mass_kg:.9g}"
    heavier = f"{written.finger.mass.mass_kg * 1.00001:.9g}"
    for file in ("finger.urdf", "finger.xml", "gripper.xml", "finger.usda"):
        assert changed(file, mass, heavier) == {(file, "mass")}
    assert changed("finger.xml", "<body", "<bdy") == {("finger.xml", "readable")}
    assert changed("finger.urdf", 'parent link="mount"', 'parent link="gel"') == {
        ("finger.urdf", "links are one tree")
    }
    assert changed("finger.urdf", "visual_body.stl", "visual_bdy.stl") == {
        ("finger.urdf", "meshes exist")
    }
    assert changed("gripper.xml", 'mesh="visual_body"', 'mesh="visual_bdy"') == {
        ("gripper.xml", "meshes are declared")
    }
    assert changed("finger.usda", "def Mesh ", "def Cube ") == {("finger.usda", "meshes")}
    assert changed("finger.usda", "}", "") == {("finger.usda", "braces")}


def test_the_proof_refuses_meshes_in_millimetres_and_hollow_ones(
    written: WrittenFinger, tmp_path: Path
) -> None:
    import trimesh

    folder = tmp_path / "robot"
    shutil.copytree(written.folder, folder)
    for path in folder.glob("meshes/visual_*.stl"):
        mesh = trimesh.load_mesh(path)
        mesh.apply_scale(1000).export(path)
    assert proofs(written, folder) == {("meshes", "bounds in metres")}
    shutil.rmtree(folder)
    shutil.copytree(written.folder, folder)
    box, hole = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1, 1, 3))
    hollow = trimesh.boolean.difference([box, hole])
    hollow.export(folder / "meshes" / "collision_case.stl")
    assert proofs(written, folder) == {("collision_case.stl", "convex")}
    (folder / "finger.usda").unlink()
    assert ("finger.usda", "readable") in proofs(written, folder)


@pytest.mark.slow
def test_bytes_repeat(written: WrittenFinger) -> None:
    from gelslim_cad.robot.files import robot_files
    from gelslim_cad.robot.model import robot_finger, robot_inputs

    again = robot_files(
        robot_finger("mini20", written.parts, robot_inputs(written.d)), robot_inputs(written.d)
    )
    for path, (content, _) in again.items():
        assert (written.folder.parent / path).read_bytes() == content, path
