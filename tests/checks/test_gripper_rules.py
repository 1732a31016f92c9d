"""Rules on stroke, payload, gripping force and the strength of the mount, worked by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rule_samples import judged, overruled, shipped, smallest
from shipped_fingers import varied

from gelslim_cad.checks import check, margins_batch
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.spec.gripper_library import gripper_names, library_gripper

GRIPPER = "design.mount.gripper"
FORCE = "design.mount.grip_force_n"


def test_a_gripper_without_data_limits_nothing() -> None:
    for rule in ("object.size_mm", "gripper.force_n", "flange.pattern_mm"):
        found = judged(rule, {"design.mount.object_size_mm": 500.0})
        assert (found.status, found.limit) == ("pass", None), rule
    assert judged("flange.measured").status == "pass"


def test_two_fingers_and_the_object_share_the_stroke() -> None:
    thickness = smallest()["finger.thickness_mm"]
    # Robotiq 2F-85: 85 mm and 13.2 mm between the bare jaws; the plate lies 0.2 mm below
    # the wires, which leave on the inner face of the cover.
    cover = smallest()["cover.top_z_mm"]
    plate = derive(varied(shipped("mini20"), {GRIPPER: "robotiq_2f85"}))["flange.thickness_mm"]
    found = judged("object.size_mm", {GRIPPER: "robotiq_2f85"})
    assert found.limit == pytest.approx(85 + 13.2 - 2 * (plate - cover + 0.2))
    assert plate - cover + 0.2 > max(thickness, 6.6)
    # Franka: bolts of M3 (head 5.5) 2 mm from the edges of a strip below the back.
    found = judged("object.size_mm", {GRIPPER: "franka_hand"})
    assert found.limit == pytest.approx(80 + 37 - 2 * max(thickness + (5.5 + 4) / 2, 18.5))
    most = found.limit
    assert most is not None
    for size, status in ((most - 0.01, "pass"), (most + 0.01, "fail")):
        changes = {GRIPPER: "franka_hand", "design.mount.object_size_mm": size}
        assert judged("object.size_mm", changes).status == status


def test_a_gripper_whose_jaws_stay_far_apart_moves_the_flange_towards_the_object() -> None:
    thin = derive(varied(shipped("mini20"), {GRIPPER: "franka_hand"}))
    assert thin["flange.jaw_z_mm"] == pytest.approx(-thin["finger.thickness_mm"] - 4.75)
    closed = overruled(thin, {"finger.thickness_mm": 5.0})
    from gelslim_cad.dimensions.mount import flange_jaw_z_mm

    assert flange_jaw_z_mm(closed["finger.thickness_mm"], 9.5, -4.0, 5.0, "franka_hand") == -18.5


def test_payload_is_the_lesser_of_friction_and_of_the_gripper() -> None:
    # 10 N, µ 0.5 on two gels, twice the weight: 10 / (2 * 9.81) kg.
    assert judged("object.mass_g").limit == pytest.approx(509.684, abs=1e-3)
    strong = {GRIPPER: "wsg50", FORCE: 80.0}
    assert judged("object.mass_g", strong).limit == pytest.approx(800.0)
    heavy = {**strong, "design.mount.object_mass_g": 801.0}
    assert judged("object.mass_g", heavy).status == "fail"


def test_a_force_outside_the_range_of_the_gripper_fails() -> None:
    for force, status in ((4.9, "fail"), (5.0, "pass"), (80.0, "pass"), (80.1, "fail")):
        assert judged("gripper.force_n", {GRIPPER: "wsg50", FORCE: force}).status == status
    assert "5 to 80 N" in judged("gripper.force_n", {GRIPPER: "wsg50", FORCE: 3.0}).reason
    # Left out it is at least what the gripper can be set to.
    assert judged("gripper.force_n", {GRIPPER: "robotiq_2f85"}).value == 20
    assert judged("gripper.force_n", {GRIPPER: "onrobot_rg2"}).value == 10


def test_stresses_are_those_of_a_cantilever() -> None:
    d = derive(varied(shipped("mini20"), {FORCE: 20.0}))
    arm = -d["finger.proximal_x_mm"]
    b, h = d["tongue.outer_y_mm"] - d["tongue.inner_y_mm"], d["design.mount.tongue_thickness_mm"]
    # Bending stress M c / I of two rectangles side by side.
    inertia = 2 * b * h**3 / 12
    assert d["grip.tongue_mpa"] == pytest.approx(20 * arm * (h / 2) / inertia)
    t, gap = 5.0, d["camera.cable_width_mm"] + 2 * d["design.housing.fit_clearance_mm"]
    inertia = (d["flange.width_mm"] - gap) * t**3 / 12
    assert d["grip.flange_mpa"] == pytest.approx(20 * (arm + t) * (t / 2) / inertia)
    # Two M4, whose heads of 7 mm stand 2 mm from the edge on which the flange turns.
    assert d["grip.bolt_n"] * 2 * 5.5 == pytest.approx(20 * (arm + t))
    # Stresses rise with the force, so the limit does not depend on it.
    weak = derive(varied(shipped("mini20"), {FORCE: 5.0}))
    assert weak["grip.limit_n"] == pytest.approx(d["grip.limit_n"])


def test_the_limit_is_the_force_at_which_the_first_rule_fails() -> None:
    rules = ("grip.tongue_mpa", "grip.flange_mpa", "grip.bolt_n")
    for process in ("sla", "fdm", "sls"):
        base = {"manufacturing.print_process": process}
        limit = derive(varied(shipped("mini20"), base))["grip.limit_n"]
        for force, failing in ((0.999 * limit, 0), (1.001 * limit, 1)):
            found = check(derive(varied(shipped("mini20"), {**base, FORCE: force})))
            assert sum(found.of(r).status == "fail" for r in rules) == failing  # type: ignore[arg-type]
    thin = judged("grip.flange_mpa", {"design.mount.flange_thickness_mm": 2.0})
    arm = -smallest()["finger.proximal_x_mm"]
    ratio = thin.value / judged("grip.flange_mpa").value
    assert ratio == pytest.approx((5 / 2) ** 2 * (arm + 2) / (arm + 5))


def test_a_gripper_stronger_than_the_mount_is_warned_of() -> None:
    found = judged("grip.limit_n", {GRIPPER: "robotiq_2f85"})
    assert (found.status, found.limit) == ("warn", 235)
    assert judged("grip.limit_n").status == "pass"


def test_bolts_beside_the_jaw_and_heads_that_touch_fail() -> None:
    spacing, bolt = "design.mount.flange_bolt_spacing_mm", "design.mount.flange_bolt"
    # Jaw of 22 mm; M3 with a hole of 3.2 mm and 1 mm around it: 22 - 5.2.
    for value, status in ((16.8, "pass"), (16.81, "fail")):
        changes = {GRIPPER: "franka_hand", spacing: value}
        assert judged("flange.pattern_mm", changes).status == status
    # Along the finger on a lateral jaw of 37.5 mm; M5, hole of 5.3 mm.
    for value, status in ((37.5 - 7.3, "pass"), (37.5 - 7.29, "fail")):
        changes = {GRIPPER: "robotiq_2f85", spacing: value}
        assert judged("flange.pattern_mm", changes).status == status
    for value, status in ((7.5, "pass"), (7.49, "fail")):
        assert judged("flange.heads_mm", {spacing: value}).status == status
    assert judged("flange.heads_mm", {spacing: 9.0, bolt: "M6"}).status == "fail"


@pytest.mark.parametrize("name", [n for n in gripper_names() if n != "generic"])
def test_every_gripper_holds_the_smallest_finger_and_assumed_places_are_told(name: str) -> None:
    found = check(derive(varied(shipped("mini20"), {GRIPPER: name})))
    ids = [c.id for c in found if c.group == "Gripper" and c.status == "fail"]
    assert ids == []
    assert found.of("flange.measured").status == (
        "warn" if library_gripper(name).places_assumed else "pass"
    )
    measured = varied(
        shipped("mini20"), {GRIPPER: name, "design.mount.flange_bolt_spacing_mm": 14.0}
    )
    assert check(derive(measured)).of("flange.measured").status == "pass"


def test_batches_judge_as_single_designs_do() -> None:
    spec = varied(shipped("mini20"), {GRIPPER: "wsg32"})
    spacing = np.array([6.0, 12.0, 30.0])
    force = np.array([4.0, 20.0, 300.0])
    paths = {"design.mount.flange_bolt_spacing_mm": spacing, FORCE: force}
    margins = margins_batch(derive_batch(spec, paths))
    for k in range(3):
        changes = {path: float(values[k]) for path, values in paths.items()}
        for found in check(derive(varied(spec, changes))):
            if found.group == "Gripper":
                below = bool(margins[found.id][k] < 0)  # type: ignore[index]
                assert below == (found.status == "fail"), (found.id, k)
                assert not math.isnan(float(margins[found.id][k]))  # type: ignore[index]


def test_a_given_spacing_replaces_any_pattern() -> None:
    library = library_gripper("wsg50")
    jaw = library.jaw.model_copy(update={"holes_mm": ((-8.0, -6.0), (8.0, -6.0), (8.0, 6.0))})
    three = JawBolts(library.model_copy(update={"jaw": jaw}), "M4")
    assert (three.count, three.reach_y_mm, three.reach_u_mm) == (3, 8, 6)
    assert three.apart_mm == pytest.approx(12)
    # From the first hole to the last: 16 across and 12 along in 20 mm.
    two = replace(three, spacing_mm=10.0)
    assert two.places_mm == (pytest.approx((-4, -3)), pytest.approx((4, 3)))
    assert (two.count, two.apart_mm) == (2, pytest.approx(10))
    jaw = jaw.model_copy(update={"holes_mm": ((0.0, 0.0),)})
    one = JawBolts(library.model_copy(update={"jaw": jaw}), "M4")
    assert (one.count, one.apart_mm) == (1, math.inf)
    assert replace(one, spacing_mm=6.0).places_mm == ((-3, 0), (3, 0))


def test_the_plate_on_a_lateral_jaw_is_no_wider_than_the_jaw() -> None:
    d = derive(varied(shipped("mini20"), {GRIPPER: "robotiq_2f85"}))
    arm = 6.0 - d["finger.proximal_x_mm"]
    # 20 N, a jaw of 22 mm, a plate of 6 mm.
    assert d["flange.width_mm"] - d["camera.cable_width_mm"] > 22.4
    assert d["grip.flange_mpa"] == pytest.approx(20 * arm * 3 / (22 * 6**3 / 12))
    # Two bolts in the middle of a plate of 37.5 mm, which turns about its front edge.
    assert d["grip.bolt_n"] == pytest.approx(20 * arm / (2 * 18.75))
