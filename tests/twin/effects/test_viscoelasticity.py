"""Sizes and rungs of the viscoelastic gel against solved contacts, and its scenes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, small_pad
from effect_samples import FIGURES, circumstances
from pydantic import ValidationError
from sim_rig import small_sensor, written_scene

from gelslim_core.yaml.errors import InputError
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.viscoelastic_contact import ViscoelasticContact
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.contact import PronyTerm
from gelslim_twin.effects.effect import Bound
from gelslim_twin.effects.viscoelasticity import (
    VISCOELASTICITY,
    ViscoelasticityParameters,
    viscoelasticity_bound,
    viscoelasticity_ladder,
)
from gelslim_twin.planning.question import motion_figures, plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.simulation.simulate import simulate
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

SIDE_MM, CELLS = 12.0, 16
SENSOR = replace(
    FIGURES, length_mm=SIDE_MM, width_mm=SIDE_MM, thickness_mm=2.0, poissons_ratio=0.3,
    youngs_modulus_mpa=YOUNGS_MPA, surface_nodes=(CELLS + 1) ** 2,
)  # fmt: skip
PRESS, BACK, SLIDE = (
    ((0.0, 0.3),),
    ((0.0, 0.3), (0.0, -0.05), (0.0, -0.05)),
    ((0.0, 0.3), (1.5, 0.3)),
)
TOOLS: dict[str, Indenter] = {
    "ball": Sphere(shape="sphere", radius_mm=8.0),
    "punch": FlatPunch(shape="flat_punch", length_mm=4.0, width_mm=2.5),
}


def poses(way: tuple[tuple[float, float], ...]) -> tuple[Pose, ...]:
    """A second per leg."""
    places = enumerate(((0.0, 0.0), *way))
    return tuple(Pose(time_s=float(t), x_mm=x, depth_mm=d) for t, (x, d) in places)


def parameters(time_s: float, fraction: float = 0.4) -> ViscoelasticityParameters:
    return ViscoelasticityParameters(terms=(PronyTerm(fraction=fraction, time_s=time_s),))


def asked(
    tool: Indenter, way: tuple[tuple[float, float], ...], time_s: float, friction: float = 0.0
) -> Circumstances:
    footprint = tool_footprint((tool,), Path(), SIDE_MM**2, SIDE_MM / CELLS)
    return circumstances(
        friction, footprint, SENSOR, motion_figures(poses(way), footprint),
        viscoelasticity=parameters(time_s),
    )  # fmt: skip


@cache
def pad() -> SurfaceCompliance:
    return SurfaceCompliance(small_pad(0.3, CELLS, 2, SIDE_MM, 2.0))


def solver(tool: Indenter, friction: float = 0.0) -> ContactSolver:
    return ContactSolver(pad(), Tool.of([tool], Path()), ContactSettings(1e-6, friction))


def apart(some: list[GelState], others: list[GelState]) -> tuple[float, float]:
    """Largest differences of the resultant in N and of displacements in px."""
    pairs = list(zip(some, others, strict=True))
    moved = max(float(np.abs(a.displacement_mm - b.displacement_mm).max()) for a, b in pairs)
    return (
        max(float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0))) for a, b in pairs),
        moved * SENSOR.px_per_mm,
    )


@pytest.mark.slow
@pytest.mark.parametrize("time_s", [0.05, 0.7, 20.0])
@pytest.mark.parametrize("way", [PRESS, BACK, SLIDE], ids=["press", "back", "slide"])
@pytest.mark.parametrize("name", TOOLS)
def test_sizes_and_rungs_cover_solved_contacts(
    name: str, way: tuple[tuple[float, float], ...], time_s: float
) -> None:
    tool, series = TOOLS[name], PronySeries((0.4,), (time_s,))
    found = {
        steps: list(ViscoelasticContact(solver(tool), series, steps).states(poses(way)))
        for steps in (1, 2, 4, 8, 16, 48)
    }
    c = asked(tool, way, time_s)
    bound = viscoelasticity_bound(c)
    force, px = apart(list(solver(tool).states(poses(way))), found[48])
    assert force <= bound.force_n
    assert px <= max(bound.displacement_px, 2e-3)
    for rung in viscoelasticity_ladder(c):
        force, px = apart(found[int(rung.parameters["steps"])], found[48])
        assert force <= rung.error.force_n + 1e-6
        assert px <= max(rung.error.displacement_px, 2e-3)


def test_a_frictionless_contact_that_only_grows_has_the_surface_of_an_elastic_gel() -> None:
    c = asked(TOOLS["ball"], PRESS, 1.0)
    lost = 0.4 * (1 - math.exp(-1.0))
    whole = c.force_n * (1 + c.contact.nonlinear_excess)
    assert viscoelasticity_bound(c) == Bound(force_n=pytest.approx(lost * whole))
    assert viscoelasticity_bound(asked(TOOLS["ball"], PRESS, 1.0, 0.5)).markers_px > 0
    assert viscoelasticity_bound(asked(TOOLS["ball"], BACK, 1.0)).markers_px > 0
    assert viscoelasticity_bound(asked(TOOLS["ball"], SLIDE, 1.0)).markers_px > 0


def test_without_terms_or_contact_there_is_nothing() -> None:
    assert VISCOELASTICITY.is_null(circumstances())
    assert VISCOELASTICITY.is_null(circumstances(viscoelasticity=parameters(1.0, 0.0)))
    assert not VISCOELASTICITY.is_null(asked(TOOLS["ball"], BACK, 1.0))
    c = asked(TOOLS["ball"], ((0.0, -0.1),), 1.0)
    assert all(rung.error == Bound() for rung in (*viscoelasticity_ladder(c),))
    with pytest.raises(ValidationError, match=r"sum to 1\.2"):
        ViscoelasticityParameters(terms=(PronyTerm(fraction=0.6, time_s=1.0),) * 2)


TERMS = "viscoelasticity: {terms: [{fraction: 0.5, time_s: 0.1}]}"


def test_the_planner_takes_more_steps_for_a_tighter_tolerance(tmp_path: Path) -> None:
    small_sensor(tmp_path)
    rungs = []
    for force_n in ("20", "0.1", "0.004"):
        text = written_scene(tmp_path, ("effects:", f"effects:\n  {TERMS}")).read_text()
        text = text.replace("force_n: 0.2, image_px: 0.5", f"force_n: {force_n}, image_px: 50")
        (tmp_path / "scene.yaml").write_text(text)
        plan = plan_scene(read_scene(tmp_path / "scene.yaml"), bundle_figures(tmp_path / "bundle"))
        choice = plan.choice("viscoelasticity")
        rungs.append(int(dict(choice.rung_parameters).get("steps", 0)))
    assert rungs[0] == 0 < rungs[1] < rungs[2]


@pytest.mark.slow
def test_a_run_shows_the_dent_that_the_tool_left(tmp_path: Path) -> None:
    """Markers move back over the last frames, in which nothing touches the gel."""
    small_sensor(tmp_path)
    change = ("image]", "image]\ncamera: {}"), ("effects:", f"effects:\n  {TERMS}")
    text = written_scene(tmp_path).read_text()
    for pair in change:
        text = text.replace(*pair)
    text = text.replace("duration_s: 0.1}", "duration_s: 0.1}\n    - {move: hold, steps: 3}")
    (tmp_path / "scene.yaml").write_text(text)
    job = job_of(
        read_scene(tmp_path / "scene.yaml"), TwinSensor(load_bundle(tmp_path / "bundle")), tmp_path
    )
    simulate(job, tmp_path / "run")
    truth = np.load(tmp_path / "run" / "truth.npz")
    off = np.linalg.norm(truth["markers_px"] - truth["markers_px"][0], axis=2).max(axis=1)
    assert not truth["touch"][-4:].any()
    assert off[-4] > 0.5
    assert (np.diff(off[-4:]) < 0).all()
    # From the first to the last of them the closed form leaves exp(-(1 - g) t / tau).
    assert off[-1] / off[-4] == pytest.approx(math.exp(-0.5 * 0.5 / 0.1), rel=0.4)


def test_a_scene_of_large_strain_is_refused_with_a_remedy(tmp_path: Path) -> None:
    small_sensor(tmp_path)
    text = written_scene(tmp_path, ("use: off}", f"use: on}}\n  {TERMS[:-1]}, use: on}}"))
    with pytest.raises(InputError) as caught:
        job_of(read_scene(text), TwinSensor(load_bundle(tmp_path / "bundle")), tmp_path)
    [problem] = caught.value.problems
    assert problem.field == "effects.viscoelasticity"
    assert "relaxation" in problem.remedy
