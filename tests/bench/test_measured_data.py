"""Stored measurements: limits on errors and counts, and rows that are measured again.

Times are never looked at.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench import accuracy_page
from bench.optics.light_rays import led_scene
from bench.page.ladder_record import LadderRecord
from bench.stiffness import stiffness_cases

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

MACHINE = ("machine", "system", "processor", "cores", "threads", "python", "numpy", "scipy",
           "numba", "seed")  # fmt: skip
OURS_AT_MOST = {
    "stiffness-0p3223": 0.032,
    "stiffness-0p49": 0.032,
    "light-delivered": 0.005,
    "light-leak": 0.01,
    "tessellation-stl": 12.0,
    "tessellation-glb": 50.0,
    "detection": 0.06,
    "matching": 0.001,
    "interpolation": 0.06,
    "compensation": 1e-9,
    "normal-sources-any-object": 0.02,
    "normal-sources-ball": 0.025,
    "contact-tolerance": 0.05,
    "drawing": 0.003,
    "shading": 2.0,
}
"""Largest error of our default, in the ladder's unit."""
PAPER_AT_LEAST = {
    "stiffness-0p3223": 0.3,
    "stiffness-0p49": 3.0,
    "matching": 0.03,
    "compensation": 1e-3,
}
"""Smallest error of the paper's choice."""
COUNT_AT_MOST = {
    ("stiffness-0p3223", "fft (lumped 1), 42² x 4 bbar"): 0.7,
    ("stiffness-0p49", "pcg (rtol 0.0001), 42² x 4 bbar"): 25.0,
    ("tessellation-stl", "as built"): 11_000,
    ("tessellation-glb", "100 µm, 20°"): 18_000,
    ("detection", "near predictions, noise 8"): 0.2,
}
"""MB kept, triangles, % of dots missed or spurious."""


def stored(name: str) -> Any:
    return json.loads((DOCS / "data" / f"{name}.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def ladders() -> dict[str, LadderRecord]:
    return {ladder.name: ladder for ladder in accuracy_page.read_ladders(DOCS)}


def test_every_ladder_says_what_it_was_measured_on(ladders: dict[str, LadderRecord]) -> None:
    for ladder in ladders.values():
        assert set(MACHINE) <= set(ladder.header), ladder.source


def test_errors_and_counts_stay_within_limits(ladders: dict[str, LadderRecord]) -> None:
    for name, most in OURS_AT_MOST.items():
        assert max(r.error for r in ladders[name].ours) <= most, name
    for name, least in PAPER_AT_LEAST.items():
        assert min(r.error for r in ladders[name].papers) >= least, name
    for (name, label), most in COUNT_AT_MOST.items():
        (rung,) = (r for r in ladders[name].rungs if r.label == label)
        assert rung.count is not None
        assert rung.count <= most, (name, label)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "rung", "parameters"),
    [
        ("paper", "paper", {}),
        ("fft (lumped 1)", "fft", {"lumped": 1}),
        ("pcg (rtol 0.01)", "pcg", {"rtol": 1e-2}),
    ],
)
def test_stiffness_is_measured_again(label: str, rung: Any, parameters: dict[str, float]) -> None:
    from ifem_export.operators.ladder import bumps, reference_forces, refined
    from ifem_export.operators.surface_operator import surface_operator

    mesh, gel = stiffness_cases.pad(), stiffness_cases.gel()
    fine, points = refined(mesh), np.asarray(mesh.surface_mm)
    operator = surface_operator(mesh, gel, "bbar", rung, **parameters)
    found = 0.0
    fields = bumps(mesh)
    for field, truth in zip(fields, reference_forces(mesh, gel, fields, fine), strict=True):
        off = np.linalg.norm(operator.force(field(points)) - truth) / np.linalg.norm(truth)
        found = max(found, float(off))
    (row,) = (
        r
        for r in stored("stiffness_ladder")["rows"]
        if (r["poissons_ratio"], r["cells"], r["layers"], r["element"], r["label"])
        == (0.3223, 42, 4, "bbar", label)
    )
    assert found == pytest.approx(row["error_field"], rel=1e-3)
    assert operator.n_bytes <= 1.01 * row["n_bytes"]


def test_light_is_traced_again() -> None:
    from gelslim_optics.light.trace import trace_light

    data = stored("light_rays")["ladder"]
    (row,) = (
        r for r in data["rows"] if (r["rays"], r["sampling"], r["split"]) == (4096, "sobol", 0.05)
    )
    result = trace_light(led_scene(), 4096, seed=0)
    for entry, known in data["reference"].items():
        off = abs(result.value(entry) / known["value"] - 1)
        assert off < 4 * row[f"error_{entry}"], entry
    assert result.crossings == pytest.approx(row["faces_per_ray"], rel=0.02)


