"""Every length and limit of random folds against plane geometry, and the grids of the search."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from plane_geometry import Layout, Problem

from gelslim_cad.dimensions.fold.fold import Fold, fold
from gelslim_cad.dimensions.fold.grids import (
    COARSE,
    LEVELS,
    LOWER,
    STARTS,
    UPPER,
    Best,
    best_of_bands,
)
from gelslim_cad.dimensions.fold.mirror import FLATTEST_RAD, STEEPEST_RAD
from gelslim_cad.dimensions.fold.problem import FoldProblem

COUNT = 400
SPANS = {
    "gel_length_mm": (8.0, 40.0),
    "gel_width_mm": (8.0, 35.0),
    "gel_total_mm": (0.5, 6.0),
    "gel_index": (1.35, 1.6),
    "guide_thickness_mm": (1.0, 6.0),
    "guide_index": (1.4, 1.7),
    "half_across_mm": (0.8, 3.0),
    "half_along_mm": (0.7, 2.2),
    "pixel_pitch_mm": (0.002, 0.008),
    "focal_length_mm": (1.5, 4.0),
    "fixed_focus_mm": (15.0, 60.0),
    "fixed_image_mm": (2.0, 5.0),
    "fisheye": (0.0, 1.0),
    "k1": (-0.12, 0.12),
    "k2": (-0.06, 0.06),
    "k3": (-0.02, 0.02),
    "k4": (-0.01, 0.01),
    "p1": (-0.002, 0.002),
    "p2": (-0.0005, 0.0005),
    "most_tan": (0.9, 1.3),
    "moving_lens": (0.0, 1.0),
    "entrance_pupil_mm": (-1.0, 0.5),
    "aperture_mm": (0.3, 2.0),
    "lens_travel_mm": (0.0, 0.6),
    "focus_nearest_mm": (5.0, 80.0),
    "module_height_mm": (4.0, 9.0),
    "module_depth_mm": (1.0, 6.0),
    "lens_diameter_mm": (3.0, 7.0),
    "lens_height_mm": (0.5, 4.0),
    "mirror_thickness_mm": (0.5, 3.0),
    "mirror_border_mm": (0.2, 2.0),
    "clearance_mm": (0.1, 1.0),
    "ledge_depth_mm": (0.5, 4.0),
    "ledge_reach_mm": (0.5, 5.0),
    "guide_stack_mm": (5.0, 40.0),
    "marker_diameter_mm": (0.3, 1.2),
    "blur_limit_mm": (0.1, 1.0),
    "min_px_per_marker": (4.0, 20.0),
    "max_keystone": (1.1, 2.0),
    "fit_clearance_mm": (0.1, 0.5),
    "end_support_mm": (0.5, 3.0),
    "tip_wall_mm": (2.0, 8.0),
    "cable_behind_mm": (0.0, 6.0),
    "mount_length_mm": (8.0, 20.0),
    "baffle_inner_y_mm": (8.0, 20.0),
    "clamp_width_mm": (10.0, 30.0),
    "max_depth_mm": (8.0, 40.0),
    "max_length_mm": (50.0, 150.0),
    "depth_worth": (0.0, 1.0),
    "length_worth": (0.0, 1.0),
    "pixel_worth_mm": (0.0, 1.0),
}
CABLE_SPANS = {
    "cable_side": (-1.5, 1.5),
    "cable_radius_mm": (0.2, 6.0),
    "cable_half_mm": (0.05, 1.0),
    "cable_over_cover_mm": (0.3, 3.0),
    "cable_under_skin_mm": (0.5, 4.0),
}


Compared = tuple[Fold, list[Layout], FoldProblem]


@pytest.fixture(scope="module")
def candidates() -> Compared:
    """Random candidates of random designs: our layouts, and the same by plane geometry."""
    rng = np.random.default_rng(31)
    columns = {name: rng.uniform(*span, (COUNT, 1, 1)) for name, span in SPANS.items()}
    columns["clamp_play_mm"] = np.random.default_rng(32).uniform(0.0, 0.4, (COUNT, 1, 1))
    cable = np.random.default_rng(33)
    columns |= {name: cable.uniform(*span, (COUNT, 1, 1)) for name, span in CABLE_SPANS.items()}
    for name in ("moving_lens", "cable_side"):
        columns[name] = np.round(columns[name])
    for name in ("fixed_focus_mm", "fixed_image_mm"):
        columns[name] = np.where(rng.random((COUNT, 1, 1)) < 0.7, 0.0, columns[name])
    ideal, wide = rng.random((2, COUNT, 1, 1)) < [[[[0.5]]], [[[0.4]]]]
    columns["fisheye"] = np.where(wide & ~ideal, 1.0, 0.0)
    for name in ("k1", "k2", "k3", "k4", "p1", "p2"):
        absent = ideal | (wide if name in ("p1", "p2") else ~wide & (name == "k4"))
        columns[name] = np.where(absent, 0.0, columns[name])
    assert set(columns) == {f.name for f in fields(FoldProblem)}
    problem = FoldProblem(**columns)
    lower, upper = (*LOWER[:2], FLATTEST_RAD), (*UPPER[:2], STEEPEST_RAD)
    mid, spread, mirror = rng.uniform(lower, upper, (COUNT, 3)).T[:, :, None, None]
    ours = fold(problem, mid, spread, mirror)
    rays = np.column_stack([np.ravel(ours.near_ray_rad), np.ravel(ours.far_ray_rad)])
    np.testing.assert_allclose(rays.mean(axis=1), np.ravel(mid), rtol=1e-12)
    given = zip(rays, np.ravel(mirror), np.ravel(ours.tilt_rad), strict=True)
    layouts = [Layout(Problem(problem, i), *values) for i, values in enumerate(given)]
    return ours, layouts, problem


OF_DISTORTION = {
    "across_scale",
    "along_scale",
    "corner_horizontal_tan",
    "corner_vertical_tan",
    "least_px",
    "field of view along",
    "field of view across",
    "pixels per marker",
    "missed parts",
    "objective",
    "goal",
}
NODAL = 2e-5
"""What a peak between the points of an edge may reach beyond them."""
ROOM = -0.05


def compare(ours: np.ndarray, expected: list[float], problem: FoldProblem, name: str) -> None:
    """Equal to rounding, where no peak is looked for among points of a distorted edge.

    The room along is that of the points that reach out most where the view is used up.
    """
    distorted, ours = np.ravel(problem.distorted) > 0, np.ravel(ours)
    tolerance = 1e-8 + NODAL * distorted * (name in OF_DISTORTION)
    if name == "field of view along":
        ours, expected = (np.where(distorted, np.maximum(v, ROOM), v) for v in (ours, expected))
    # A limit that cannot be missed is minus infinity.
    off = np.where(ours == expected, 0.0, np.abs(np.maximum(ours, -1e9) - expected))
    assert (off <= tolerance * (1 + np.abs(expected))).all(), (name, off.max())


def test_the_axis_is_tilted_as_little_as_the_field_of_view_lets_it(
    candidates: Compared,
) -> None:
    ours, layouts, problem = candidates
    expected = [layout.least_tilt_rad() for layout in layouts]
    off = np.abs(np.ravel(ours.tilt_rad) - expected)
    assert (off <= 2e-6 + NODAL * np.ravel(problem.distorted)).all()
    assert 0.2 < np.mean(np.ravel(ours.tilt_rad) == 0) < 0.8


LENGTHS = {
    "near_ray_rad": lambda v: v.near_rad,
    "far_ray_rad": lambda v: v.far_rad,
    "tilt_rad": lambda v: v.tilt,
    "focus_mm": lambda v: v.focus_mm(v.spans_mm),
    "image_distance_mm": lambda v: v.image_mm(v.spans_mm),
    "lens_extension_mm": lambda v: v.extension_mm,
    "air_height_mm": lambda v: v.air,
    "virtual_x_mm": lambda v: v.virtual.real,
    "virtual_z_mm": lambda v: v.virtual.imag,
    "mirror_rad": lambda v: v.mirror_rad,
    "pitch_rad": lambda v: -np.angle(v.ahead),
    "mirror_upper_x_mm": lambda v: v.upper.real,
    "mirror_upper_z_mm": lambda v: v.upper.imag,
    "mirror_lower_x_mm": lambda v: v.lower.real,
    "mirror_lower_z_mm": lambda v: v.lower.imag,
    "mirror_half_width_mm": lambda v: max(
        v.near_across * (v.lower - v.virtual).imag, v.far_across * (v.upper - v.virtual).imag
    ),
    "camera_x_mm": lambda v: v.pinhole.real,
    "camera_z_mm": lambda v: v.pinhole.imag,
    "camera_top_z_mm": lambda v: max(c.imag for c in v.corners),
    "camera_bottom_z_mm": lambda v: v.bottom,
    "camera_front_x_mm": lambda v: max(c.real for c in v.corners),
    "camera_rear_x_mm": lambda v: min(c.real for c in v.corners),
    "ledge_edge_x_mm": lambda v: v.ledge_x,
    "near_distance_mm": lambda v: v.images_mm[0][0],
    "far_distance_mm": lambda v: v.images_mm[1][0],
    "near_tangential_mm": lambda v: v.spans_mm[0][0],
    "near_sagittal_mm": lambda v: v.spans_mm[0][1],
    "far_tangential_mm": lambda v: v.spans_mm[1][0],
    "far_sagittal_mm": lambda v: v.spans_mm[1][1],
    "across_scale": lambda v: min(across for across, _ in v.scales()),
    "along_scale": lambda v: min(along for _, along in v.scales()),
    "corner_horizontal_tan": lambda v: v.horizontal_tan,
    "corner_vertical_tan": lambda v: v.vertical_tan,
    "mirror_depth_mm": lambda v: v.mirror_depth,
    "camera_depth_mm": lambda v: v.camera_depth,
    "depth_mm": lambda v: v.depth,
    "keystone": lambda v: v.keystone,
    "length_mm": lambda v: v.length_mm,
    "least_px": lambda v: v.p.min_px_per_marker / (1 + v.missed()["pixels per marker"]),
}


def test_all_lengths_are_those_of_plane_geometry(candidates: Compared) -> None:
    ours, layouts, problem = candidates
    assert {f.name for f in fields(Fold)} == {*LENGTHS, "violations", "housing"}
    for name, read in LENGTHS.items():
        expected = [read(layout) for layout in layouts]
        compare(getattr(ours, name), expected, problem, name)


def test_all_limits_are_those_of_plane_geometry(candidates: Compared) -> None:
    ours, layouts, problem = candidates
    missed = [layout.missed() | layout.beyond() for layout in layouts]
    found = ours.violations | ours.housing
    assert set(found) == set(missed[0])
    for name, values in found.items():
        expected = np.array([m[name] for m in missed])
        compare(values, expected, problem, name)
        assert 0 < np.mean(expected > 0) < 1, name


@pytest.mark.slow
def test_the_objective_is_that_of_plane_geometry(candidates: Compared) -> None:
    ours, layouts, problem = candidates
    compare(ours.worst(), [v.worst() for v in layouts], problem, "missed parts")
    found = np.ravel(ours.objective(problem))
    compare(found, [v.objective() for v in layouts], problem, "objective")
    # The same candidates, as if they missed nothing but what they use of the picture.
    kept = {k: np.minimum(v, 0.0) for k, v in ours.violations.items()}
    spared = replace(
        ours, violations=kept, housing={k: np.full_like(v, -1.0) for k, v in kept.items()}
    )
    sides = ("field of view along", "field of view across")
    within = np.array([max(v.missed()[side] for side in sides) < 0 for v in layouts])
    expected = np.array([v.goal() for v in layouts])[within]
    assert len(expected) > COUNT / 20
    found = np.ravel(spared.objective(problem))[within]
    compare(found, expected, problem.rows(within), "goal")


def test_grids_shrink_around_the_best_of_each_band() -> None:
    """Designs whose best candidate is known: the search ends there, whichever band holds it."""
    targets = np.radians([[-11.0, 0.0, 21.0], [20.0, 0.0, 55.0], [57.5, 0.0, 30.0]])
    targets[:, 1] = 0.26, 0.6, 0.99
    asked: list[np.ndarray] = []

    def nearest(mid: np.ndarray, spread: np.ndarray, mirror: np.ndarray, _: np.ndarray) -> Best:
        asked.append(np.array([np.ptp(axis, axis=1).max() for axis in (mid, spread, mirror)]))
        assert all((np.diff(axis, axis=1) >= 0).all() for axis in (mid, spread, mirror))
        found = []
        for grid in range(len(mid)):
            target = targets[grid % len(targets)]
            chosen, missed = [], 0.0
            for axis, wanted, size in zip(
                (mid, spread, mirror), target, UPPER - LOWER, strict=True
            ):
                best = axis[grid][np.argmin(np.abs(axis[grid] - wanted))]
                chosen.append(best)
                missed += abs(best - wanted) / size
            found.append((*chosen, missed))
        return Best(*np.array(found).T)

    bands = best_of_bands(len(targets), nearest)
    winner = bands.score.reshape(STARTS, -1).argmin(axis=0)
    best = Best(*(v.reshape(STARTS, -1)[winner, np.arange(len(targets))] for v in bands))
    np.testing.assert_allclose(np.column_stack(best[:3]), targets, atol=5e-3)
    assert np.all(best.score < 2e-2)
    assert len(asked) == LEVELS + 1
    step = (UPPER - LOWER) / (np.array(COARSE) - 1)
    np.testing.assert_allclose(asked[0], [2 * step[0], *(UPPER - LOWER)[1:]])
    # An axis keeps its width while the best lies at its rim.
    for wide, narrow in pairwise(asked[1:]):
        assert np.all(narrow <= wide * (1 + 1e-6))
    assert np.all(asked[-1][1:] < 0.2 * asked[1][1:])
