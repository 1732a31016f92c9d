"""The example scene in MuJoCo: two fingers close on an object with the force of their drives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_samples import WrittenFinger, written_finger

mujoco: Any = pytest.importorskip("mujoco", reason="NOT TESTED: needs the [peers] extra, mujoco")


def run(model: Any, seconds: float, data: Any = None) -> Any:
    """Let the scene run from its keyframe, or on from `data`."""
    if data is None:
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        assert np.isfinite(data.qpos).all()
    return data


def scene(folder: Path) -> Any:
    return mujoco.MjModel.from_xml_path(str(folder / "gripper.xml"))


def touching(model: Any, data: Any, geom: str) -> list[Any]:
    """Contacts of a geom with the object."""
    wanted = {model.geom(geom).id, model.geom("object").id}
    return [c for c in data.contact if {int(c.geom[0]), int(c.geom[1])} == wanted]


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_it_steps_a_second_and_closes_with_the_force_of_the_drives(
    which: str, request: pytest.FixtureRequest
) -> None:
    written: WrittenFinger = request.getfixturevalue(which)
    model = scene(written.folder)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    force = written.d["grip.force_n"]
    assert list(data.ctrl[:2]) == [force, force]
    mujoco.mj_forward(model, data)
    # Open at first: the gels stand off the object on both sides.
    assert not touching(model, data, "left_collision_gel")
    run(model, 1.0, data)
    # At rest a jaw on a slide without friction presses with the force of its drive.
    assert data.sensor("left_force").data[0] == pytest.approx(force, rel=0.01)
    assert data.sensor("right_force").data[0] == pytest.approx(force, rel=0.01)
    assert np.abs(data.qvel).max() < 1e-3
    for side in ("left", "right"):
        points = touching(model, data, f"{side}_collision_gel")
        assert len(points) == 4
        # Nothing but the gels grips.
        assert not touching(model, data, f"{side}_collision_case")


def test_the_gel_gives_as_its_stiffness_says(written: WrittenFinger) -> None:
    model = scene(written.folder)
    data = run(model, 1.0)
    depths = [-c.dist for c in touching(model, data, "left_collision_gel")]
    expected = written.d["grip.force_n"] / written.finger.contact.stiffness_n_m
    # The hand on its lift, which the formula leaves out, adds some mass.
    assert np.mean(depths) == pytest.approx(expected, rel=0.1)
    # Twice the force, twice the depth.
    data.ctrl[:2] *= 2
    model.actuator_ctrlrange[:2] *= 2
    run(model, 0.5, data)
    deeper = [-c.dist for c in touching(model, data, "left_collision_gel")]
    assert np.mean(deeper) == pytest.approx(2 * np.mean(depths), rel=0.02)


def lifted_mm(model: Any) -> float:
    """How far the object rises when the hand does by 20 mm in a second."""
    data = run(model, 0.5)
    before = float(data.body("object").xpos[2])
    for height in np.linspace(0, 0.02, 50):
        data.ctrl[2] = height
        run(model, 0.02, data)
    return (float(data.body("object").xpos[2]) - before) * 1e3


def test_friction_lifts_the_object_and_what_is_too_heavy_slips(written: WrittenFinger) -> None:
    assert lifted_mm(scene(written.folder)) == pytest.approx(19, abs=1.5)
    # 2 µ F = 10 N hold 1 kg; 1.2 kg slip and 0.8 kg do not.
    for mass, rises in ((0.8, True), (1.2, False)):
        model = scene(written.folder)
        body = model.body("object").id
        model.body_inertia[body] *= mass / model.body_mass[body]
        model.body_mass[body] = mass
        mujoco.mj_setConst(model, mujoco.MjData(model))
        assert (lifted_mm(model) > 15) == rises, mass


def test_a_weaker_drive_presses_less(written: WrittenFinger) -> None:
    model = scene(written.folder)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.ctrl[:2] = 3.0
    run(model, 1.5, data)
    assert data.sensor("left_force").data[0] == pytest.approx(3.0, rel=0.01)


def test_a_thin_light_object_between_crowned_gels_stays_where_it_is(tmp_path: Path) -> None:
    """A gram under a stiff contact needs a shorter time step, which the scene takes."""
    written = written_finger(
        tmp_path,
        {"crown_height_mm": 0.8},
        gripper="wsg32",
        object_size_mm=0.0,
        object_mass_g=0.0,
    )
    model = scene(written.folder)
    assert model.opt.timestep < 0.5e-3
    data = run(model, 1.0)
    force = written.d["grip.force_n"]
    for side in ("left", "right"):
        assert data.sensor(f"{side}_force").data[0] == pytest.approx(force, rel=1e-3)
        # On the crown it rests on four points, which share the stiffness as on a flat gel.
        points = touching(model, data, f"{side}_collision_gel")
        depths = [-c.dist for c in points]
        expected = force / written.finger.contact.stiffness_n_m
        assert depths == pytest.approx([expected] * 4, rel=0.01)
        assert np.mean([c.pos[1:] for c in points], axis=0) == pytest.approx([0, 0], abs=0.2e-3)
        assert not touching(model, data, f"{side}_collision_case")
    assert np.abs(data.qvel).max() < 1e-3
    held = data.body("object")
    assert np.abs(held.xpos).max() < 0.2e-3
    assert held.xquat[0] > 0.9999
