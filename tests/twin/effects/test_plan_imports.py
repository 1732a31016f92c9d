"""A plan imports what it keeps and nothing else; planning itself imports nothing heavy."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from dataclasses import fields

import pytest
from scene_samples import GALLERY, ROOT
from sim_rig import small_sensor

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


RUN = """
import sys
from pathlib import Path
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.simulation.simulate import simulate
from ifem_export.bundle.files import load_bundle
place = Path(sys.argv[1])
sensor = TwinSensor(load_bundle(place / "bundle"))
job = job_of(read_scene(place / sys.argv[2]), sensor, place)
simulate(job, place / "runs" / sys.argv[3])
kept = {c.implementation for c in job.plan.included}
print(*job.plan.order)
print(*[m for m in sys.argv[4:] if m in sys.modules and m not in kept])
"""
EVERYTHING = """\
format: gelslim-scene/1
name: everything
sensor: {bundle: bundle}
indenters:
  - {shape: sphere, radius_mm: 6}
motion:
  waypoints:
    - {move: press, depth_mm: 0.1, steps: 1, duration_s: 0.05}
contact: {friction: 0.5}
observe: [force, image]
effects:
  friction: {use: on}
  nonlinearity: {use: on}
  relaxation: {use: on, terms: [{fraction: 0.1, time_s: 0.1}]}
  refraction: {use: on}
  marker_print: {use: on, jitter_mm: 0.01}
  shading: {use: on}
  dirt: {use: on, specks: 2}
  defocus: {use: on}
  specular: {use: on, spots: 2}
  motion_blur: {use: on}
  exposure: {use: on, gamma: 1.8}
  sensor_noise: {use: on}
  compression: {use: on, quality: 80}
"""
CAMERA = ("motion_blur", "exposure", "sensor_noise", "compression")
ABSENT: dict[tuple[str, ...], tuple[str, ...]] = {
    ("friction",): (
        "gelslim_twin.contact.coulomb_contact", "gelslim_twin.contact.coulomb_kernel",
    ),
    ("nonlinearity",): (
        "gelslim_twin.contact.nonlinear", "gelslim_twin.contact.corrected_contact",
        "gelslim_twin.contact.newton_contact", "gelslim_twin.contact.gel_body",
    ),
    ("relaxation",): ("gelslim_twin.contact.relaxation",),
    ("shading",): ("gelslim_twin.render.shading",),
    ("defocus",): ("gelslim_twin.render.defocus",),
    ("marker_print",): ("gelslim_twin.render.print_faults",),
    ("dirt", "specular"): ("gelslim_twin.render.blemishes",),
    CAMERA: ("gelslim_twin.render.image_sensor",),
}  # fmt: skip
"""Effects that share no module with others, and the modules that are theirs alone."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("imports")
    small_sensor(folder)
    return folder


def loaded_modules(place, absent, modules):
    """Effects of a run without `absent`, and which of `modules` it loaded."""
    lines = [
        f"  {line.split(':')[0].strip()}: {{use: off}}"
        if line.startswith("  ") and line.split(":")[0].strip() in absent
        else line
        for line in EVERYTHING.splitlines()
    ]
    name = "_".join(absent) or "everything"
    (place / f"{name}.yaml").write_text("\n".join(lines) + "\n")
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(place), f"{name}.yaml", name, *modules],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    order, found = done.stdout.splitlines()
    return set(order.split()), found.split()


@pytest.mark.slow
def test_a_run_without_any_optional_effect_loads_none(place):
    absent = tuple(name for names in ABSENT for name in names)
    modules = tuple(module for names in ABSENT.values() for module in names)
    order, found = loaded_modules(place, absent, modules)
    assert not order & {*absent}
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize("absent", ABSENT, ids="+".join)
def test_an_absent_effect_is_not_imported(place, absent):
    """All other effects are on, so that only a module of its own can tell."""
    order, found = loaded_modules(place, absent, ABSENT[absent])
    assert not order & {*absent}
    assert {e for names in ABSENT if names != absent for e in names} <= order
    assert found == []


@pytest.mark.slow
def test_the_modules_of_all_effects_are_loaded_where_all_are_on(place):
    """The other half: each of these names is one that a run can load."""
    order, _ = loaded_modules(place, (), ())
    assert {e for names in ABSENT for e in names} <= order
    for modules in ABSENT.values():
        assert all(importlib.util.find_spec(module) is not None for module in modules)
