"""What the planner says a rung of the contact leaves of error, against solved contacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sim_rig import SCENE, small_sensor
from threadpoolctl import threadpool_limits

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.contact import FRICTION, NORMAL_CONTACT, RUNGS
from gelslim_twin.effects.large_strain import NONLINEARITY
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

BALL = "- shape: sphere\n    radius_mm: 6"
TOOLS = {
    "ball": BALL,
    "cone": "- {shape: cone, included_angle_deg: 120, tip_radius_mm: 1.0}",
    "wedge": "- {shape: wedge, included_angle_deg: 90, tip_radius_mm: 0.3, length_mm: 8, "
    "axis_deg: 30}",
    "cylinder": "- {shape: cylinder, radius_mm: 4, length_mm: 5}",
}
DRAG = "{move: shear, x_mm: 0.15, steps: 3, duration_s: 0.15}"
SLIDE = "{move: shear, x_mm: 1.5, y_mm: 0.4, steps: 12, duration_s: 0.5}"


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_sensor(tmp_path_factory.mktemp("rungs"))


def largest(one: list[GelState], other: list[GelState]) -> tuple[float, float]:
    """Motion in mm of the worst node, and resultant in N, of the worst pose."""
    pairs = list(zip(one, other, strict=True))
    moved = max(
        np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1).max() for a, b in pairs
    )
    return moved, max(np.linalg.norm((a.force_n - b.force_n).sum(axis=0)) for a, b in pairs)


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("tool", TOOLS)
def test_no_rung_leaves_more_than_it_says(
    sensor: Path, tmp_path: Path, tool: str, mu: float
) -> None:
    """Ridges and tips too, where the solver's tolerance alone says too little.

    The wedge is not dragged: which nodes its ends hold is not decided by any tolerance.
    """
    text = SCENE.format(bundle=sensor).replace(BALL, TOOLS[tool]).replace("0.6", f"{mu}")
    text = text.replace(DRAG, SLIDE) if tool != "wedge" else text.replace(f"    - {DRAG}\n", "")
    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    loaded = read_scene(path)
    c = question(loaded, bundle_figures(sensor)).circumstances
    kept = SurfaceCompliance(load_bundle(sensor))

    def solved(tolerance: float) -> list[GelState]:
        shapes = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
        solver = ContactSolver(kept, shapes, ContactSettings(tolerance, mu))
        return list(solver.states(loaded.poses))

    with threadpool_limits(1, user_api="blas"):
        true = solved(1e-7)
        for (name, tolerance), rung in zip(RUNGS, NORMAL_CONTACT.ladder(c), strict=True):
            assert (name, {"tolerance": tolerance}) == (rung.name, rung.parameters)
            moved, force = largest(solved(tolerance), true)
            assert moved * c.sensor.px_per_mm <= rung.error.displacement_px, name
            assert force <= rung.error.force_n, name


def test_no_rung_errs_by_more_than_the_effect_itself(sensor: Path, tmp_path: Path) -> None:
    """Friction of next to nothing cannot be simulated with more error than left out."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.format(bundle=sensor), encoding="utf-8")
    c = question(read_scene(path), bundle_figures(sensor)).circumstances
    for mu in (1e-6, 1e-3, 1.0):
        slight = replace(c, friction=mu)
        for effect in (FRICTION, NONLINEARITY):
            whole = effect.bound(slight)
            for rung in effect.ladder(slight):
                assert rung.error == rung.error.at_most(whole)
