"""LeRobot itself finds the plugin, makes the camera, records its forces and reads them back."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import lerobot_stand_in as stand_in
import numpy as np
import pytest

pytest.importorskip("lerobot.cameras", reason="NOT TESTED: the camera in LeRobot needs lerobot")
pytestmark = pytest.mark.slow
PACKAGE = Path(__file__).parents[2] / "integrations" / "lerobot" / "lerobot_camera_gelslim"
FORCE_TOLERANCE = 0.1


@pytest.fixture
def plugin(monkeypatch: pytest.MonkeyPatch) -> Any:
    stand_in.forget_plugin(monkeypatch)
    return importlib.import_module(stand_in.PLUGIN)


@pytest.fixture
def configuration(tmp_path: Path) -> dict[str, Any]:
    """A pressed sensor in files, as a configuration of LeRobot names it."""
    from pressed_samples import calibration, lit_bundle, pressed, reference

    from gelslim_force.calibration.file import write_calibration
    from ifem_export.bundle.files import write_bundle

    write_bundle(tmp_path / "bundle", lit_bundle())
    write_calibration(calibration(), tmp_path / "calibration.json")
    np.save(tmp_path / "frames.npy", np.stack([reference().image, pressed(13).image] * 2))
    return {
        "type": "gelslim",
        "bundle": str(tmp_path / "bundle"),
        "calibration": str(tmp_path / "calibration.json"),
        "source": str(tmp_path / "frames.npy"),
        "fps": 10,
        "grid": [6, 6],
    }


def test_lerobot_imports_the_installed_package_by_its_name(tmp_path: Path) -> None:
    # Setuptools builds within the folder of the sources.
    sources = shutil.copytree(PACKAGE, tmp_path / "sources")
    done = subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation",
         "--no-index", "--target", str(tmp_path / "site"), str(sources)],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    if done.returncode:
        pytest.skip(f"NOT TESTED: pip cannot install the package here: {done.stderr[-300:]}")
    code = (
        "import sys\n"
        "from lerobot.utils.import_utils import register_third_party_plugins\n"
        "from lerobot.cameras import CameraConfig\n"
        "register_third_party_plugins()\n"
        "print(CameraConfig.get_choice_class('gelslim').__module__)\n"
    )
    paths = [str(tmp_path / "site"), *sys.path]
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, check=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert found.stdout.strip() == "lerobot_camera_gelslim.config_gelslim"


def test_forces_are_recorded_and_read_back(
    plugin: Any, configuration: dict[str, Any], tmp_path: Path
) -> None:
    """The steps of `lerobot-record`, without a robot."""
    import draccus
    from lerobot.cameras import CameraConfig, make_cameras_from_configs
    from lerobot.datasets.lerobot_dataset import LeRobotDataset
    from lerobot.datasets.pipeline_features import (
        aggregate_pipeline_dataset_features,
        create_initial_features,
    )
    from lerobot.datasets.utils import build_dataset_frame
    from lerobot.processor import RobotProcessorPipeline
    from lerobot.processor.converters import observation_to_transition, transition_to_observation
    from pressed_samples import pressed, reference

    config = draccus.decode(CameraConfig, configuration)
    cameras = make_cameras_from_configs({"finger": config})
    assert isinstance(cameras["finger"], plugin.GelslimCamera)
    size = (config.height, config.width, 3)
    assert size == reference().image.shape
    steps = RobotProcessorPipeline(
        steps=[plugin.GelslimForcesStep(cameras)],
        to_transition=observation_to_transition,
        to_output=transition_to_observation,
    )
    features = aggregate_pipeline_dataset_features(
        steps, create_initial_features(observation={"finger": size}), use_videos=True
    )
    made = LeRobotDataset.create("local/recorded", 10, features, root=tmp_path / "set")
    measured = []
    with cameras["finger"] as camera:
        extra = camera.features
        for _ in range(4):
            observed = steps({"finger": camera.read_latest()})
            measured.append(camera.reading.result.wrench)
            frame = build_dataset_frame(features, observed, prefix="observation")
            made.add_frame({**frame, "task": "press"})
        assert extra["force_grid_n"]["shape"] == camera.observation()["force_grid_n"].shape
    made.save_episode()
    made.finalize()
    found = LeRobotDataset("local/recorded", root=tmp_path / "set")
    names = found.features["observation.state"]["names"]
    assert names[:3] == ["finger.fx_n", "finger.fy_n", "finger.fz_n"]
    state = np.array([found[k]["observation.state"].numpy() for k in range(4)])
    vectors = np.nan_to_num([w.vector for w in measured])
    np.testing.assert_allclose(state[:, :6], vectors, rtol=1e-5, atol=1e-6)
    true_n = pressed(13).wrench[2]
    normal = state[:, names.index("finger.fz_n")]
    assert normal[[1, 3]] == pytest.approx(true_n, rel=FORCE_TOLERANCE)
    assert np.abs(normal[[0, 2]]).max() < FORCE_TOLERANCE * abs(true_n)
    assert state[:, names.index("finger.contact")].tolist() == [0, 1, 0, 1]
    picture = found[1]["observation.images.finger"].numpy().transpose(1, 2, 0)
    assert np.abs(255 * picture - pressed(13).image).mean() < 5
