"""The grasp with fingers as `gelslim build` writes them, held for ten seconds at 500 Hz."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="NOT TESTED: the grasp of built fingers needs mujoco")
pytest.importorskip("cadquery", reason="NOT TESTED: the fingers are made of solids, extra `cad`")
from shipped_fingers import dimensions, parts

from gelslim import make_bundle, write_bundle
from gelslim_cad.robot.files import robot_files
from gelslim_cad.robot.model import robot_finger

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
HOLD_FROM_S, HOLD_S = 1.3, 10.0
MOST_DRIFT_J, MOST_KINETIC_J = 5e-7, 1e-10
"""A gel stores 2e-4 J in this grasp."""


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """A folder with robot models and bundle of `mini20`, as in a build."""
    d = dimensions("mini20")
    for path, (content, _) in robot_files(robot_finger("mini20", parts("mini20"), d), d).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    made = make_bundle(ROOT / "designs" / "mini20.yaml", measure=False)
    write_bundle(tmp_path / "bundle", made.bundle)
    return tmp_path


def test_built_fingers_lift_a_ball_let_it_slip_and_hold_it_without_drift(
    built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    example = ROOT / "examples" / "mujoco_grasp.py"
    monkeypatch.setattr(sys, "argv", [str(example), str(built)])
    monkeypatch.setattr("tempfile.mkdtemp", lambda: str(built))
    names = runpy.run_path(str(example), run_name="__main__")
    model, data = names["model"], names["started"](names["model"])
    assert model.geom("left_collision_gel").contype[0] == 0
    for twin in names["twins"].values():
        twin.reset()
    ball = model.body("object").id
    found = []
    while data.time < HOLD_FROM_S + HOLD_S:
        grip, lift = names["commands"](min(data.time, HOLD_FROM_S))
        data.ctrl[:] = grip, grip, lift
        names["coupled_step"](model, data)
        if data.time > HOLD_FROM_S:
            turn, speed = data.qvel[-3:], data.qvel[-6:-3]
            kinetic = float(model.body_mass[ball] * speed @ speed) / 2
            kinetic += float(model.body_inertia[ball] @ turn**2) / 2
            found.append((kinetic, 9.81 * float(model.body_mass[ball]) * data.xpos[ball][2]))
    kinetic, potential = np.array(found).T
    assert len(found) == pytest.approx(HOLD_S / names["DT_S"], abs=2)
    assert kinetic.max() < MOST_KINETIC_J
    assert np.ptp(potential) < MOST_DRIFT_J
