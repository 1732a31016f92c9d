"""Undercuts of meshes: which facets are hidden, and where steps and scenes are refused."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scene_samples import MINIMAL, load
from stepping_rig import (
    DT_S,
    Array,
    at,
    ball_facets,
    box_facets,
    linear_twin,
    turned,
    write_stl,
)

from gelslim_core.yaml.errors import InputError
from gelslim_twin.scene.pose import Pose
from gelslim_twin.simulation.scene_task import require_no_undercut
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.tools.profile import lowest_middle
from gelslim_twin.tools.undercut import undercut_of

GAP_MM, FOOT_MM = 0.4, 0.5


def box(sides: tuple[float, float, float], x: float, z: float) -> Array:
    """Facets of a box whose lower side has its middle at x, 0, z."""
    return np.asarray(box_facets(*sides) + np.array([x, 0.0, z + sides[2] / 2]))


def shelf() -> Array:
    """A foot of 4 x 4 x 0.5 mm and a roof of 6 x 4 x 1 mm, 0.4 mm apart on a post in the middle."""
    foot, roof = box((4, 4, FOOT_MM), 0.0, 0.0), box((6, 4, 1), 0.0, FOOT_MM + GAP_MM)
    return np.concatenate([foot, roof, box((1, 1, 1), 0.0, 0.2)])


def on_its_lowest(facets: Array) -> Array:
    return facets - lowest_middle(facets)


def test_the_roof_of_a_shelf_is_hidden_where_the_foot_is_below() -> None:
    found = undercut_of(on_its_lowest(shelf()))
    assert found is not None
    lower = np.flatnonzero((box_facets(6, 4, 1)[..., 2] == -0.5).all(axis=1))
    assert set(found.facets) == set(12 + lower)
    np.testing.assert_allclose(found.places_mm[:, 2], FOOT_MM + GAP_MM)
    assert (np.abs(found.places_mm[:, :2]) < 2.0).all()


def test_bodies_that_hide_nothing() -> None:
    """A ball, parts that touch, and parts that overlap, whose inner faces are behind no gap."""
    stacked = np.concatenate([box((4, 4, 1), 0, 0), box((3, 3, 1), 0, 1)])
    overlapping = np.concatenate([box((4, 4, 1), 0, 0), box((3, 3, 1), 0, 0.7)])
    for facets in (ball_facets(3.0, 20), stacked, overlapping):
        assert undercut_of(on_its_lowest(facets)) is None


def test_a_standing_frame_hides_its_roof_and_a_lying_one_nothing() -> None:
    beams = [box((6, 1, 1), 0, 0), box((6, 1, 1), 0, 5), box((1, 1, 6), -2.5, 0),
             box((1, 1, 6), 2.5, 0)]  # fmt: skip
    found = undercut_of(on_its_lowest(np.concatenate(beams)))
    assert found is not None
    np.testing.assert_allclose(found.places_mm[:, 2], 5.0)
    lying = np.concatenate(beams) @ turned("x", 90.0).as_matrix().T
    assert undercut_of(on_its_lowest(lying)) is None


def test_a_step_into_an_undercut_is_refused_by_name(pad: Path, tmp_path: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.from_mesh(write_stl(tmp_path / "shelf.stl", shelf())))
    inside = FOOT_MM + GAP_MM
    assert twin.step(at(0, 0, 0.01 - inside), DT_S).in_contact
    before = twin.state
    with pytest.raises(StepError, match=r"body shelf.*facets 2[01], 2[01] "):
        twin.step(at(0, 0, -0.01 - inside), DT_S)
    assert twin.state is before
    # Upside down the roof is below, and the foot is hidden behind it.
    over = turned("x", 180.0)
    assert twin.step(at(0, 0, 1.9 - 1.3, over), DT_S).in_contact
    with pytest.raises(StepError, match="undercut"):
        twin.step(at(0, 0, 1.9 - 1.45, over), DT_S)


def test_beside_the_pad_an_undercut_does_no_harm() -> None:
    found = undercut_of(on_its_lowest(shelf()))
    assert found is not None
    assert found.below(Pose(depth_mm=1.0), (12.0, 12.0), 0.0) is not None
    assert found.below(Pose(depth_mm=1.0, x_mm=9.0), (12.0, 12.0), 0.0) is None
    assert found.below(Pose(depth_mm=0.85), (12.0, 12.0), 0.0) is None
    # Tilted by 10° about y, the side at +x is 0.34 mm lower.
    assert found.below(Pose(depth_mm=0.85, tilt_y_deg=10.0), (12.0, 12.0), 0.0) is not None


def test_a_scene_is_refused_on_the_line_of_the_mesh(tmp_path: Path) -> None:
    write_stl(tmp_path / "shelf.stl", shelf())
    sensor: Any = SimpleNamespace(points_mm=np.zeros((4, 3)), size_mm=(12.0, 12.0))
    ball = "  - shape: sphere\n    radius_mm: 8"
    for depth, raised, refused in ((0.89, 0.0, False), (0.95, 0.0, True), (0.95, 0.1, False)):
        mesh = f"  - shape: mesh\n    file: shelf.stl\n    raised_mm: {raised}"
        text = MINIMAL.replace(ball, mesh).replace("0.5}", f"{depth}}}")
        scene = load(tmp_path, text)
        if not refused:
            require_no_undercut(scene, sensor)
            continue
        with pytest.raises(InputError) as caught:
            require_no_undercut(scene, sensor)
        problem = caught.value.problems[0]
        assert (problem.line, problem.field) == (6, "indenters[0].file")
