"""A plan imports what it keeps and nothing else; planning itself imports nothing heavy."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from dataclasses import fields

import pytest
from scene_samples import GALLERY, ROOT

from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.render.look import FACTORIES, Look

HEAVY = (
    "numba", "scipy", "cadquery", "OCP", "vtk", "matplotlib", "cv2", "PIL",
    "gelslim_cad", "gelslim_force", "gelslim_optics",
)  # fmt: skip
SCENE = str(next(p for p in GALLERY if p.stem == "press_sphere"))


def fresh(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, 'tests/twin')\n{code}"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_planning_imports_no_implementation_and_nothing_heavy():
    watched = tuple(sorted({*HEAVY, *(e.implementation for e in EFFECTS)}))
    # The samples of tests import pytest; the plan is made without them.
    code = (
        "from gelslim_twin.effects.circumstances import SensorFigures\n"
        "from gelslim_twin.scene.reader import read_scene\n"
        "from gelslim_twin.planning.question import plan_scene\n"
        "s = SensorFigures(28., 28., 2., .147, .3223, 1849, 4, 575, 1., .5, 635., 640, 480,"
        " 32., 40.5, 364., 17.7, 43., ((2.5, 1.49), (2., 1.41)), 1.24, 35.8)\n"
        f"assert plan_scene(read_scene({SCENE!r}), s).order\n"
        f"print([m for m in {watched!r} if m in sys.modules])"
    )
    assert fresh(code) == "[]"


def test_a_picture_loads_the_modules_of_its_effects_only():
    code = f"""
from scene_samples import SENSOR
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.render.look import plan_look
loaded = read_scene({SCENE!r})
plan = plan_scene(loaded, SENSOR)
record = {{"aperture_mm": 1.24, "focus_mm": 35.8}}
plan_look(plan, loaded.scene.effects.parameters(), record, 1)
out = [c.effect for c in plan.choices if not c.included]
from gelslim_twin.effects.registry import EFFECTS
kept = {{plan.choice(e).implementation for e in plan.order}}
absent = [e.implementation for e in EFFECTS if e.name in out and e.implementation not in kept]
assert "gelslim_twin.contact.relaxation" in absent
kept = ["gelslim_twin.render.defocus", "gelslim_twin.render.image_sensor"]
print([m for m in absent if m in sys.modules], all(m in sys.modules for m in kept))
"""
    assert fresh(code) == "[] True"


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_every_implementation_exists(effect):
    assert importlib.util.find_spec(effect.implementation) is not None
    if effect.name in FACTORIES:
        module = importlib.import_module(effect.implementation)
        assert callable(getattr(module, FACTORIES[effect.name]))
        assert effect.name in {f.name for f in fields(Look)}
