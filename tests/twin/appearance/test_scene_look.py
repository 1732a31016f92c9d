"""`gelslim calibrate-look` and a scene that names its file, as a user runs them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from appearance_rig import GAMMA, plain_look
from scene_samples import MINIMAL, load, problems
from sim_rig import SCENE, small_sensor

from gelslim.cli.main import main
from gelslim_force.frames.picture import read_picture
from gelslim_force.outputs.canvas import encoded
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.appearance.similarity import similarity
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.image_sensor import Exposure, SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.scene.built_look import LookError, read_look, write_look
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.simulation.picture import sensor_renderer
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.twin import Twin
from ifem_export.bundle.files import load_bundle

CONTRAST, BLUR_PX, READ_DN, PER_DN = 0.6, 1.2, 1.0, 40.0


def test_effects_have_the_values_of_the_look_where_the_scene_gives_none(tmp_path: Path) -> None:
    look = replace(plain_look(3), gamma=GAMMA, blur_px=1.3, grain_px=0.4, read_dn=0.5)
    write_look(look, tmp_path / "look.json")
    text = f"{MINIMAL}look: look.json\n"
    given = load(tmp_path, f"{text}effects: {{drawing: {{contrast: 0.7}}, sensor_noise: off}}\n")
    own = given.scene.effects.parameters()
    assert (own["drawing"].contrast, own["drawing"].level_dn) == (0.7, 60.0)
    assert (own["defocus"].still_px, own["exposure"].gamma) == (1.3, GAMMA)
    assert (own["sensor_noise"].use, own["sensor_noise"].grain_px) == ("off", 0.4)
    assert own["sensor_noise"].full_well_electrons == 255 * 100.0
    assert given.look is not None
    assert given.look.digest == look.digest
    assert load(tmp_path, MINIMAL).look is None


def test_a_file_that_is_no_look_is_refused_on_its_line(tmp_path: Path) -> None:
    for name, message in (("absent.json", "no such file"), ("other.json", "format")):
        (tmp_path / "other.json").write_text("{}", encoding="utf-8")
        (found,) = problems(tmp_path, f"{MINIMAL}look: {name}\n")
        assert (found.field, found.line) == ("look", len(MINIMAL.splitlines()) + 1)
        assert message in found.message
        assert "calibrate-look" in found.remedy


def hidden_renderer(sensor: TwinSensor) -> FrameRenderer:
    """Draws the small sensor as built."""
    record = sensor.camera_record
    look = Look(
        level_dn=75.0,
        contrast=CONTRAST,
        shading=Shading(),
        defocus=Defocus(record["aperture_mm"], record["focus_mm"], BLUR_PX),
        exposure=Exposure(gamma=GAMMA),
        sensor_noise=SensorNoise(READ_DN, PER_DN, 6),
    )
    return sensor_renderer(sensor, VirtualCamera.from_record(record), look, 6)


@pytest.mark.slow
def test_a_look_is_calibrated_and_a_scene_drawn_with_it(tmp_path: Path, capsys) -> None:
    bundle = small_sensor(tmp_path)
    built = hidden_renderer(TwinSensor(load_bundle(bundle)))
    rest, look = tmp_path / "rest.png", tmp_path / "look.json"
    (tmp_path / "presses").mkdir()
    rest.write_bytes(encoded(built.frame().image, ".png"))
    for number in (1, 2):
        picture = encoded(built.frame(number=number).image, ".png")
        (tmp_path / "presses" / f"p{number}.png").write_bytes(picture)
    look.write_text("{}", encoding="utf-8")
    command = ["calibrate-look", str(bundle), str(rest)]
    assert main([*command, "-o", str(look)]) == 2
    assert "look.json" in capsys.readouterr().err
    look.unlink()
    page = tmp_path / "look.html"
    command += [str(tmp_path / "presses"), "-o", str(look), "--report", str(page), "--json"]
    assert main(command) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["format"] == "gelslim-look/1"
    assert [press["picture"] for press in record["judged"]["presses"]] == ["p1.png", "p2.png"]
    assert record["gel"] == record["judged"]["gel"]
    assert record["gel"]["law"] == record["gel"]["asked"] == "auto"
    assert record["gel"]["presses"] == {"linear": 2, "neo_hookean": 0, "deep_linear": 0}
    assert page.read_text(encoding="utf-8").count("data:image/png;base64,") == 3
    found = read_look(look)
    np.testing.assert_allclose(found.contrast[:2], CONTRAST, atol=0.04)
    assert found.blur_px == pytest.approx(BLUR_PX, abs=0.1)
    for light in (20.0, 60.0):
        truth = np.sqrt(READ_DN**2 + light / PER_DN)
        assert np.sqrt(found.read_dn**2 + light / found.electrons_per_dn) == pytest.approx(
            truth, rel=0.08
        )
    scene = SCENE.format(bundle="bundle").replace("observe:", "look: look.json\nobserve:")
    (tmp_path / "scene.yaml").write_text(scene, encoding="utf-8")
    run = tmp_path / "out" / "run"
    assert main(["simulate", str(tmp_path / "scene.yaml"), "-o", str(run)]) == 0
    frames = sorted((run / "frames").iterdir())
    last = read_picture(frames[-1])
    stepped = stepped_picture(bundle, look)
    clean = replace(built, look=replace(built.look, sensor_noise=None)).frame().image
    assert similarity(stepped, clean) > 0.97 * similarity(built.frame().image, clean)
    assert similarity(last, built.frame(number=9).image) > 0.97 * similarity(
        clean, built.frame(number=9).image
    ) * similarity(clean, built.frame(number=8).image)


def stepped_picture(bundle: Path, look: Path) -> np.ndarray:
    """The untouched gel as a stepped twin draws it."""
    twin = Twin(bundle, observe=("image",), look=look)
    twin.add(Body.from_indenters(Sphere(shape="sphere", radius_mm=4.0)))
    away = np.eye(4)
    away[2, 3] = 5.0
    return np.asarray(twin.step([away], dt=0.01).image())


@pytest.mark.slow
def test_the_look_of_another_sensor_is_refused(tmp_path: Path, capsys) -> None:
    small_sensor(tmp_path)
    write_look(plain_look(3), tmp_path / "look.json")
    scene = SCENE.format(bundle="bundle").replace("observe:", "look: look.json\nobserve:")
    (tmp_path / "scene.yaml").write_text(scene, encoding="utf-8")
    with pytest.raises(LookError, match="belongs to a sensor of geometry drawn"):
        stepped_picture(tmp_path / "bundle", tmp_path / "look.json")
    assert main(["simulate", str(tmp_path / "scene.yaml"), "-o", str(tmp_path / "o" / "run")]) == 2
    assert "look belongs to a sensor of geometry drawn" in " ".join(capsys.readouterr().err.split())
