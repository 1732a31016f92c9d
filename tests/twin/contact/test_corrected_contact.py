"""Corrections of a linear contact keep their tolerance against a gel that is solved to converge."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from agreement import Trial
from contact_pads import small_pad
from random_contact_scenes import random_contact

from gelslim_twin.contact import corrected_contact
from gelslim_twin.contact.corrected_contact import CorrectedContact, Correction
from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.load_steps import even_steps
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.large_strain import (
    CORRECTED_RUNGS,
    HELD_AT,
    corrected_error,
    found_error,
)
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.simulation.probe import probed
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

PRESS, SHEAR = Pose(depth_mm=0.5), Pose(x_mm=0.4, depth_mm=0.5)
PATH = (Pose(), *even_steps(Pose(), PRESS, 8), *even_steps(PRESS, SHEAR, 4), Pose(x_mm=0.4))


def ball(tolerance: float = 1e-5) -> ContactSolver:
    pad = SurfaceCompliance(small_pad(0.3223, 12, 2, 12.0))
    tool = Tool.of([Sphere(shape="sphere", radius_mm=5)], Path())
    return ContactSolver(pad, tool, ContactSettings(tolerance, 0.5))


def apart(one: list[GelState], other: list[GelState]) -> tuple[float, float]:
    """Largest differences of resultants in N and of displacements in mm."""
    pairs = list(zip(one, other, strict=True))
    return (
        max(float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0))) for a, b in pairs),
        max(
            float(np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1).max())
            for a, b in pairs
        ),
    )


def test_what_a_probe_corrects_leaves_no_trace_in_a_run() -> None:
    """The linear stiffness is shared by corrections of one pad, solvers are not: equal bytes."""
    solver = ball()
    state = solver.step(GelState.at_rest(len(solver.points_mm)), None, PRESS)
    still = np.zeros_like(solver.points_mm)
    alone = Correction(solver.compliance.bundle).offset_mm(state, still)
    other = Correction(solver.compliance.bundle, tolerance=1e-3)
    other.offset_mm(state, still)
    again = Correction(solver.compliance.bundle)
    assert np.array_equal(again.offset_mm(state, still), alone)
    assert again._law.system is other._law.system
    assert again._solver is not other._solver


def in_small_steps(seed: int, folder: Path) -> Trial:
    """A random contact whose tool moves in four times as many steps."""
    finger, values = random_contact(seed)
    for move in values["motion"]["waypoints"]:
        move["steps"] *= 4
    return Trial.of(finger, values, folder)


def probed_contact(seed: int, folder: Path) -> tuple[Trial, Circumstances, Tool]:
    """Such a contact, what is known of it after a probe, and its tool."""
    one = in_small_steps(seed, folder)
    asked = replace(one.asked, observe=("force", "displacement"))
    c = probed(asked, one.loaded, one.compliance, ("nonlinearity",)).circumstances
    return one, c, Tool.of(one.loaded.scene.indenters, one.loaded.folder, seed)


@pytest.mark.slow
def test_the_tolerance_is_kept_with_fewer_corrections_the_looser_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    true = list(NonlinearContact(ball(), 1e-4).states(PATH))
    force_n = max(float(np.linalg.norm(s.force_n.sum(axis=0))) for s in true)
    moved_mm = max(float(np.abs(s.displacement_mm).max()) for s in true)
    linear_n, _ = apart(list(ball().states(PATH)), true)
    assert linear_n > 0.08 * force_n
    counted, offset = [0], Correction.offset_mm

    def count(self: Correction, *given: object) -> object:
        counted[0] += 1
        return offset(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Correction, "offset_mm", count)
    made = []
    for tolerance in (0.1, 0.02, 0.005, 0.001):
        counted[0] = 0
        found = list(CorrectedContact(ball(), tolerance).states(PATH))
        n, mm = apart(found, true)
        assert n <= 0.75 * tolerance * force_n, tolerance
        assert mm <= 2 * tolerance * moved_mm, tolerance
        made.append(counted[0])
        assert not found[-1].displacement_mm.any()
    assert made == sorted(made)
    # Since a correction is kept for a slow rate of convergence too, 9 of 14 poses have one at 10 %.
    assert 0 < made[0] < 0.75 * len(PATH)


def test_poses_that_cannot_be_corrected_are_solved_to_converge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The whole path, since which nodes are held depends on it."""
    path, asked = PATH[:4], list[tuple[float, tuple[Pose, ...]]]()
    deep = GelState.at_rest(len(ball().points_mm))

    class Converging:
        def __init__(self, _solver: ContactSolver, tolerance: float, most_steps: int) -> None:
            self.tolerance = tolerance
            # With fewer a sliding cone went on in smaller load steps, 5 % beside.
            assert most_steps > NonlinearContact.most_steps

        def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
            asked.append((self.tolerance, poses))
            return (replace(deep, solver={"number": float(k)}) for k in range(len(poses)))

    def inverted(*_given: object) -> None:
        raise ContactError("a cell is inverted")

    monkeypatch.setattr(corrected_contact, "NonlinearContact", Converging)
    monkeypatch.setattr(Correction, "offset_mm", inverted)
    found = list(CorrectedContact(ball(), 0.01).states(path))
    assert asked == [(pytest.approx(0.002), path)]
    assert [s.solver.get("number") for s in found] == [None, 1.0, 2.0, 3.0]


