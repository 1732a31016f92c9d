"""Size and rungs of friction by the speed of slip against solved contacts, and its scenes."""

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
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.sliding_friction import SlidingContact, SlidingLaw
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.sliding_friction import (
    SLIDING_FRICTION,
    SlidingFrictionParameters,
    is_jerky,
    sliding_friction_bound,
    sliding_friction_ladder,
)
from gelslim_twin.planning.question import motion_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

SIDE_MM, CELLS, NU = 14.0, 14, 0.45
TOOLS: dict[str, Indenter] = {
    "ball": Sphere(shape="sphere", radius_mm=8.0),
    "punch": FlatPunch(shape="flat_punch", length_mm=4.3, width_mm=2.7),
}
LAWS = {
    "falls": SlidingLaw(0.8, 0.5, 2.0, 1.5),
    "jerks": SlidingLaw(0.8, 0.4, 2.0, 0.1),
    "rises": SlidingLaw(0.4, 0.7, 2.0, 0.5),
}


@cache
def pad() -> SurfaceCompliance:
    return SurfaceCompliance(small_pad(NU, CELLS, 2, SIDE_MM, 2.0))


def poses(speed_mm_s: float) -> tuple[Pose, ...]:
    """A press, a drag, a rest, and a drag back."""
    ways = ((0.0, 1.0), (0.4, 0.4), (0.8, 0.4), (1.2, 0.4), (1.2, 1.0), (0.8, 0.4))
    found, time_s = [Pose()], 0.0
    for x, way in ways:
        time_s += way / speed_mm_s
        found.append(Pose(time_s, x, 0.0, 0.25))
    return tuple(found)


def asked(tool: Indenter, law: SlidingLaw, path: tuple[Pose, ...]) -> Circumstances:
    sensor = replace(
        FIGURES, length_mm=SIDE_MM, width_mm=SIDE_MM, thickness_mm=2.0, poissons_ratio=NU,
        youngs_modulus_mpa=YOUNGS_MPA, surface_nodes=(CELLS + 1) ** 2,
    )  # fmt: skip
    footprint = tool_footprint((tool,), Path(), SIDE_MM**2, SIDE_MM / CELLS)
    given = SlidingFrictionParameters(
        kinetic=law.kinetic, speed_mm_s=law.speed_mm_s, memory_mm=law.memory_mm
    )
    return circumstances(
        law.static, footprint, sensor, motion_figures(path, footprint), sliding_friction=given
    )


def apart(some: list[GelState], others: list[GelState]) -> tuple[float, float]:
    """Largest differences of the resultant in N and of displacements in px."""
    pairs = list(zip(some, others, strict=True))
    moved = max(float(np.abs(a.displacement_mm - b.displacement_mm).max()) for a, b in pairs)
    force = max(float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0))) for a, b in pairs)
    return force, moved * FIGURES.px_per_mm


@pytest.mark.slow
@pytest.mark.parametrize("speed_mm_s", [0.3, 3.0])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", TOOLS)
def test_sizes_and_rungs_cover_solved_contacts(name: str, law: str, speed_mm_s: float) -> None:
    given, path = LAWS[law], poses(speed_mm_s)
    tool = Tool.of([TOOLS[name]], Path())
    settings = ContactSettings(1e-4, given.static)
    c = asked(TOOLS[name], given, path)
    rungs = sliding_friction_ladder(c)
    found = {
        share: list(SlidingContact(pad(), tool, settings, given, share).states(path))
        for share in (1 / 64, *(float(rung.parameters["step_share"]) for rung in rungs))
    }
    bound = sliding_friction_bound(c)
    force, px = apart(list(ContactSolver(pad(), tool, settings).states(path)), found[1 / 64])
    assert force <= bound.force_n
    assert px <= bound.displacement_px
    for rung in rungs:
        force, px = apart(found[float(rung.parameters["step_share"])], found[1 / 64])
        assert force <= rung.error.force_n
        assert px <= rung.error.displacement_px


def test_what_makes_no_difference_is_null() -> None:
    path = poses(1.0)
    c = asked(TOOLS["ball"], LAWS["falls"], path)
    assert not SLIDING_FRICTION.is_null(c)
    assert SLIDING_FRICTION.is_null(replace(c, friction=0.0))
    assert SLIDING_FRICTION.is_null(replace(c, friction=0.5))
    assert SLIDING_FRICTION.is_null(circumstances())
    slow = asked(TOOLS["ball"], LAWS["falls"], poses(1e-3))
    assert sliding_friction_bound(slow).force_n < 0.01 * sliding_friction_bound(c).force_n


def test_a_gel_that_cannot_hold_the_tool_makes_it_stick_and_slip() -> None:
    """Then no rung promises more than the size of the effect; friction that rises is stable."""
    path = poses(3.0)
    c = {name: asked(TOOLS["ball"], law, path) for name, law in LAWS.items()}
    assert [is_jerky(c[name]) for name in ("falls", "jerks", "rises")] == [False, True, False]
    size = sliding_friction_bound(c["jerks"])
    assert all(rung.error == size for rung in sliding_friction_ladder(c["jerks"]))
    errors = [rung.error.force_n for rung in sliding_friction_ladder(c["falls"])]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.1 * sliding_friction_bound(c["falls"]).force_n
    times = [rung.milliseconds for rung in sliding_friction_ladder(c["falls"])]
    assert times == sorted(times)


def test_at_a_wall_that_slides_no_rung_promises_less_than_the_size() -> None:
    """When it lets go of a row of nodes changes with the way of a step, at 1/64 and 1/128 too."""
    c = asked(TOOLS["punch"], LAWS["rises"], poses(3.0))
    assert not is_jerky(c)
    assert all(rung.error == sliding_friction_bound(c) for rung in sliding_friction_ladder(c))


def test_a_scene_solves_it_and_refuses_it_at_large_strain(tmp_path: Path) -> None:
    small_sensor(tmp_path)
    law = "sliding_friction: {use: on, kinetic: 0.3, speed_mm_s: 2}"
    sensor = TwinSensor(load_bundle(tmp_path / "bundle"))
    loaded = read_scene(written_scene(tmp_path, ("effects:", f"effects:\n  {law}")))
    mechanics = job_of(loaded, sensor, tmp_path).mechanics()
    assert isinstance(mechanics, SlidingContact)
    assert (mechanics.law.static, mechanics.law.kinetic) == (0.6, 0.3)
    strained = written_scene(tmp_path, ("use: off}", f"use: on}}\n  {law}"))
    with pytest.raises(InputError) as caught:
        job_of(read_scene(strained), sensor, tmp_path)
    [problem] = caught.value.problems
    assert problem.field == "effects.sliding_friction"
    assert "sliding_friction: off" in problem.remedy
