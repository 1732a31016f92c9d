"""What the envelope asks for: limits of length and thickness, goals, and their weights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fold_samples import mini20, shipped
from shipped_fingers import varied

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive, derive_batch
from gelslim_cad.dimensions.fold.wishes import EQUAL_MM
from gelslim_cad.spec import Spec
from gelslim_core.yaml.errors import FieldError

ENVELOPE = "design.envelope."
BOARD = {
    "camera.image_width_px": 2304,
    "camera.image_height_px": 1296,
    "camera.sensor_width_mm": 6.4512,
    "camera.sensor_height_mm": 3.6288,
    "camera.focal_length_mm": 2.75,
    "camera.f_number": 2.2,
    "camera.focus_nearest_mm": 50.0,
    "camera.module_width_mm": 25.0,
    "camera.module_height_mm": 23.9,
    "camera.lens_diameter_mm": 7.0,
    "camera.lens_height_mm": 2.0,
    "design.envelope.max_thickness_mm": None,
}
"""A wide camera on its board (Raspberry Pi Camera Module 3 Wide)."""


def finger(name: str, changes: dict[str, Any]) -> Dimensions:
    return derive(varied(shipped(name), changes))


def wide(changes: dict[str, Any]) -> Dimensions:
    return finger("mini20", {**BOARD, **changes})


def failed(d: Dimensions) -> set[str]:
    return {c.id for c in check(d) if c.status == "fail"}


def with_lens(changes: dict[str, Any]) -> Dimensions:
    return finger("gelslim3_lens", {ENVELOPE + "max_thickness_mm": None, **changes})


@pytest.mark.parametrize(
    "make", [mini20, pytest.param(with_lens, marks=pytest.mark.slow)], ids=["mini20", "lens"]
)
def test_a_length_limit_is_kept_by_a_thicker_finger(make: Any) -> None:
    shortest = make({ENVELOPE + "goal": "shortest"})["finger.length_mm"]
    free = make({})
    limits = np.linspace(shortest + 0.01, free["finger.length_mm"] + 1.0, 4)
    found = [make({ENVELOPE + "max_length_mm": float(limit)}) for limit in limits]
    for limit, d in zip(limits, found, strict=True):
        assert d.feasible()
        assert d["finger.length_mm"] <= limit + 1e-9
    thickness = [d["finger.thickness_mm"] for d in found]
    assert np.all(np.diff(thickness) <= EQUAL_MM)
    assert thickness[0] > thickness[-1] + 0.02
    assert thickness[-1] == pytest.approx(free["finger.thickness_mm"], abs=EQUAL_MM)


@pytest.mark.parametrize("make", [mini20, wide], ids=["mini20", "board"])
def test_a_length_that_is_just_too_short_is_missed_by_as_little(make: Any) -> None:
    """The view is kept, and the finger is as short as it can be; only the length fails.

    So short a fold has the camera low over the cover, and leaves no room for a cable under it.
    """
    free = {ENVELOPE + "max_thickness_mm": None, "camera.cable_exit": "rear"}
    shortest = make({**free, ENVELOPE + "goal": "shortest"})["finger.length_mm"]
    d = make({**free, ENVELOPE + "max_length_mm": shortest - 0.5})
    assert d.feasible()
    assert d["finger.length_mm"] == pytest.approx(shortest, abs=EQUAL_MM + 0.01)
    assert failed(d) == {"finger.length_mm"}


def test_the_best_picture_of_a_thickness_lies_between_thinnest_and_best() -> None:
    thin = mini20()
    best = mini20({ENVELOPE + "goal": "best_picture", ENVELOPE + "max_thickness_mm": None})
    px = []
    for limit in (18.0, 18.5, 19.5, 21.0):
        d = mini20({ENVELOPE + "goal": "best_picture", ENVELOPE + "max_thickness_mm": limit})
        assert d["finger.thickness_mm"] <= limit + 1e-6
        px.append(min(d["view.marker_across_px"], d["view.marker_along_px"]))
    assert np.all(np.diff(px) > 0)
    assert px[0] > min(thin["view.marker_across_px"], thin["view.marker_along_px"])
    most = min(best["view.marker_across_px"], best["view.marker_along_px"])
    assert px[-1] <= most + 0.05


@pytest.mark.parametrize("worth", [pytest.param(0.1, marks=pytest.mark.slow), 0.5])
def test_a_weighted_finger_is_the_best_of_those_with_a_length_limit(worth: float) -> None:
    """Thickness and weighted length: the least over all lengths, each with its thinnest finger."""
    d = wide({ENVELOPE + "length_worth": worth})
    ours = d["finger.thickness_mm"] + worth * d["finger.length_mm"]
    spec = varied(shipped("mini20"), BOARD)
    shortest = wide({ENVELOPE + "goal": "shortest"})["finger.length_mm"]
    limits = np.linspace(shortest + 0.01, shortest + 40, 60)
    batch = derive_batch(spec, {ENVELOPE + "max_length_mm": limits})
    best = (batch["finger.thickness_mm"] + worth * batch["finger.length_mm"]).min()
    assert best - EQUAL_MM - 0.3 * worth < ours < best + 0.01


def test_equal_fingers_are_told_apart_by_their_length() -> None:
    """Within 0.05 mm of the least thickness no other length limit gives a shorter finger."""
    for name in ("gelslim3_lens", "thin"):
        d = finger(name, {})
        length, thickness = d["finger.length_mm"], d["finger.thickness_mm"]
        limits = {ENVELOPE + "max_length_mm": length + np.array([-0.2, 5.0])}
        shorter, longer = derive_batch(shipped(name), limits)["finger.thickness_mm"]
        assert longer == pytest.approx(thickness, abs=1e-3)
        assert shorter > thickness


def test_weights_belong_to_the_thinnest_finger() -> None:
    data = shipped("mini20").model_dump()
    data["design"]["envelope"] |= {"goal": "shortest", "pixel_worth_mm": 0.1}
    with pytest.raises((FieldError, ValueError)):
        Spec(**data)


@pytest.mark.slow
def test_a_large_board_is_told_which_module_would_fit() -> None:
    from gelslim_cad.checks.binding import binding_sentences

    changes = {**BOARD, "design.envelope.max_thickness_mm": 20.0}
    spec = varied(shipped("mini20"), changes)
    advice = " ".join(binding_sentences(spec, derive(spec)))
    size = float(advice.split(" mm would fit")[0].rsplit(" ", 1)[-1])
    fits = wide({**changes, "camera.module_height_mm": size, "camera.module_width_mm": size})
    assert fits.feasible()
    assert fits["finger.thickness_mm"] <= 20.0
    larger = {"camera.module_height_mm": size + 0.5, "camera.module_width_mm": size + 0.5}
    assert wide({**changes, **larger})["finger.thickness_mm"] > 20.0


CABLE_LIMITS = ("cable over cover", "cable under roof", "clamp floor")


@pytest.mark.parametrize(
    ("name", "goal"),
    [("wide", "shortest"), ("wide", "best_picture"), ("gelslim3_lens", "best_picture")],
)
def test_the_search_ends_where_the_camera_cable_has_room(name: str, goal: str) -> None:
    """The cable leaves at the bottom: the goal alone would put the camera onto the cover."""
    d = finger(name, {"design.envelope.goal": goal, "design.envelope.max_thickness_mm": 24.0})
    assert d["camera.cable_exit"] == "bottom"
    assert failed(d) == set()
    assert max(float(np.max(d.fold.housing[limit])) for limit in CABLE_LIMITS) < 1e-6


@pytest.mark.parametrize("exit_side", ["rear", "top", "bottom"])
def test_limits_of_the_cable_are_those_of_its_rules(exit_side: str) -> None:
    d = finger("gelslim2", {"camera.cable_exit": exit_side})
    values = {c.id: c.value - c.limit for c in check(d) if c.id.startswith("cable.")}
    missed = {limit: float(np.reshape(d.fold.housing[limit], -1)[0]) for limit in CABLE_LIMITS}
    assert missed["cable over cover"] == pytest.approx(-values["cable.cover_mm"], abs=1e-9)
    top = max(d["cable.level_z_mm"] + d["cable.thickness_mm"] / 2, d["wire.lane_top_z_mm"])
    roof = -d["design.housing.gel_proud_mm"] - top
    assert values["cable.roof_mm"] == pytest.approx(roof - 1.2)
    assert missed["cable under roof"] <= -values["cable.roof_mm"] + 1e-9
    if exit_side == "bottom":
        assert missed["clamp floor"] == pytest.approx(-values["cable.floor_mm"], abs=1e-9)
