"""Scenes carried out: what is written, what is kept, and that nothing depends on who did it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sim_rig import digests, small_sensor, written_scene

from gelslim.cli.main import main
from gelslim_force.forces.wrench import resultant


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    small_sensor(folder)
    written_scene(folder)
    return folder


@pytest.fixture(scope="module")
def simulated(place: Path) -> Path:
    assert main(["simulate", str(place / "scene.yaml"), "-o", str(place / "out" / "run")]) == 0
    return place / "out" / "run"


def test_folder_says_what_happened(simulated: Path) -> None:
    record = json.loads((simulated / "run.json").read_text())
    assert (record["state"], record["frames"], record["poses"]) == ("complete", 10, 10)
    held = np.load(simulated / "truth.npz")
    assert held["force_n"].shape == held["displacement_mm"].shape == (10, 399, 3)
    assert held["markers_px"].shape == held["centroids_px"].shape
    ledger = json.loads((simulated / "ledger.json").read_text())
    assert ledger["poses_solved"] == ledger["frames_drawn"] == 10
    assert ledger["solver_worst"]["penetration_mm"] < 1e-3
    assert not (simulated / "states").exists()


def test_table_is_the_sum_of_the_fields(simulated: Path) -> None:
    held = np.load(simulated / "truth.npz")
    rows = (simulated / "truth.csv").read_text().splitlines()
    names = rows[0].split(",")
    table = np.array([[float(v) for v in row.split(",")] for row in rows[1:]])
    for row, force in zip(table, held["force_n"], strict=True):
        total, torque = resultant(held["points_mm"], force)
        found = row[names.index("fx_n") : names.index("tz_nmm") + 1]
        assert found == pytest.approx([*total, *torque], abs=1e-12)
    push = table[:, names.index("fz_n")]
    assert push[4] < -0.05
    assert (np.diff(push[:5]) < 0).all()
    assert table[7, names.index("fx_n")] > 0.01
    assert table[-1, names.index("fz_n")] == 0.0
    assert table[-1, names.index("sticking_nodes")] == 0


def test_friction_cone_holds_about_the_balls_normal(simulated: Path) -> None:
    held = np.load(simulated / "truth.npz")
    rows = (simulated / "truth.csv").read_text().splitlines()
    names = rows[0].split(",")
    pushed = 0
    for k, row in enumerate(rows[1:]):
        pose = dict(zip(names, map(float, row.split(",")), strict=True))
        centre = np.array([pose["x_mm"], pose["y_mm"], 6.0 - pose["depth_mm"]])
        force = held["force_n"][k]
        on = force.any(axis=1)
        out = (held["points_mm"] + held["displacement_mm"][k])[on] - centre
        assert np.abs(np.linalg.norm(out, axis=1) - 6.0).max(initial=0.0) < 2e-3
        normal = out / np.linalg.norm(out, axis=1, keepdims=True)
        push = (force[on] * normal).sum(axis=1)
        along = np.linalg.norm(force[on] - push[:, None] * normal, axis=1)
        assert (push >= -1e-9).all()
        assert (along <= 0.61 * push + 1e-4 * push.max(initial=0.0)).all()
        pushed += int(on.sum())
    assert pushed > 50


def test_detector_finds_the_true_centroids(simulated: Path) -> None:
    from gelslim_force.detection.detection import Detector
    from gelslim_force.frames.picture import read_picture as picture

    held = np.load(simulated / "truth.npz")
    for number in (0, 4, 7):
        dots = Detector().detect(picture(simulated / "frames" / f"frame_{number:06d}.png"))
        true = held["centroids_px"][number][held["drawn"][number]]
        gap = np.linalg.norm(true[:, None] - dots.centres_px[None], axis=2).min(axis=1)
        assert np.median(gap) < 0.1
        assert (gap < 1.0).mean() > 0.97


def test_again_keeps_everything_and_another_scene_is_refused(
    place: Path, simulated: Path, capsys
) -> None:
    before = digests(simulated)
    (simulated / "states").mkdir()
    # As after a kill just before they were deleted.
    (simulated / "states" / "states_00000.npz").write_bytes(b"left")
    assert main(["simulate", str(place / "scene.yaml"), "-o", str(simulated), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["poses_solved"], answer["frames_drawn"]) == (0, 0)
    assert digests(simulated) == before
    other = place / "other.yaml"
    other.write_text((place / "scene.yaml").read_text().replace("seed: 4", "seed: 5"))
    assert main(["simulate", str(other), "-o", str(simulated)]) == 2
    assert "holds another simulation" in capsys.readouterr().err
    assert digests(simulated) == before


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(place: Path, simulated: Path) -> None:
    folder = place / "out" / "killed"
    command = [sys.executable, "-m", "gelslim", "simulate", str(place / "scene.yaml"),
               "-o", str(folder)]  # fmt: skip
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and child.poll() is None:
        if len(list(folder.glob("frames/*.png"))) >= 2:
            os.kill(child.pid, signal.SIGKILL)
            break
        time.sleep(0.01)
    child.wait()
    assert main(["simulate", str(place / "scene.yaml"), "-o", str(folder)]) == 0
    assert digests(folder) == digests(simulated)


def varied_scene(place: Path) -> Path:
    scene = place / "varied.yaml"
    text = (place / "scene.yaml").read_text()
    text = text.replace("steps: 4", "steps: 2").replace("steps: 3", "steps: 1")
    # With it, pictures of the untouched gel differ too.
    text = text.replace("effects:", "effects:\n  sensor_noise: on")
    scene.write_text(text + "vary: {depth_factor: [0.5, 1.2], direction_deg: [-180, 180]}\n")
    return scene


@pytest.mark.slow
def test_a_data_set_is_the_same_by_one_process_or_two(place: Path) -> None:
    scene = varied_scene(place)
    for name, jobs in (("one", "1"), ("two", "2")):
        out = place / "out" / name
        assert main(["simulate", str(scene), "-o", str(out), "--count", "3", "-j", jobs]) == 0
    one, two = digests(place / "out" / "one"), digests(place / "out" / "two")
    assert one == two
    pictures = [digest for name, digest in one.items() if name.endswith(".png")]
    # Six poses of each of the three, and the sensor at rest.
    assert len(set(pictures)) == len(pictures) == 3 * 6 + 1


@pytest.mark.slow
def test_a_cluster_does_the_same(place: Path) -> None:
    distributed = pytest.importorskip("distributed")
    scene, out, here = varied_scene(place), place / "out" / "cluster", place / "out" / "here"
    assert main(["simulate", str(scene), "-o", str(here), "--count", "3"]) == 0
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        given = ["--count", "3", "--scheduler", cluster.scheduler_address]
        assert main(["simulate", str(scene), "-o", str(out), *given]) == 0
    assert digests(out) == digests(here)


def test_another_gel_or_camera_replaces_the_stored_sensor(place: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor, stored_sensor
    from ifem_export.bundle.files import load_bundle
    from ifem_export.elements.material import Material

    bundle = load_bundle(place / "bundle")
    store_sensor(TwinSensor(bundle), tmp_path / "kept")
    stiffer = build_bundle_of(bundle, Material(0.3, 0.3223, 1000.0))
    store_sensor(TwinSensor(stiffer), tmp_path / "kept")
    assert stored_sensor(tmp_path / "kept").bundle.material.youngs_modulus_mpa == 0.3
    camera = {**bundle.camera, "focal_px": 650.0}
    store_sensor(TwinSensor(replace(stiffer, camera=camera)), tmp_path / "kept")
    assert stored_sensor(tmp_path / "kept").bundle.camera["focal_px"] == 650.0


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX locks")
def test_a_stored_sensor_that_is_kept_is_swept_of_a_killed_writer_only(
    place: Path, tmp_path: Path
) -> None:
    """A process killed in storing a compliance that another one has stored since."""
    from gelslim_core.files.replaced_file import is_part, replacement
    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor
    from ifem_export.bundle.files import load_bundle

    kept, sensor = tmp_path / "kept", TwinSensor(load_bundle(place / "bundle"))
    store_sensor(sensor, kept)
    whole = {path.name for path in kept.iterdir()}
    with replacement(kept / "compliance-0.npy") as living:
        living.write(b"half")
        own = {path.name for path in kept.iterdir()} - whole
        (kept / ".0123456789abcdef.part").write_bytes(b"left")
        store_sensor(sensor, kept)
        assert {path.name for path in kept.iterdir()} == whole | own
    assert all(is_part(name) for name in own)
    assert {path.name for path in kept.iterdir()} == whole | {"compliance-0.npy"}


def build_bundle_of(bundle, material):
    from ifem_export.bundle.bundle import build_bundle

    return build_bundle(
        bundle.mesh,
        material,
        bundle.formulation,
        marker_positions_mm=bundle.markers.positions_mm,
        marker_arrays=dict(bundle.markers.arrays),
        camera=bundle.camera,
        with_stiffness=False,
    )


def test_absent_effects_are_not_in_memory(place: Path) -> None:
    scene = place / "still.yaml"
    text = (place / "scene.yaml").read_text()
    scene.write_text(
        text.replace("[displacement, force, markers, image]", "[force]").replace(
            "friction: 0.6", "friction: 0"
        )
    )
    code = (
        "import sys\n"
        "from gelslim.cli.main import main\n"
        f"assert main(['simulate', {str(scene)!r}, '-o', {str(place / 'out' / 'still')!r}]) == 0\n"
        "bad = [m for m in sys.modules if m.startswith(('gelslim_twin.render', 'cv2', 'PIL.Image',"
        " 'gelslim_twin.contact.coulomb_kernel', 'gelslim_twin.contact.nonlinear',"
        " 'gelslim_twin.contact.relaxation', 'cadquery', 'OCP', 'vtk'))]\n"
        "sys.exit(', '.join(bad) or None)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
