"""What the paper says of thickness, keystone and depth of field follows from the dimensions."""

from __future__ import annotations

from itertools import pairwise

import pytest
from fold_samples import mini20, shipped

from gelslim_cad.dimensions import derive
from gelslim_cad.dimensions.fold.wishes import EQUAL_MM

ANY_BLUR = {"design.optics.blur_per_diameter": 2.0}
AS_IN_THE_PAPER = {
    **ANY_BLUR,
    "camera.focusing": "internal",
    "camera.horizontal_fov_deg": 53.5,
    "camera.field_of_view_at_mm": 30.0,
}
"""The published trade-off takes the field of view of the sheet to hold at the gel."""


def test_20_mm_gel_fits_a_finger_of_18_mm() -> None:
    d = mini20()
    assert d.feasible()
    assert d["finger.thickness_mm"] <= 18.0


def test_the_shipped_larger_finger_is_feasible() -> None:
    assert derive(shipped("gelslim2")).feasible()


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("design.optics.max_keystone", (1.1, 1.15, 1.2, 1.24, 1.3, 1.36, 1.49)),
        ("design.optics.blur_per_diameter", (0.1, 0.15, 0.2, 0.25, 1 / 3, 0.4, 0.5, 0.7)),
    ],
)
def test_a_stricter_limit_never_gives_a_thinner_finger(
    path: str, values: tuple[float, ...]
) -> None:
    relaxed = {} if path.endswith("diameter") else ANY_BLUR
    found = [mini20({**relaxed, path: v}) for v in values]
    assert all(d.feasible() for d in found)
    thickness = [d["finger.thickness_mm"] for d in found]
    # Of 0.05 mm the search gives up what makes the finger shorter.
    assert all(b <= a + EQUAL_MM for a, b in pairwise(thickness))
    assert thickness[0] > thickness[-1] + 1.0


def test_thinner_means_more_keystone_and_more_depth_of_field() -> None:
    found = [mini20({"design.optics.blur_per_diameter": b}) for b in (0.15, 0.25, 1 / 3, 0.5)]
    for thick, thin in pairwise(found):
        assert thin["finger.thickness_mm"] < thick["finger.thickness_mm"]
        assert thin["view.keystone"] > thick["view.keystone"]
        assert thin["view.depth_range_mm"] > thick["view.depth_range_mm"]


@pytest.mark.parametrize(
    ("keystone", "reference_mm", "measured_mm", "focused_mm"),
    [
        # Reference: the published trade-off by depth of field 4, 6, 8, 10 mm, apparent.
        (1.15, 18.4, 18.338, 18.904),
        (1.24, 17.7, 17.888, 18.302),
        (1.36, 16.7, 17.119, 17.190),
        (1.49, 15.8, 16.115, 16.115),
    ],
)
def test_thickness_for_a_limited_keystone(
    keystone: float, reference_mm: float, measured_mm: float, focused_mm: float
) -> None:
    limit = {
        "design.optics.max_keystone": keystone,
        "design.optics.min_px_per_marker": 6.0,
        "design.markers.diameter_mm": 0.5,
        # The trade-off knows no cable; one that leaves at the bottom needs room under the camera.
        "camera.cable_exit": "rear",
    }
    d = mini20({**AS_IN_THE_PAPER, **limit})
    assert d["view.keystone"] <= keystone + 1e-6
    assert d["finger.thickness_mm"] == pytest.approx(measured_mm, abs=0.02)
    # Up to 0.4 mm above the reference at large keystone: here the gel's corners, too, lie in the
    # image with 1.5 % to spare, clearances and mirror border are kept, and rays are exact.
    assert d["finger.thickness_mm"] == pytest.approx(reference_mm, abs=0.4 + EQUAL_MM)
    # A lens that is unscrewed to focus sees less.
    focused = mini20({**ANY_BLUR, **limit})
    assert focused["finger.thickness_mm"] == pytest.approx(focused_mm, abs=0.02)


def test_a_50_mm_gel_does_not_fit_18_mm() -> None:
    gel = {"design.gel.length_mm": 50.0, "design.gel.width_mm": 25.0}
    d = mini20(gel)
    assert not d.feasible() or d["finger.thickness_mm"] > 24.0
    # Not even with every limit on the picture but the pixels dropped.
    loose = mini20({**gel, **ANY_BLUR, "design.optics.max_keystone": 5.0})
    assert not loose.feasible() or loose["finger.thickness_mm"] > 18.0


@pytest.mark.parametrize("blur", [0.1, 0.15, 0.2, 1 / 3])
def test_blur_and_keystone_limits_hold_at_both_edges(blur: float) -> None:
    # An axis tilted back once slipped through, its near edge farther than the far one.
    d = mini20({"design.optics.blur_per_diameter": blur, "design.optics.max_keystone": 1.2})
    limit = blur * d["design.markers.diameter_mm"] * (1 + 1e-6)
    assert max(d["view.near_blur_mm"], d["view.far_blur_mm"]) <= limit
    assert 1 / 1.2 - 1e-6 <= d["view.keystone"] <= 1.2 + 1e-6
