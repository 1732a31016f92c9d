"""Lenses that cannot be focused, cannot be unscrewed far enough, or stand in the way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec


def finger(name: str, changes: dict[str, Any]) -> Dimensions:
    data = read_spec(f"designs/{name}.yaml").spec.model_dump()
    for path, value in {"design.optics.image_margin": 0.015, **changes}.items():
        *blocks, field = path.split(".")
        block = data
        for key in blocks:
            block = block[key]
        assert field in block
        block[field] = value
    return derive(Spec(**data))


def failed(d: Dimensions) -> set[str]:
    return {c.id for c in check(d) if c.status == "fail"}


def test_a_lens_that_is_unscrewed_too_little_is_set_farther_away() -> None:
    """Where the thread ends the camera must be so far that f² / (s - f) is within its travel."""
    free = finger("mini20", {})
    for travel in (0.45, 0.4):
        d = finger(
            "mini20", {"camera.lens_travel_mm": travel, "design.optics.min_px_per_marker": 5.0}
        )
        f, s = 3.6, d["view.focus_mm"]
        assert d.feasible()
        assert f * f / (s - f) == pytest.approx(d["view.lens_travel_mm"], rel=1e-9)
        assert d["view.lens_travel_mm"] <= travel + 1e-6
        assert s > free["view.focus_mm"]


def test_a_gel_nearer_than_any_travel_allows_fails_by_the_travel() -> None:
    d = finger("mini20", {"camera.lens_travel_mm": 0.0})
    assert not d.feasible()
    assert {"focus.travel_mm", "fold.feasible"} & failed(d)


@pytest.mark.parametrize("height", [1.5, 3.0, 5.0])
def test_an_unscrewed_lens_stays_below_the_window(height: float) -> None:
    """Every corner of the barrel, moved out by its extension, by the pose of the camera."""
    d = finger("gelslim2", {"camera.lens_height_mm": height, "camera.entrance_pupil_mm": 0.5})
    assert d.feasible()
    pitch = math.radians(d["camera_pose.pitch_deg"])
    extension = d["view.image_distance_mm"] - 3.6
    ahead = height + extension - d["camera_pose.face_mm"]
    assert ahead == pytest.approx(d["camera_pose.lens_front_mm"], rel=1e-9)
    for side in (3.0, -3.0):
        x = d["camera_pose.x_mm"] + ahead * math.cos(pitch) + side * math.sin(pitch)
        z = d["camera_pose.z_mm"] - ahead * math.sin(pitch) + side * math.cos(pitch)
        assert z <= d["stack.window_bottom_z_mm"] - 0.3 + 1e-6
        assert x <= d["camera_pose.front_x_mm"] + 1e-9


def test_a_depth_of_field_that_no_focus_satisfies_is_told() -> None:
    """The gel spans a depth; at any focus one of its ends blurs by at least A (r - 1) / (r + 1)."""
    d = finger("gelslim2", {"camera.f_number": 0.7, "design.optics.blur_per_diameter": 0.01})
    assert not d.feasible()
    assert {"blur.limit", "fold.feasible"} <= failed(d)
    images = [d[f"view.{e}_{k}_mm"] for e in ("near", "far") for k in ("sagittal", "tangential")]
    aperture = 3.6 / 0.7
    least = min(
        max(aperture * abs(z - s) / s for z in images)
        for s in np.linspace(min(images), max(images), 400)
    )
    assert least > 0.01 * 0.5
    ours = max(d["view.near_blur_mm"], d["view.far_blur_mm"])
    assert least == pytest.approx(ours, rel=0.01)


@pytest.mark.parametrize("distance", [30.0, 33.0, 36.0])
def test_a_lens_that_cannot_be_focused_blurs_by_its_own_distance(distance: float) -> None:
    changes = {
        "camera.focusing": "fixed",
        "camera.focus_distance_mm": distance,
        "design.optics.blur_per_diameter": 1.0,
        "design.envelope.max_thickness_mm": None,
    }
    d = finger("mini20", changes)
    assert d["view.focus_mm"] == distance
    assert d["view.image_distance_mm"] == pytest.approx(3.6 * distance / (distance - 3.6))
    images = [d[f"view.{e}_{k}_mm"] for e in ("near", "far") for k in ("sagittal", "tangential")]
    blur = max(3.6 / 2.9 * abs(z - distance) / distance for z in images)
    assert max(d["view.near_blur_mm"], d["view.far_blur_mm"]) == pytest.approx(blur, rel=1e-9)


def test_a_lens_fixed_at_a_metre_is_refused() -> None:
    d = finger("mini20", {"camera.focusing": "fixed", "camera.focus_distance_mm": 1000.0})
    assert "blur.limit" in failed(d)


def test_a_field_of_view_narrower_by_one_per_cent_costs_thickness_or_fails() -> None:
    """Across the finger the picture of `wide` is full; with 0.99 of it the camera moves off."""
    wide = finger("wide", {})
    assert wide["view.across_use"] == pytest.approx(0.985, abs=1e-4)
    width = wide["view.sensor_across_mm"]
    focal = float(wide["camera.focal_length_mm"])
    narrower = math.degrees(2 * math.atan(0.99 * width / 2 / focal))
    d = finger("wide", {"camera.horizontal_fov_deg": narrower})
    assert d["view.sensor_across_mm"] == pytest.approx(0.99 * width)
    assert d["view.across_use"] <= 0.985 + 1e-6
    assert d["finger.thickness_mm"] > wide["finger.thickness_mm"] + 0.05
    held = {
        "camera.horizontal_fov_deg": narrower,
        "design.envelope.max_thickness_mm": wide["finger.thickness_mm"] - 0.04,
    }
    assert "finger.thickness_mm" in failed(finger("wide", held))