def test_matching_is_tried_again() -> None:
    from bench.rigs.force_ladder_markers import nearest_dots, rest_lattice, shot
    from bench.rigs.force_rig import SEED, small_rig
    from gelslim_force.tracking.matching import match

    rig = small_rig()
    reference, rng = rest_lattice(rig), np.random.default_rng(SEED)
    wrong = {"nearest": 0, "robust": 0}
    for _ in range(6):
        points, truth = shot(rig, reference, 0.9, rng)
        found = {
            "nearest": nearest_dots(reference.positions_px, points),
            "robust": match(reference, points).dots,
        }
        for mode, dots in found.items():
            seen = dots >= 0
            wrong[mode] += int((truth[dots[seen]] != np.flatnonzero(seen)).sum())
    assert wrong["robust"] <= 0.001 * 6 * len(reference)
    assert wrong["nearest"] >= 0.05 * 6 * len(reference)


@pytest.mark.parametrize("row", stored("stiffness_cases")["iterations"])
def test_iterations_of_the_solver(row: dict[str, Any]) -> None:
    """Within one: the rounding of a processor may decide."""
    found = stiffness_cases.iterations(row["poissons_ratio"])
    assert found == pytest.approx(row["iterations"], abs=1)


@pytest.mark.slow
def test_cut_cells_are_measured_again() -> None:
    held = stored("stiffness_cases")["cut_cells"]
    found = stiffness_cases.cut_cells()
    for weighting, errors in held["error"].items():
        assert found["error"][weighting] == pytest.approx(errors, abs=6e-4)


@pytest.mark.slow
@pytest.mark.parametrize("row", stored("stiffness_cases")["noise"])
def test_noise_is_measured_again(row: dict[str, Any]) -> None:
    found = stiffness_cases.noise(row["poissons_ratio"], row["noise_um"])
    for way in ("direct", "smoothed", "masked"):
        for key in ("field", "normal"):
            assert found[way][key] == pytest.approx(row[way][key], abs=6e-4), (way, key)
        # The mean is right within three standard errors.
        assert abs(found[way]["normal_mean"]) < 3 * found[way]["normal"] / row["draws"] ** 0.5


def test_the_planners_choice_keeps_every_tolerance() -> None:
    data = stored("twin_ladders")
    gallery = {p.stem for p in (ROOT / "designs" / "scenes").glob("*.yaml")}
    measured = {r["scene"] for r in data["effects"]}
    assert len(measured & gallery) == len(measured) >= 8
    chosen = [r for r in data["drops"] if r["label"] == "auto"]
    assert {r["scene"] for r in chosen} == measured
    assert max(r["of_tolerance"] for r in chosen) <= 1


def test_planning_with_a_probe_keeps_every_tolerance_and_saves() -> None:
    """Measured on the gallery and on random scenes; what was forced by a scene is not counted."""
    cases = stored("twin_planning")["cases"]
    rows = [row for row in cases.values() if "used" in row]
    assert len({row["scene"] for row in rows if "scene" in row}) >= 9
    assert sum("seed" in row for row in rows) >= 5
    above = {
        (name, observable)
        for name, row in cases.items()
        for observable, share in row.get("used", {}).items()
        if share > max(1.0, row["promised"][observable])
    }
    # The pictures differ by one grey level in 0.04 % of the pixels; a threshold of the detector
    # moves one dot at the wall of the ring. Its markers are held like all others.
    assert not above
    loose = [row for name, row in cases.items() if name.endswith(" loose")]
    ratios = sorted((row["ms"] + row["planning_ms"]) / row["whole_ms"] for row in loose)
    assert ratios[len(ratios) // 2] <= 0.2


def test_planning_costs_at_most_a_hundredth() -> None:
    """Planning and records alone, and a quarter of the pairs of whole runs."""
    part = stored("twin_ladders")["overhead"]
    assert 0 < part["plan_ms"] <= part["bookkeeping_ms"]
    assert max(part["bookkeeping"], part["quartiles"][0]) <= 0.01


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_tighter_contacts_err_less(friction: float) -> None:
    data = stored("twin_ladders")
    rungs = [r for r in data["contact"] if r["friction"] == friction]
    assert [r["tolerance"] for r in rungs] == sorted((r["tolerance"] for r in rungs), reverse=True)
    assert rungs[-1]["field_error"] < 0.1 * rungs[0]["field_error"]
    (auto,) = (r for r in rungs if r["auto"])
    assert auto["field_error"] < 0.01
    layers = [r for r in data["layers"] if r["friction"] == friction]
    assert [r["layers"] for r in layers] == list(range(1, 9))
    errors = [r["field_error"] for r in layers]
    assert errors == sorted(errors, reverse=True)
    if friction:
        steps = [r["field_error"] for r in data["steps"] if r["friction"] == friction]
        assert steps == sorted(steps, reverse=True)
        assert steps[-1] < 0.5 * steps[0]
