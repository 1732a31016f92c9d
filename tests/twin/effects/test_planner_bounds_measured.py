"""What the planner says an effect may cost against what it costs, solved and measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sim_rig import small_sensor, written_scene

from gelslim_twin.effects.effect import OBSERVABLES
from gelslim_twin.planning.planner import make_plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

BALL = "shape: sphere\n    radius_mm: 6"
RING = "shape: ring\n    outer_radius_mm: 4\n    inner_radius_mm: 3"
CONE = "shape: cone\n    included_angle_deg: 120\n    tip_radius_mm: 1.0"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("bounds")
    small_sensor(place)
    return place


@pytest.mark.parametrize("effect", ["normal_contact", "friction", "nonlinearity"])
@pytest.mark.parametrize("tool", [BALL, RING, CONE])
def test_bound_is_no_less_than_what_leaving_the_effect_out_costs(folder, effect, tool):
    loaded = read_scene(written_scene(folder, (BALL, tool)))
    figures = bundle_figures(folder / "bundle")
    sensor = TwinSensor(load_bundle(folder / "bundle"))
    asked = replace(question(loaded, figures), observe=OBSERVABLES)
    c = asked.circumstances

    def solved(**use):
        chosen = {"nonlinearity": "off", "friction": "off"} | use
        given = {
            name: p.model_copy(update={"use": chosen.get(name, "auto")})
            for name, p in c.parameters.items()
        }
        plan = make_plan(replace(asked, circumstances=replace(c, parameters=given)))
        pad = SurfaceCompliance(sensor.bundle)
        states = list(mechanics_of(loaded, plan, pad).states(loaded.poses))
        return plan.choice(effect).size, states

    bound, on = solved(**({} if effect == "normal_contact" else {effect: "on"}))
    off = solved()[1]
    if effect == "normal_contact":
        off = [replace(s, force_n=0 * s.force_n, displacement_mm=0 * s.displacement_mm) for s in on]
    pairs = list(zip(on, off, strict=True))
    force = max(np.linalg.norm((a.force_n - b.force_n).sum(axis=0)) for a, b in pairs)
    moved = max(
        np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1).max() for a, b in pairs
    )
    assert 0 < force <= bound.force_n
    assert 0 < moved * figures.px_per_mm <= bound.displacement_px
