"""Coat and fabric in scenes: the bound, null without a skin, friction, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from effect_samples import FIGURES
from scene_samples import ROOT
from sim_rig import small_sensor, written_scene

from gelslim_cad.gel import gel_skin
from gelslim_cad.sensor import spec_hash
from gelslim_cad.spec import Spec
from gelslim_cad.tolerance.asked import read_spec
from gelslim_core.yaml.errors import InputError
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.circumstances import Circumstances, MotionFigures
from gelslim_twin.effects.effect import Bound
from gelslim_twin.effects.skin import SKIN, skin_bound
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Sphere, TexturedPlane
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.skin import Membrane, Skin

TOOLS: dict[str, tuple[Indenter, float]] = {
    "ball": (Sphere(shape="sphere", radius_mm=10), 0.4),
    "small": (Sphere(shape="sphere", radius_mm=2), 0.4),
    "punch": (FlatPunch(shape="flat_punch", radius_mm=3.1), 0.2),
    "ridges": (
        TexturedPlane(shape="textured_plane", length_mm=8.7, width_mm=8.7, texture="ridges",
                      pitch_mm=3, relief_mm=0.3),
        0.3,
    ),
}  # fmt: skip
SIDE_MM, CELLS, SLIDE_MM = 14.0, 24, 0.2


def states(
    tool: Indenter, depth: float, stiffness: float, friction: float, nu: float
) -> list[GelState]:
    skin = (Membrane(stiffness),) if stiffness else ()
    compliance = SurfaceCompliance(small_pad(nu, CELLS, 4, SIDE_MM), None, skin)
    solver = ContactSolver(compliance, Tool.of([tool], Path()), ContactSettings(1e-3, friction))
    path = [Pose(0.0, depth_mm=depth / 2), Pose(1.0, depth_mm=depth)]
    return list(solver.states((*path, Pose(2.0, x_mm=SLIDE_MM, depth_mm=depth))))


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.32, 0.49])
@pytest.mark.parametrize("friction", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("name", TOOLS)
def test_the_bound_is_never_exceeded(name: str, friction: float, nu: float) -> None:
    """By what leaving out a coat of 0.01 to a fabric of 1 N/mm changes, press and slide."""
    tool, depth = TOOLS[name]
    bare = states(tool, depth, 0.0, friction, nu)
    for stiffness in (0.01, 0.1, 1.0):
        found = states(tool, depth, stiffness, friction, nu)
        force = max(
            np.linalg.norm((a.force_n - b.force_n).sum(axis=0))
            for a, b in zip(found, bare, strict=True)
        )
        moved = max(
            np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1).max()
            for a, b in zip(found, bare, strict=True)
        )
        sensor = replace(
            FIGURES, length_mm=SIDE_MM, width_mm=SIDE_MM, thickness_mm=2.0, poissons_ratio=nu,
            surface_nodes=(CELLS + 1) ** 2, skin_n_per_mm=stiffness,
        )  # fmt: skip
        footprint = tool_footprint((tool,), Path(), SIDE_MM**2, SIDE_MM / CELLS)
        motion = MotionFigures(poses=3, depth_mm=depth, lateral_mm=SLIDE_MM)
        bound = skin_bound(Circumstances(sensor, motion, footprint, friction, {}))
        assert force <= bound.force_n
        assert moved * sensor.px_per_mm <= bound.displacement_px


def scene_on(folder: Path, skin: Skin | None, change: tuple[str, str] = ("", "")) -> LoadedScene:
    """The small scene, on its sensor with a skin."""
    bare = load_bundle(small_sensor(folder))
    write_bundle(folder / "bundle", replace(bare, skin=skin))
    return read_scene(written_scene(folder, change))


def solved(folder: Path, loaded: LoadedScene) -> list[GelState]:
    job = job_of(loaded, TwinSensor(load_bundle(folder / "bundle")), folder)
    return list(job.mechanics().states(loaded.poses[:4]))


@pytest.mark.slow
def test_a_scene_in_fabric_changes_its_forces(tmp_path: Path) -> None:
    """By the skin alone; switched off, the states are those of the bare gel bit for bit."""
    skin = Skin(None, Membrane(0.5), 0.3)
    worn = solved(tmp_path, scene_on(tmp_path, skin))
    off = solved(tmp_path, scene_on(tmp_path, skin, ("use: off}", "use: off}\n  skin: off")))
    bare = solved(tmp_path, scene_on(tmp_path, None))
    for a, b in zip(off, bare, strict=True):
        np.testing.assert_array_equal(a.force_n, b.force_n)
        np.testing.assert_array_equal(a.displacement_mm, b.displacement_mm)
    apart = np.linalg.norm(worn[-1].force_n - bare[-1].force_n)
    assert apart > 0.01 * np.linalg.norm(bare[-1].force_n)


def test_without_skin_the_effect_is_null(tmp_path: Path) -> None:
    c = question(scene_on(tmp_path, None), bundle_figures(tmp_path / "bundle")).circumstances
    assert SKIN.is_null(c)
    assert skin_bound(c) == Bound()
    worn = replace(c, sensor=replace(c.sensor, skin_n_per_mm=0.05))
    assert not SKIN.is_null(worn)
    assert skin_bound(worn).force_n > 0


def test_friction_of_the_skin_serves_scenes_that_give_none(tmp_path: Path) -> None:
    skin = Skin(Membrane(0.05), friction=0.8)
    given = scene_on(tmp_path, skin)
    assert question(given, bundle_figures(tmp_path / "bundle")).circumstances.friction == 0.6
    silent = scene_on(tmp_path, skin, ("contact:\n  friction: 0.6\n", ""))
    assert question(silent, bundle_figures(tmp_path / "bundle")).circumstances.friction == 0.8
    mechanics = job_of(silent, TwinSensor(load_bundle(tmp_path / "bundle")), tmp_path).mechanics()
    assert mechanics.settings.friction == 0.8  # type: ignore[attr-defined]


def test_large_strain_takes_a_bare_gel(tmp_path: Path) -> None:
    loaded = scene_on(tmp_path, Skin(Membrane(0.5)), ("use: off", "use: on"))
    with pytest.raises(InputError) as caught:
        job_of(loaded, TwinSensor(load_bundle(tmp_path / "bundle")), tmp_path)
    problem = caught.value.problems[0]
    lines = Path(loaded.path).read_text().splitlines()
    assert problem.line is not None
    assert lines[problem.line - 1].strip().startswith("nonlinearity")
    assert "skin: off" in problem.remedy


def test_a_spec_with_a_coat() -> None:
    plain = read_spec(ROOT / "designs" / "gelslim2.yaml").spec
    material = {"coat": {"stiffness_n_per_mm": 0.05, "friction": 0.9},
                "fabric": {"stiffness_n_per_mm": 2.0, "poissons_ratio": 0.1}}  # fmt: skip
    values = plain.model_dump()
    worn = Spec.model_validate(values | {"material": values["material"] | material})
    assert gel_skin(plain) is None
    assert gel_skin(worn) == Skin(Membrane(0.05, 0.3), Membrane(2.0, 0.1), 0.9)
    assert spec_hash(plain) != spec_hash(worn)