@pytest.mark.parametrize("hard", [0, 3, None])
def test_a_path_is_converged_from_its_first_pose_on_where_one_is_not_corrected(
    monkeypatch: pytest.MonkeyPatch, hard: int | None
) -> None:
    """With the contact's own tolerance, as a gel that is converged from the first. Of a path that
    is corrected throughout the states are the same as without."""
    path, asked = PATH[:6], list[tuple[float, float]]()
    rest = GelState.at_rest(len(ball().points_mm))

    class Converging:
        def __init__(self, solver: ContactSolver, tolerance: float, _most_steps: int) -> None:
            asked.append((solver.settings.tolerance, tolerance))

        def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
            return (replace(rest, solver={"number": float(k)}) for k in range(len(poses)))

    corrected = CorrectedContact._corrected

    def breaks(self: CorrectedContact, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        if hard is not None and pose == path[hard]:
            raise ContactError("a cell is inverted")
        return corrected(self, last, before, pose)

    monkeypatch.setattr(corrected_contact, "NonlinearContact", Converging)
    monkeypatch.setattr(CorrectedContact, "_corrected", breaks)
    found, without = (
        list(CorrectedContact(ball(1e-3), 0.005, by_rate=False, restarts=anew).states(path))
        for anew in (True, False)
    )
    assert len(found) == len(path)
    if hard is None:
        assert not asked
        assert apart(found, without) == (0.0, 0.0)
        assert found[-1].force_n.any()
        return
    assert asked[0] == (1e-3, pytest.approx(1e-3))
    assert [s.solver["number"] for s in found] == [float(k) for k in range(len(path))]
    assert [s.solver.get("number") for s in without[hard:]] == [float(k) for k in range(hard, 6)]


def test_what_a_correction_is_expected_to_change_grows_with_the_contact() -> None:
    """After a light touch the change per displacement is small: a deep contact has ten times it."""
    rest, touch, deep = (GelState.at_rest(4), *(moved(mm) for mm in (0.01, 0.1)))
    last = corrected_contact._LastCorrected(touch, per_mm=0.02, per_n=0.05)
    assert last.expected(deep) == pytest.approx((3 * 10 * 0.02 * 0.09, 3 * 10 * 0.05 * 0.09))
    back = corrected_contact._LastCorrected(deep, per_mm=0.02, per_n=0.05)
    assert back.expected(touch) == pytest.approx((3 * 0.02 * 0.09, 3 * 0.05 * 0.09))
    assert corrected_contact._LastCorrected(rest).expected(deep) == (np.inf, np.inf)


def moved(mm: float) -> GelState:
    """A node pressed in by `mm` with as many newtons."""
    state = GelState.at_rest(4)
    field = state.displacement_mm.copy()
    field[0, 2] = -mm
    return replace(state, displacement_mm=field, force_n=field)


OTHERS = (2013, 2026, 2028, 2038, 2040, 2059, 2107, 2204, 3020, 3028)
SLIDING_WALLS = (2014, 2017, 2019, 2021, 2027, 2029, 2041, 2042, 2044, 2045, 2053, 2060, 2083, 2089,
                 2150, 2190, 2217)  # fmt: skip


FOUND = (2003, 2030, 2037, 2048, 2056, 2065, 2074, 2090, 3002, 3018, 3044, 3060, 3075, 3102, 3165,
         3180, 3202, 3206, 3238)  # fmt: skip


@pytest.mark.parametrize(
    "seed", [2030, *(pytest.param(s, marks=pytest.mark.slow) for s in FOUND if s != 2030)]
)
def test_rungs_keep_what_one_correction_tells_of_them(tmp_path: Path, seed: int) -> None:
    """The error that a probe finds of a rung, against a gel that is solved until it converges.

    In 2074, 3044 and 3238 the tool recedes and comes back; in 2037, 2090, 3060, 3075, 3102, 3165
    and 3180 it moves aside. 3102 and later seeds were not looked at for the safety factors, but
    for 3238, in which 1.84 was needed.
    """
    one, c, tool = probed_contact(seed, tmp_path)

    def solver() -> ContactSolver:
        return ContactSolver(one.compliance, tool, ContactSettings(1e-5, c.friction))

    true = list(NonlinearContact(solver(), 1e-3).states(one.poses))
    for tolerance in (0.1, 0.03, HELD_AT):
        found = found_error(c, tolerance)
        assert found is not None
        rung = CorrectedContact(solver(), tolerance, not c.has_walls)
        n, mm = apart(list(rung.states(one.poses)), true)
        assert n <= found.force_n, tolerance
        assert mm * c.sensor.px_per_mm <= found.displacement_px, tolerance


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*OTHERS, *SLIDING_WALLS])
def test_rungs_keep_their_error_along_random_paths(tmp_path: Path, seed: int) -> None:
    """Seeds at which walls hold other nodes at 2 %, deep ones, and gels of ν = 0.49.

    In 2027 Newton's method at 1e-2 and at 1e-3 differ by 0.7 % of the force. In 2014 and 2107 a
    sliding wall holds another node with other numbers of corrections. In 2089 and 2150 a pose is
    not corrected, and walls hold other nodes at those before. In 2017, 2190 and 2217 nodes slip
    earlier or later, where friction drags them by up to ten times the depth.
    """
    one = in_small_steps(seed, tmp_path)
    tool = Tool.of(one.loaded.scene.indenters, one.loaded.folder, seed)
    c = probed(one.asked, one.loaded, one.compliance).circumstances
    settings = ContactSettings(1e-6, c.friction)

    def solver() -> ContactSolver:
        return ContactSolver(one.compliance, tool, settings)

    true = list(NonlinearContact(solver(), 1e-3).states(one.poses))
    for tolerance in (0.02, HELD_AT):
        assert tolerance in [t for t, _ in CORRECTED_RUNGS]
        slides = c.has_walls and c.motion.slides
        rung = CorrectedContact(solver(), tolerance, not c.has_walls, restarts=slides)
        n, mm = apart(list(rung.states(one.poses)), true)
        allowed = corrected_error(c, tolerance)
        assert n <= allowed.force_n, tolerance
        assert mm * c.sensor.px_per_mm <= allowed.displacement_px, tolerance


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3205, 3208, 3209, 3214, 3231])
def test_rungs_keep_what_a_probe_says_of_strained_contacts(tmp_path: Path, seed: int) -> None:
    """In 3209 and 3214 a wall holds a node otherwise at one pose of a deep press, at 3205 and 3231
    by less; in 3208 a ball that is pressed in by 39 % slides on a gel of ν = 0.47."""
    one, c, tool = probed_contact(seed, tmp_path)

    def solver() -> ContactSolver:
        return ContactSolver(one.compliance, tool, ContactSettings(1e-4, c.friction))

    true = list(NonlinearContact(solver(), 1e-3).states(one.poses))
    for tolerance in (0.1, 0.01, HELD_AT, 0.003):
        rung = CorrectedContact(solver(), tolerance, not c.has_walls)
        n, mm = apart(list(rung.states(one.poses)), true)
        allowed = corrected_error(c, tolerance)
        assert n <= allowed.force_n, tolerance
        assert mm * c.sensor.px_per_mm <= allowed.displacement_px, tolerance
