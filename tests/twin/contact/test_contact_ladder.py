"""What the contact's tolerance says, its field of forces keeps; steps, rims and unfit pads."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from numpy.typing import NDArray
from sampled import quick

from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.contact.load_steps import even_steps
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Ring, Sphere, TexturedPlane
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

Array = NDArray[np.float64]
RUNGS = (1e-2, 1e-3, 1e-4)
SHAPES: dict[str, Indenter] = {
    "sphere": Sphere(shape="sphere", radius_mm=6),
    "punch": FlatPunch(shape="flat_punch", length_mm=6, width_mm=4),
    "ring": Ring(shape="ring", outer_radius_mm=4, inner_radius_mm=2.2),
    "bumps": TexturedPlane(
        shape="textured_plane", length_mm=9, width_mm=9, texture="bumps", pitch_mm=4, relief_mm=0.3
    ),
}
PRESS, SHEAR = Pose(depth_mm=0.35), Pose(x_mm=0.5, y_mm=0.2, depth_mm=0.35, tilt_x_deg=1.5)
POSES = (Pose(), *even_steps(Pose(), PRESS, 4), *even_steps(PRESS, SHEAR, 8))


def fields(shape: Indenter, poisson: float, tolerance: float, friction: float = 0.6) -> list[Array]:
    kept = SurfaceCompliance(small_pad(poisson, 16, 4, 14.0))
    one = ContactSolver(kept, Tool.of([shape], Path()), ContactSettings(tolerance, friction))
    return [s.force_n for s in one.states(POSES) if s.force_n.any()]


def worst(found: list[Array], true: list[Array]) -> float:
    return max(
        float(np.linalg.norm(a - b) / np.linalg.norm(b)) for a, b in zip(found, true, strict=True)
    )


@pytest.mark.parametrize("poisson", quick([0.32, 0.49], lambda poisson: poisson > 0.4))
@pytest.mark.parametrize("name", SHAPES)
def test_rungs_keep_what_they_say_and_finer_is_better(name: str, poisson: float) -> None:
    """At every pose of a press with shear and tilt, history included; against 1e-6."""
    true = fields(SHAPES[name], poisson, 1e-6)
    errors = [worst(fields(SHAPES[name], poisson, t), true) for t in RUNGS]
    assert all(e <= t for e, t in zip(errors, RUNGS, strict=True)), errors
    assert all(b < a for a, b in itertools.pairwise(errors)), errors


@pytest.mark.parametrize(
    ("side", "allowed"), [(8.6, 1e-2), pytest.param(9.3, 1e-2, marks=pytest.mark.slow), (9.0, 0.15)]
)
def test_a_rim_on_a_row_of_nodes_leaves_two_answers(side: float, allowed: float) -> None:
    """A plane of 9 mm ends on the row of nodes at 4.5 mm, which bulge past its rim in a step.

    Held by the rim until the next step or let go at once, each obeys the laws; which one comes out
    may hang on the tolerance. No other size does.
    """
    kept = SurfaceCompliance(small_pad(0.49, 24, 4))
    shape = TexturedPlane(
        shape="textured_plane", length_mm=side, width_mm=side, texture="bumps", pitch_mm=4,
        relief_mm=0.3,
    )  # fmt: skip
    poses = (Pose(depth_mm=0.15), Pose(depth_mm=0.3), Pose(depth_mm=0.45), Pose(0, 0.6, 0, 0.45))
    found = [
        [s.force_n for s in ContactSolver(
            kept, Tool.of([shape], Path()), ContactSettings(tolerance, 0.3)
        ).states(poses)]
        for tolerance in (1e-2, 1e-6)
    ]  # fmt: skip
    assert worst(*found) < allowed
    # The next step starts from nodes that are let go: what is left is the tolerance.
    assert worst(found[0][2:], found[1][2:]) < 1e-2


@pytest.mark.parametrize("name", ["sphere", "punch"])
def test_half_the_step_keeps_the_tolerance(name: str) -> None:
    """Steps of the coarse rung's size, and of half of it, agree within what that rung allows.

    Sticking nodes are followed exactly; what differs is when nodes begin to slip.
    """
    kept = SurfaceCompliance(small_pad(0.49, 16, 4, 14.0))
    ends = []
    for steps in (24, 48):
        one = ContactSolver(
            kept, Tool.of([SHAPES[name]], Path()), ContactSettings(1e-3, 0.6, longest_step=50)
        )
        poses = (
            Pose(),
            *even_steps(Pose(), PRESS, steps),
            *even_steps(PRESS, SHEAR, steps),
        )
        ends.append(list(one.states(poses))[-1].force_n)
    assert np.linalg.norm(ends[0] - ends[1]) < 1e-2 * np.linalg.norm(ends[1])


def test_sticking_adds_no_error_from_step_to_step() -> None:
    """A stuck punch turned over in many steps at a loose tolerance is where it should be."""
    kept = SurfaceCompliance(small_pad(0.49, 16, 4, 14.0))
    tool = Tool.of([SHAPES["punch"]], Path())
    ends = []
    for tolerance in (1e-2, 1e-7):
        one = ContactSolver(kept, tool, ContactSettings(tolerance, 5.0))
        over = replace(PRESS, tilt_y_deg=2.0)
        poses = (
            Pose(),
            *even_steps(Pose(), PRESS, 3),
            *even_steps(PRESS, over, 40),
        )
        ends.append(list(one.states(poses))[-1].force_n)
    assert np.linalg.norm(ends[0] - ends[1]) < 1e-2 * np.linalg.norm(ends[1])


def test_a_tool_at_rest_changes_nothing() -> None:
    kept = SurfaceCompliance(small_pad(0.49, 12))
    one = ContactSolver(kept, Tool.of([SHAPES["sphere"]], Path()), ContactSettings(1e-3, 0.6))
    states = list(one.states((Pose(), PRESS, replace(PRESS, time_s=3.0), SHEAR)))
    np.testing.assert_array_equal(states[1].force_n, states[2].force_n)
    assert not np.array_equal(states[2].force_n, states[3].force_n)


def test_states_are_not_changed_by_later_ones() -> None:
    """Newton's steps start from the last state's fields and must leave them as they are."""
    one = ContactSolver(
        SurfaceCompliance(small_pad(0.49)),
        Tool.of([SHAPES["sphere"]], Path()),
        ContactSettings(1e-3, 0.0),
    )
    poses = tuple(Pose(time_s=k, depth_mm=d) for k, d in enumerate((0.0, 0.6, 0.9, 1.2, 0.7, 0.5)))
    kept, copies = [], []
    for state in NonlinearContact(one, tolerance=1e-2).states(poses):
        kept.append(state)
        copies.append(state.force_n.copy())
    for state, copy in zip(kept, copies, strict=True):
        np.testing.assert_array_equal(state.force_n, copy)


@pytest.mark.parametrize(("crown", "word"), [(Paraboloid(0.4, 4.3), "crown"), (None, "cut cells")])
def test_pads_that_cannot_be_strained_far_are_told_at_once(
    crown: Paraboloid | None, word: str
) -> None:
    size = 6.0 if crown is not None else 6.3
    mesh, _ = build_pad_mesh(
        RoundedRectangle(size, size, 1.0), 2.0, cells=(6, 6, 3), crown=crown,
        weighting="volume_fraction",
    )  # fmt: skip
    pad = build_bundle(mesh, Material(0.147, 0.49, 1000.0), "bbar", with_stiffness=False)
    solver = ContactSolver(
        SurfaceCompliance(pad), Tool.of([SHAPES["sphere"]], Path()), ContactSettings()
    )
    with pytest.raises(ContactError, match=word) as caught:
        NonlinearContact(solver)
    assert "nonlinearity: off" in str(caught.value)
    assert list(solver.states((Pose(), PRESS)))[-1].force_n.any()
