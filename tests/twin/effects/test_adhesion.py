"""Size of adhesion against solved contacts, and its scenes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, small_pad
from effect_samples import FIGURES, circumstances
from sim_rig import small_sensor, written_scene

from gelslim_core.yaml.errors import InputError
from gelslim_twin.contact.adhesive_contact import AdhesiveContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.adhesion import (
    ADHESION,
    AdhesionParameters,
    adhesion_bound,
    adhesion_ladder,
)
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound
from gelslim_twin.planning.question import motion_figures, plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

SIDE_MM, CELLS, NU = 12.0, 20, 0.4
TOOLS: dict[str, Indenter] = {
    "ball": Sphere(shape="sphere", radius_mm=6.0),
    "punch": FlatPunch(shape="flat_punch", length_mm=4.3, width_mm=2.7),
}


@cache
def pad() -> SurfaceCompliance:
    return SurfaceCompliance(small_pad(NU, CELLS, 2, SIDE_MM, 2.0))


PATH = tuple(
    Pose(float(k), depth_mm=float(d))
    for k, d in enumerate(np.concatenate([np.linspace(0, 0.2, 5), np.linspace(0.2, -1.5, 24)[1:]]))
)


def asked(tool: Indenter, work_j_m2: float) -> Circumstances:
    sensor = replace(
        FIGURES, length_mm=SIDE_MM, width_mm=SIDE_MM, thickness_mm=2.0, poissons_ratio=NU,
        youngs_modulus_mpa=YOUNGS_MPA, surface_nodes=(CELLS + 1) ** 2,
    )  # fmt: skip
    footprint = tool_footprint((tool,), Path(), SIDE_MM**2, SIDE_MM / CELLS)
    return circumstances(
        0.0, footprint, sensor, motion_figures(PATH, footprint),
        adhesion=AdhesionParameters(work_j_m2=work_j_m2),
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("work_j_m2", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("name", TOOLS)
def test_the_bound_covers_solved_contacts(name: str, work_j_m2: float) -> None:
    tool, settings = Tool.of([TOOLS[name]], Path()), ContactSettings(1e-3, 0.0)
    plain = list(ContactSolver(pad(), tool, settings).states(PATH))
    found = list(AdhesiveContact(ContactSolver(pad(), tool, settings), work_j_m2).states(PATH))
    bound = adhesion_bound(asked(TOOLS[name], work_j_m2))
    pairs = list(zip(plain, found, strict=True))
    force = max(float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0))) for a, b in pairs)
    moved = max(float(np.abs(a.displacement_mm - b.displacement_mm).max()) for a, b in pairs)
    assert 0.05 * bound.force_n < force <= bound.force_n
    assert moved * FIGURES.px_per_mm <= bound.displacement_px


def test_without_work_or_contact_there_is_none() -> None:
    assert ADHESION.is_null(circumstances())
    c = asked(TOOLS["ball"], 0.5)
    assert not ADHESION.is_null(c)
    assert adhesion_bound(replace(c, motion=replace(c.motion, depth_mm=0.0))) == Bound()


def test_its_rung_errs_by_the_nodes_on_the_radius() -> None:
    c = asked(TOOLS["ball"], 0.5)
    fine = replace(c, sensor=replace(c.sensor, surface_nodes=4 * c.sensor.surface_nodes))
    [coarse_rung], [fine_rung] = adhesion_ladder(c), adhesion_ladder(fine)
    assert coarse_rung.error.force_n == pytest.approx(2 * fine_rung.error.force_n)
    assert fine_rung.error.force_n < adhesion_bound(c).force_n


def test_a_scene_plans_it_by_its_size_and_refuses_it_at_large_strain(tmp_path: Path) -> None:
    figures = bundle_figures(small_sensor(tmp_path))
    sensor = TwinSensor(load_bundle(tmp_path / "bundle"))
    kept = []
    for work in ("1.0e-4", "20"):
        change = ("effects:", f"effects:\n  adhesion: {{work_j_m2: {work}}}")
        loaded = read_scene(written_scene(tmp_path, change))
        kept.append("adhesion" in plan_scene(loaded, figures).order)
    assert kept == [False, True]
    mechanics = job_of(loaded, sensor, tmp_path).mechanics()
    assert isinstance(mechanics, AdhesiveContact)
    assert mechanics.work_j_m2 == 20
    change = ("use: off}", "use: on}\n  adhesion: {use: on, work_j_m2: 1}")
    with pytest.raises(InputError) as caught:
        job_of(read_scene(written_scene(tmp_path, change)), sensor, tmp_path)
    [problem] = caught.value.problems
    assert problem.field == "effects.adhesion"
    assert "adhesion: off" in problem.remedy
