"""What the ladder of surface operators measures, recomputed from its definition."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators import ladder as measured
from ifem_export.operators.ladder_contacts import nodal_forces, standard_contacts
from ifem_export.operators.operator_ladder import OperatorLadder
from ifem_export.operators.surface_operator import surface_operator

GEL = Material(0.147, 0.3223, 1020.0)


def pad(columns: int = 7, rows: int = 6, layers: int = 2) -> PadMesh:
    """A small pad, off the centre and without one corner."""
    cells = np.ones((columns, rows, layers), dtype=bool)
    cells[0, :2] = False
    return PadMesh.from_occupancy(cells, (0.8, 0.7, 1.0), (0.3, -2.0, -1.0 * layers))


def refined_pad(mesh: PadMesh, left: int = 0, low: int = 0) -> PadMesh:
    """Half the pitch, and so many more or fewer cells at the left and at the lower side."""
    cells = np.kron(np.asarray(mesh.occupancy)[:, :, :1], np.ones((2, 2, 1))).astype(bool)
    cells = np.pad(cells, ((max(left, 0), 1), (max(low, 0), 2), (0, 0)), constant_values=True)
    cells = cells[max(-left, 0) :, max(-low, 0) :]
    hx, hy, hz = mesh.cell_size_mm
    x, y, z = mesh.origin_mm
    origin = (x - left * hx / 2, y - low * hy / 2, z)
    return PadMesh.from_occupancy(cells, (hx / 2, hy / 2, hz), origin)


@pytest.mark.parametrize(("left", "low"), [(0, 0), (1, 3), (-1, 2), (2, -1), (-2, -3)])
def test_lumped_forces_are_weighted_by_the_bilinear_functions(left: int, low: int) -> None:
    mesh = pad()
    fine = refined_pad(mesh, left, low)
    force = np.random.default_rng(1).normal(size=(len(fine.surface), 3))
    coarse_mm, fine_mm = (np.asarray(m.nodes_mm)[m.surface] for m in (mesh, fine))
    away = np.abs(coarse_mm[:, None, :2] - fine_mm[None, :, :2]) / mesh.cell_size_mm[:2]
    weight = np.maximum(1.0 - away, 0.0).prod(axis=2)
    found = measured.lumped(force, fine, mesh)
    assert found == pytest.approx(weight @ force, abs=1e-12)


def test_a_refined_pad_has_half_the_pitch_and_eight_layers() -> None:
    mesh = pad()
    fill = np.where(mesh.occupancy, np.linspace(0.1, 1.0, 7)[:, None, None], 0.0)
    for part in (None, fill):
        coarse = PadMesh.from_occupancy(
            np.array(mesh.occupancy), mesh.cell_size_mm, mesh.origin_mm, part
        )
        fine = measured.refined(coarse)
        assert fine.cell_size_mm == pytest.approx((0.4, 0.35, 0.25))
        assert fine.origin_mm == coarse.origin_mm
        for i, j, k in itertools.product(range(14), range(12), range(8)):
            assert fine.occupancy[i, j, k] == coarse.occupancy[i // 2, j // 2, 0]
            if part is not None:
                assert fine.fill[i, j, k] == coarse.fill[i // 2, j // 2, 0]


def test_bumps_are_gaussians_at_given_parts_of_the_pad() -> None:
    mesh = pad()
    points = np.asarray(mesh.nodes_mm)[mesh.surface][:, :2]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    span = (points.max(axis=0) - points.min(axis=0)) / 2
    inside = [*np.random.default_rng(7).uniform(-0.4, 0.4, (3, 2)), (0.75, 0.0)]
    ways = [(1, 0, 0), (0, 1, 0), (0, 0, -1), (0.3, 0.1, -0.7)]
    edge, edge_ways = [(0.95, 0.0), (-0.85, 0.85)], [(1, 0, 0), (0.8, 0.5, -0.3)]
    probes = np.random.default_rng(2).uniform(-3.0, 8.0, (40, 3))
    thick = PadMesh.from_occupancy(np.ones((3, 3, 4), bool), (0.8, 0.7, 1.0), (0.0, 0.0, -4.0))
    for motions, centres, directions in (
        (measured.bumps(mesh), inside, ways),
        (measured.edge_bumps(mesh), edge, edge_ways),
    ):
        for motion, centre, way in zip(motions, centres, directions, strict=True):
            away = probes[:, :2] - (middle + np.array(centre) * span)
            # As wide as the pad is thick, and at least 2.5 cells.
            bump = 0.1 * np.exp(-0.5 * (away**2).sum(axis=1) / 2.0**2)
            assert motion(probes) == pytest.approx(bump[:, None] * np.array(way))
    centre = np.array([1.2 + 0.95 * 1.2, 1.05, 0.0])
    side = measured.edge_bumps(thick)[0](centre + np.array([[0.0, 0.0, 0.0], [0.0, 4.0, 0.0]]))
    assert side[:, 0] == pytest.approx([0.1, 0.1 * np.exp(-0.5)])


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(((found - expected) ** 2).sum() / (expected**2).sum()))


@pytest.fixture(scope="module")
def ladder() -> OperatorLadder:
    steps: list[tuple[str, int, int]] = []
    made = measured.measure_ladder(
        pad(), GEL, "bbar", dense=True, timed=False, progress=lambda *a: steps.append(a)
    )
    assert [s[1] for s in steps] == list(range(len(made.rungs) + 1))
    assert {s[2] for s in steps} == {len(made.rungs) + 1}
    assert [s[0] for s in steps] == ["reference", *(r.rung for r in made.rungs)]
    return made


@pytest.mark.parametrize("number", range(9))
def test_errors_and_noise_gains_are_those_of_their_definition(
    ladder: OperatorLadder, number: int
) -> None:
    mesh, rung = pad(), ladder.rungs[number]
    operator = surface_operator(mesh, GEL, "bbar", rung.rung, **rung.parameters)
    exact = surface_operator(mesh, GEL, "bbar", "factor")
    fine = measured.refined(mesh)
    finest = surface_operator(fine, GEL, "bbar", "factor")
    points, fine_points = (np.asarray(m.nodes_mm)[m.surface] for m in (mesh, fine))
    errors = []
    for motion in (*measured.bumps(mesh), *measured.edge_bumps(mesh)):
        truth = measured.lumped(finest.force(motion(fine_points)), fine, mesh)
        found = operator.force(motion(points))
        errors.append(
            (
                relative(found, truth),
                relative(found, exact.force(motion(points))),
                relative(found.sum(axis=0), truth.sum(axis=0)),
            )
        )
    inside = np.max(errors[:4], axis=0)
    assert rung.error_field == pytest.approx(inside[0], abs=2e-6)
    assert rung.error_operator == pytest.approx(inside[1], abs=2e-6)
    assert rung.error_resultant == pytest.approx(inside[2], abs=2e-6)
    assert rung.error_edge == pytest.approx(np.max(errors[4:], axis=0)[0], abs=2e-6)
    for name, discs in standard_contacts(mesh).items():
        force = nodal_forces(fine, discs)
        truth = measured.lumped(force, fine, mesh)
        moved = finest.displacement(force)
        same = np.abs(points[:, None, :2] - fine_points[None, :, :2]).sum(axis=2) < 1e-9
        found = operator.force(moved[same.argmax(axis=1)])
        assert rung.contacts[name].field == pytest.approx(relative(found, truth), abs=2e-6)
        ratio = relative(found.sum(axis=0), truth.sum(axis=0))
        assert rung.contacts[name].resultant == pytest.approx(ratio, abs=2e-6)
    rng = np.random.default_rng(measured.NOISE_SEED)
    forces = [operator.force(rng.normal(size=points.shape)) for _ in range(measured.NOISE_DRAWS)]
    assert rung.noise_node_n_per_mm == pytest.approx(np.std(forces), rel=6e-4)
    sums = np.array([f.sum(axis=0) for f in forces])
    assert rung.noise_resultant_n_per_mm == pytest.approx(np.sqrt((sums**2).mean()), rel=6e-4)
    assert rung.n_bytes == operator.n_bytes
    assert rung.milliseconds is None
    assert np.isnan(rung.time_ms)


class Slow:
    """An operator that advances a clock; its first call is the slowest."""

    def __init__(self, seconds: list[float]) -> None:
        self.seconds, self.now, self.fields = list(seconds), 0.0, []

    def force(self, field: np.ndarray) -> np.ndarray:
        self.fields.append(field)
        self.now += self.seconds[min(len(self.fields), len(self.seconds)) - 1]
        return field

    def clock(self) -> float:
        return self.now


@pytest.mark.parametrize(
    ("seconds", "median_ms", "calls"),
    [
        ([9.0, 0.05, 0.02, 0.03, 0.04], 35.0, 5),
        ([9.0, 1.0, 3.0, 2.0], 2000.0, 4),
        ([5.0, 0.01], 10.0, 14),
    ],
)
def test_the_time_is_the_median_of_calls_for_an_eighth_of_a_second(
    monkeypatch: pytest.MonkeyPatch, seconds: list[float], median_ms: float, calls: int
) -> None:
    operator = Slow(seconds)
    monkeypatch.setattr(measured.time, "perf_counter", operator.clock)
    fields = [np.full((2, 3), k) for k in range(3)]
    assert measured.timed_ms(operator, fields) == pytest.approx(median_ms)
    assert abs(len(operator.fields) - calls) <= (calls > 10)
    assert [int(f[0, 0]) for f in operator.fields[:5]] == [0, 0, 1, 2, 0][: len(operator.fields)]


def test_times_are_the_smallest_of_three_medians(monkeypatch: pytest.MonkeyPatch) -> None:
    medians = iter([3.0, 1.0, 2.0, 7.0, 8.0, 6.0])
    monkeypatch.setattr(measured, "timed_ms", lambda operator, fields: next(medians))
    steps: list[tuple[str, int, int]] = []
    found = measured.time_operators(
        [("paper", {}), ("fft", {"lumped": 1})], pad(), GEL, "bbar", lambda *a: steps.append(a)
    )
    assert found == {"paper": 1.0, "fft (lumped 1)": 6.0}
    assert steps == [("paper", 0, 2), ("fft (lumped 1)", 1, 2)]
