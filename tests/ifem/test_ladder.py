"""The ladder: measured errors fall along it, budgets choose, and bundles carry it safely."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import MARKERS

from gelslim_core.budget.budget import Budget, BudgetError
from ifem_export.bundle.bundle import build_bundle
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.errors import BundleError, IfemError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import (
    lumped,
    measure_ladder,
    operator_choices,
    refined,
    time_operators,
)
from ifem_export.operators.ladder_contacts import (
    Disc,
    contact_motions,
    nodal_forces,
    standard_contacts,
)
from ifem_export.operators.operator_ladder import OperatorLadder
from ifem_export.operators.surface_operator import surface_operator

GEL = Material(0.147, 0.3223, 1020.0)


def pad(layers: int = 4) -> PadMesh:
    return build_pad_mesh(
        RoundedRectangle(16.0, 14.0, 2.0), 2.0, pitch_mm=(0.8, 0.7), layers=layers
    )[0]


@pytest.fixture(scope="module")
def ladder() -> OperatorLadder:
    return measure_ladder(pad(), GEL, "bbar")


def error(ladder: OperatorLadder, label: str) -> float:
    return next(r for r in ladder.rungs if r.label == label).error_field


def test_errors_fall_from_the_paper_to_condensation(ladder: OperatorLadder) -> None:
    assert error(ladder, "paper") > 0.2
    assert error(ladder, "pcg (rtol 0.01)") < 0.05
    assert error(ladder, "pcg (rtol 0.0001)") == pytest.approx(error(ladder, "factor"), rel=0.02)
    for rung in ladder.rungs:
        assert rung.milliseconds > 0
        assert rung.n_bytes > 0
    exact = next(r for r in ladder.rungs if r.rung == "factor")
    assert exact.error_operator < 1e-6


def test_noise_gains_are_those_of_the_operator(ladder: OperatorLadder) -> None:
    mesh = pad()
    operator = surface_operator(mesh, GEL, "bbar", "factor")
    count = len(mesh.surface)
    columns = np.zeros((2, count, 3))
    columns[0, count // 2, 0] = columns[1, count // 2, 2] = 1.0
    # The variance of a component is the sum of squares of a row of S, which is symmetric.
    rows = [np.linalg.norm(operator.force(c)) for c in columns]
    found = next(r for r in ladder.rungs if r.rung == "factor")
    assert 0.6 * min(rows) < found.noise_node_n_per_mm < 1.4 * max(rows)
    # The resultant of noise u is e·S u = (S e)·u for a uniform motion e, by symmetry.
    uniform = np.broadcast_to(np.eye(3)[:, None, :], (3, count, 3))
    gains = [np.linalg.norm(operator.force(e)) for e in uniform]
    expected = np.sqrt(np.mean(np.square(gains)))
    assert 0.6 * expected < found.noise_resultant_n_per_mm < 1.4 * expected


def test_the_resultant_of_the_paper_is_right_and_its_field_is_not(ladder: OperatorLadder) -> None:
    paper = next(r for r in ladder.rungs if r.rung == "paper")
    assert paper.error_resultant < 0.1
    assert paper.error_field > 4 * paper.error_resultant


def halved(mesh: PadMesh) -> PadMesh:
    cells = np.asarray(mesh.occupancy).repeat(2, 0).repeat(2, 1).repeat(2, 2)
    hx, hy, hz = mesh.cell_size_mm
    return PadMesh.from_occupancy(cells, (hx / 2, hy / 2, hz / 2), mesh.origin_mm)


@pytest.mark.slow
def test_halving_cells_quarters_the_error_of_the_field() -> None:
    coarse, _ = build_pad_mesh(RoundedRectangle(16.0, 14.0, 0.0), 4.0, cells=(16, 20, 4))
    middle = halved(coarse)
    fine = halved(middle)

    def force(mesh: PadMesh) -> np.ndarray:
        points = np.asarray(mesh.nodes_mm)[mesh.surface]
        bump = np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 8)
        u = bump[:, None] * np.array([0.3, 0.0, -1.0])
        return surface_operator(mesh, GEL, "bbar", "pcg", rtol=1e-8).force(u)

    best = lumped(lumped(force(fine), fine, middle), middle, coarse)
    errors = [
        np.linalg.norm(found - best)
        for found in (force(coarse), lumped(force(middle), middle, coarse))
    ]
    # Against the finest of three, h² gives log2((1 - 1/16) / (1/4 - 1/16)) = 2.3.
    assert 1.9 < np.log2(errors[0] / errors[1]) < 2.8


@pytest.mark.slow
def test_more_layers_err_less() -> None:
    errors = [
        next(r.error_field for r in measure_ladder(pad(n), GEL, "bbar").rungs if r.rung == "factor")
        for n in (2, 4)
    ]
    assert errors[1] < 0.6 * errors[0]


def test_lumping_keeps_the_resultant() -> None:
    mesh = pad()
    fine = refined(mesh)
    force = np.random.default_rng(0).normal(size=(len(fine.surface), 3))
    np.testing.assert_allclose(lumped(force, fine, mesh).sum(axis=0), force.sum(axis=0), atol=1e-9)


def test_budgets_choose(ladder: OperatorLadder) -> None:
    timed = ladder.timed({r.label: float(k + 1) for k, r in enumerate(ladder.rungs)})
    worst = {r.label: r.error for r in ladder.rungs}
    assert worst["pcg (rtol 0.01)"] < worst["fft (lumped 1)"] < worst["fft"]

    def chosen(error: float | None = None, time_ms: float | None = None) -> str:
        return timed.choose(Budget(error, time_ms)).rung.name

    for error in sorted(worst.values()):
        label = chosen(1.001 * error)
        assert worst[label] <= 1.001 * error
        work = {r.label: r.n_bytes for r in ladder.rungs if r.error <= 1.001 * error}
        assert work[label] == min(work.values())
    assert chosen(time_ms=1.5) == "paper"
    assert worst[chosen(time_ms=100.0)] == min(worst.values())
    for budget in ({"error": 0.99 * min(worst.values())}, {"time_ms": 0.5}):
        with pytest.raises(BudgetError):
            chosen(**budget)


def test_an_error_is_kept_by_contacts_it_was_not_measured_on(ladder: OperatorLadder) -> None:
    """Other places and directions, pressures between those of a ball and of a punch, two sizes.

    A circulant operator promised 3 % and erred by 12 % where a slide reached the edge.
    """
    mesh, fine = pad(), refined(pad())
    exact = surface_operator(fine, GEL, "bbar", "pcg", rtol=1e-8)
    a = standard_contacts(mesh)["small_ball"][0].radius_mm
    discs = [
        Disc(np.array([1.0, -1.5]), 1.3 * a, np.array([0.6, 0.5, -1.0])),
        Disc(np.array([-2.5, 1.0]), a, np.array([-0.1, 0.4, -1.0]), is_sharp=True),
        Disc(np.array([0.3, 6.6]), a, np.array([0.0, -0.5, -1.0])),
        Disc(np.array([-7.0, 2.0]), a, np.array([0.5, 0.4, -1.0])),
    ]
    forces = [nodal_forces(fine, (disc,)) for disc in discs]
    moved = contact_motions(exact, fine, mesh, forces)
    for label in ("fft (lumped 1)", "pcg (rtol 0.01)", "factor"):
        rung = ladder.named(label)
        assert rung is not None
        operator = surface_operator(mesh, GEL, "bbar", rung.rung, **rung.parameters)
        for u, force in zip(moved, forces, strict=True):
            expected = lumped(force, fine, mesh)
            off = np.linalg.norm(operator.force(u) - expected) / np.linalg.norm(expected)
            assert off < 1.15 * rung.error, (label, off)


def test_an_error_picks_the_same_operator_and_the_same_bits_whatever_the_clock(
    ladder: OperatorLadder,
) -> None:
    rng = np.random.default_rng(5)
    field = rng.normal(size=(len(pad().surface), 3))
    slow = ladder.timed({r.label: float(10 ** rng.uniform(-4, 4)) for r in ladder.rungs})
    quick = ladder.timed({r.label: float(10 ** rng.uniform(-4, 4)) for r in ladder.rungs})
    assert slow != quick
    assert slow.balanced().label == quick.balanced().label == ladder.balanced().label
    for error in (0.5, *(1.01 * r.error for r in ladder.rungs[-2:])):
        forces = [
            build_bundle(pad(), GEL, "bbar", with_stiffness=False, ladder=one)
            .surface_operator(budget=Budget(error))
            .force(field)
            for one in (slow, quick)
        ]
        assert forces[0].tobytes() == forces[1].tobytes()


@pytest.mark.slow
def test_times_are_measured_anew_for_every_rung(ladder: OperatorLadder) -> None:
    times = time_operators(operator_choices(pad()), pad(), GEL, "bbar")
    assert list(times) == [r.label for r in ladder.rungs]
    assert all(ms > 0 for ms in times.values())
    again = ladder.timed(times)
    assert [r.milliseconds for r in again.rungs] == list(times.values())
    assert [r.error_field for r in again.rungs] == [r.error_field for r in ladder.rungs]


def test_operators_are_timed_with_one_blas_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the pipeline runs them: threads that wait for each other took forty times as long."""
    from threadpoolctl import threadpool_info, threadpool_limits

    from ifem_export.operators import ladder as measuring

    seen: list[int] = []

    def counted(*_: object) -> float:
        seen.extend(i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas")
        return 1.0

    monkeypatch.setattr(measuring, "timed_ms", counted)
    with threadpool_limits(limits=2, user_api="blas"):
        before = threadpool_info()
        time_operators(operator_choices(pad(2))[:2], pad(2), GEL, "bbar")
        assert threadpool_info() == before
    assert seen
    assert set(seen) == {1}


def test_the_key_of_a_machines_times_tells_sensors_apart() -> None:
    def key(mesh: PadMesh, gel: Material, element: Formulation) -> str:
        return build_bundle(mesh, gel, element, with_stiffness=False).times_key

    keys = {
        key(pad(), GEL, "bbar"),
        key(pad(2), GEL, "bbar"),
        key(pad(), Material(0.147, 0.45, 1020.0), "bbar"),
        key(pad(), GEL, "full"),
    }
    assert len(keys) == 4
    assert key(pad(), GEL, "bbar") in keys


def test_the_record_reads_back(ladder: OperatorLadder) -> None:
    text = json.dumps(ladder.to_record(), allow_nan=False)
    assert OperatorLadder.from_record(json.loads(text)) == ladder
    with pytest.raises(IfemError) as caught:
        OperatorLadder.from_record({"rungs": [{}]})
    assert caught.value.field == "ladder"


def test_a_bundle_carries_its_ladder_and_chooses_at_load(
    ladder: OperatorLadder, tmp_path: Path
) -> None:
    made = build_bundle(
        pad(),
        GEL,
        "bbar",
        marker_positions_mm=MARKERS,
        with_stiffness=False,
        ladder=ladder,
        operator="fft",
    )
    write_bundle(tmp_path / "b", made)
    loaded = load_bundle(tmp_path / "b")
    assert loaded.ladder == ladder
    assert loaded.surface_operator().name == "fft"
    least = min(r.error for r in ladder.rungs)
    chosen = ladder.named(ladder.choose(Budget(0.6)).rung.name)
    assert chosen is not None
    assert loaded.surface_operator(budget=Budget(0.6)).name == chosen.rung
    assert loaded.surface_operator(budget=Budget(1.01 * least)).name in ("pcg", "factor")
    assert loaded.surface_operator("paper").name == "paper"
    with pytest.raises(BudgetError):
        loaded.surface_operator(budget=Budget(0.6, 1e-6))
    bare = build_bundle(pad(), GEL, "bbar", with_stiffness=False)
    assert bare.surface_operator().name == "pcg"
    with pytest.raises(IfemError) as caught:
        bare.surface_operator(budget=Budget(0.05))
    assert caught.value.field == "ladder"


def test_an_altered_ladder_is_refused(ladder: OperatorLadder, tmp_path: Path) -> None:
    made = build_bundle(pad(), GEL, "bbar", with_stiffness=False, ladder=ladder)
    write_bundle(tmp_path / "b", made)
    path = tmp_path / "b" / "ladder.json"
    path.write_text(path.read_text().replace("paper", "papet"))
    for damage in (lambda: None, path.unlink):
        damage()
        with pytest.raises(BundleError) as caught:
            load_bundle(tmp_path / "b")
        assert caught.value.file == "ladder.json"


def test_a_bundle_starts_with_the_least_work_near_the_best(ladder: OperatorLadder) -> None:
    allowed = max(0.03, 1.1 * min(r.error for r in ladder.rungs))
    start = ladder.balanced()
    assert start.error <= allowed
    lighter = [r for r in ladder.rungs if r.n_bytes < start.n_bytes]
    assert lighter
    assert all(r.error > allowed for r in lighter)


def test_a_coarse_mesh_takes_a_tenth_above_its_smallest_error(ladder: OperatorLadder) -> None:
    rungs = sorted(ladder.rungs, key=lambda r: r.n_bytes)[:3]
    for middle, expected in ((0.109, 1), (0.111, 2)):
        made = [
            replace(r, error_field=error, error_resultant=0.01, error_edge=None, contacts={})
            for r, error in zip(rungs, (0.2, middle, 0.1), strict=True)
        ]
        assert replace(ladder, rungs=tuple(made)).balanced().label == rungs[expected].label
