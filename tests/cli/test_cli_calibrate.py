"""`gelslim calibrate`: a file from a bundle and a picture, or a refusal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from gelslim.cli import main
from gelslim_force.calibration.camera_deviation import PARAMETERS, deviated_camera
from gelslim_force.calibration.design import bundle_camera, bundle_grid
from gelslim_force.calibration.file import read_calibration
from ifem_export.bundle.files import load_bundle

SPEC = str(Path(__file__).parents[2] / "designs" / "mini20.yaml")
TURNED_DEG = 0.8


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bundle") / "mini20"
    assert main(["bundle", SPEC, "-o", str(folder), "--no-ladder"]) == 0
    return folder


@pytest.fixture(scope="module")
def picture(bundle: Path) -> Path:
    """Dots as dark discs about their projections; the camera is turned about y."""
    sensor = load_bundle(bundle)
    grid = bundle_grid(sensor)
    values = np.zeros(len(PARAMETERS))
    values[PARAMETERS.index("rotation_y_deg")] = TURNED_DEG
    camera = deviated_camera(bundle_camera(sensor), values)
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    y, x = np.mgrid[: camera.image_height_px, : camera.image_width_px].astype(float)
    image = np.full(x.shape, 160.0)
    to_gel = np.linalg.inv(camera.jacobian(flat))
    for place, inverse, size in zip(camera.project(flat), to_gel, grid.diameter_mm, strict=True):
        u, v = x - place[0], y - place[1]
        away = np.hypot(
            inverse[0, 0] * u + inverse[0, 1] * v, inverse[1, 0] * u + inverse[1, 1] * v
        )
        image = np.where(away < size / 2, 40.0, image)
    file = bundle.parent / "reference.npy"
    np.save(file, np.rint(gaussian_filter(image, 0.7)).astype(np.uint8))
    return file


def test_a_calibration_is_written_and_told(
    bundle: Path, picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "made" / "sensor.json"
    assert main(["calibrate", str(bundle), str(picture), "-o", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for words in ("256 markers", "about y", str(out)):
        assert words in said
    found = read_calibration(out)
    found.require_bundle(load_bundle(bundle))
    turned = found.deviation.values[PARAMETERS.index("rotation_y_deg")]
    assert turned == pytest.approx(TURNED_DEG, abs=0.12)
    assert main(["calibrate", str(bundle), str(picture), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(out.read_text(encoding="utf-8"))
    assert main(["calibrate", str(bundle), str(picture)]) == 0
    assert "-o FILE" in capsys.readouterr().out


def test_refusals_write_nothing(
    bundle: Path, picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = np.load(picture)
    out = tmp_path / "sensor.json"
    for name, changed, words in (
        ("mirrored", frame[:, ::-1], "mirrored"),
        ("small", frame[::2, ::2], "320 x 240 px"),
        ("dark", frame * 0, "0"),
    ):
        np.save(tmp_path / f"{name}.npy", changed)
        arguments = ["calibrate", str(bundle), str(tmp_path / f"{name}.npy"), "-o", str(out)]
        assert main(arguments) == 2
        said = capsys.readouterr()
        assert words in said.err
        assert "Traceback" not in said.err
    assert main(["calibrate", str(bundle), str(tmp_path / "none.png")]) == 2
    assert main(["calibrate", str(tmp_path), str(picture)]) == 2
    assert not out.exists()
