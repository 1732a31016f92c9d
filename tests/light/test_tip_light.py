"""A third strip at the tip: scene, study, exposure, bundle, pictures of the twin, contact patch."""

from __future__ import annotations

import json
import math
import struct
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gelslim
from gelslim.cli import main
from gelslim_cad.build.light_notes import light_notes, light_pictures
from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.explore.brightness import light_columns, trace
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.geometry.overlay import light_paths
from gelslim_cad.light.exposure import exposure_at
from gelslim_cad.light.figures import irradiance_png, paths_png, shown_paths
from gelslim_cad.light.ray_ladder import half_widths
from gelslim_cad.light.scene import light_inputs, light_scene, media, tip_row
from gelslim_cad.light.study import LightStudy, study_light, study_record
from gelslim_cad.sensor import make_bundle, marker_grid, pad_light, pad_mesh
from gelslim_cad.spec import Spec
from gelslim_cad.tolerance.causes import causes
from gelslim_cad.tolerance.margins import margins
from gelslim_force.contact.indenter import parse_indenter
from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.trace import trace_light
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.simulation.picture import sensor_renderer
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.files import load_bundle, write_bundle

Array = NDArray[np.float64]
MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"
RAYS = 1 << 13


@cache
def spec(light: str, tip: str) -> Spec:
    content = gelslim.read_spec(MINI20).spec.model_dump()
    content["design"]["leds"] |= {"light": light, "tip": tip}
    content["mesh"] |= {"cells_along": 14, "cells_across": 14, "layers": 2}
    return Spec.model_validate(content)


@cache
def finger(light: str = "red_green", tip: str = "blue") -> Dimensions:
    return derive(spec(light, tip))


@cache
def study(light: str = "red_green", tip: str = "blue") -> LightStudy:
    return study_light(finger(light, tip), rays=RAYS, curve=False)


@cache
def bundle(tip: str) -> Bundle:
    d = finger(tip=tip)
    grid = marker_grid(d)
    return make_bundle(spec("red_green", tip), d, pad_mesh(d, grid)[0], grid)


def test_the_row_stands_before_the_end_face_in_the_middle_of_the_window() -> None:
    d = finger()
    row, scene = tip_row(d), light_scene(d, guide_profile(d))
    assert scene.sources[-1] == row
    assert [source.colour for source in scene.sources] == ["red", "green", "blue"]
    assert row.end == "last"
    assert row.gap_mm == pytest.approx(d["design.housing.fit_clearance_mm"])
    edges = (min(row.y_mm) - row.size_mm / 2, max(row.y_mm) + row.size_mm / 2)
    assert edges[0] == pytest.approx(-edges[1])
    assert edges[1] < d["guide.flat_width_mm"] / 2
    middle = d["stack.gel_bottom_z_mm"] - d["design.light_guide.thickness_mm"] / 2
    assert row.z_mm == pytest.approx(middle)
    assert np.diff(row.y_mm) == pytest.approx(d["led.tip_pitch_mm"])
    assert row.power == pytest.approx(len(row.y_mm) / d["led.count"])
    acrylic = media(d)["acrylic"]
    assert acrylic.index_for("blue") > acrylic.index_for("green") > acrylic.index_for("red")
    white = finger("white", "white")
    names = [source.colour for source in light_scene(white, guide_profile(white)).sources]
    assert names == ["left", "right", "tip"]
    assert len({media(white)["acrylic"].index_for(name) for name in names}) == 1


def test_the_sides_keep_their_figures_beside_a_light_at_the_tip() -> None:
    three, two = study(), study(tip="none")
    assert three.light.colours == ("red", "green", "blue")
    assert three.comparisons == two.comparisons
    assert three.exposures[:2] == two.exposures
    assert three.glued_exposures == two.glued_exposures
    assert three.light.ledger_gap() < 1e-12
    assert three.light.value("lost") == 0
    assert two.tip is None
    assert "tip" not in study_record(two)
    lights = study_record(two)["guides"]["curved"]["by_colour"]
    assert all("slope_sensitivity_along" not in found for found in lights.values())


def test_each_light_shows_the_slope_along_its_own_way() -> None:
    light = study().light
    along = {c: light.slope_sensitivity(c, "x").value for c in light.colours}
    across = {c: light.slope_sensitivity(c).value for c in light.colours}
    assert across["red"] < -1.5 < 1.5 < across["green"]
    assert along["blue"] > 1.5
    for small in (along["red"], along["green"], across["blue"]):
        assert abs(small) < 0.2
    record = study_record(study())
    lights = record["guides"]["curved"]["by_colour"]
    assert lights["blue"]["slope_sensitivity_along"]["value"] == along["blue"]
    assert record["tip"]["colour"] == "blue"


def test_exposure_counts_the_leds_of_the_tip() -> None:
    inputs = light_inputs(finger())
    more = {**inputs, "led.tip_count": 2 * inputs["led.tip_count"]}
    for colour, factor in (("red", 1.0), ("green", 1.0), ("blue", 2.0)):
        one, two = (exposure_at(d, 1e-3, colour) for d in (inputs, more))
        assert two.irradiance_uw_mm2 == pytest.approx(factor * one.irradiance_uw_mm2)
        assert two.exposure_ms == pytest.approx(one.exposure_ms / factor)
    watts = inputs["design.leds.radiant_flux_mw"] / 1000 * inputs["led.tip_count"]
    blue = exposure_at(inputs, 1e-3, "blue")
    assert blue.irradiance_uw_mm2 == pytest.approx(1e3 * watts)
    found = study()
    assert found.tip is not None
    red, green, third = (e.irradiance_uw_mm2 for e in found.exposures)
    assert found.tip.over_sides == pytest.approx(2 * third / (red + green))
    assert 0.3 < found.tip.over_sides < 3


def test_exploring_takes_the_darkest_and_the_slowest_of_three() -> None:
    inputs = light_inputs(finger())
    traced = trace(inputs, 1 << 10)
    assert traced.tip_per_w is not None
    columns = light_columns(inputs, traced)
    per_w = (traced.left_per_w, traced.right_per_w, traced.tip_per_w)
    found = [exposure_at(inputs, w, c) for w, c in zip(per_w, study().light.colours, strict=True)]
    assert columns["light.irradiance_uw_mm2"] == min(e.irradiance_uw_mm2 for e in found)
    assert columns["light.exposure_ms"] == max(e.exposure_ms for e in found)
    assert trace(light_inputs(finger(tip="none")), 1 << 10).tip_per_w is None


def test_rays_are_chosen_by_the_error_of_all_three() -> None:
    halves = half_widths(study().light)
    blue = study().light.arrived("blue")
    assert len(halves) == 3
    assert halves[2] == pytest.approx((blue.high - blue.low) / 2 / blue.value)


def test_the_bundle_has_a_third_map_and_keeps_the_others(tmp_path: Path) -> None:
    three, two = pad_light(finger()), pad_light(finger(tip="none"))
    assert two.irradiance.shape[-1] == 2
    ratio = three.irradiance[..., :2] / two.irradiance
    assert np.ptp(ratio) < 1e-9 * ratio.mean()
    assert three.azimuth_deg.tolist() == [90.0, -90.0, 180.0]
    assert three.elevation_deg[:2].tolist() == two.elevation_deg.tolist()
    assert three.directions[2][0] < -0.5
    assert three.colour.argmax(axis=1).tolist() == [0, 1, 2]
    # A beam is shaded as its traced light: cot e per unit slope. The rays are others.
    traced = trace_light(light_scene(finger(), guide_profile(finger())), 1 << 16, seed=4)
    steep = 1 / np.tan(np.radians(three.elevation_deg))
    found = [traced.slope_sensitivity(*c) for c in (("red", "y"), ("green", "y"), ("blue", "x"))]
    np.testing.assert_allclose(steep, [abs(f.value) for f in found], rtol=0.03)
    # Brightness of the tip against green, which the camera sees alike: by all LEDs of each.
    means = three.irradiance.mean(axis=(0, 1))
    per_w = traced.irradiance("blue").mean() / traced.irradiance("green").mean()
    leds = finger()["led.tip_count"] / finger()["led.count"]
    assert means[2] / means[1] == pytest.approx(per_w * leds, rel=0.02)
    # Outside its axes a map goes on; the tip's falls off towards the gripper.
    along = three.irradiance[..., 2].mean(axis=0)
    assert along[: len(along) // 4].mean() < 0.7 * along.mean()

    write_bundle(tmp_path / "bundle", bundle("blue"))
    read = load_bundle(tmp_path / "bundle", verify=True)
    again = LightMap(**{n: np.asarray(v) for n, v in read.light.items()})
    assert again.sources == 3
    assert np.array_equal(again.irradiance, three.irradiance)


@cache
def renderer(tip: str) -> FrameRenderer:
    from gelslim_force.calibration.design import bundle_camera

    held = bundle(tip)
    return sensor_renderer(TwinSensor(held), bundle_camera(held), Look(shading=Shading()), 0)


def pressed(cap: Array, x: Array, y: Array) -> SurfaceState:
    moved = np.zeros((*cap.shape, 3))
    moved[..., 2] = cap
    return SurfaceState(x[0], y[:, 0], moved)


def dent(distance: Array, radius_mm: float, half_mm: float) -> Array:
    """Height under a round indenter of a patch of half-width a: z'' = 1/R, then a steep decay."""
    edge = -(half_mm**2) / (2 * radius_mm)
    inside = edge - (half_mm**2 - distance**2) / (2 * radius_mm)
    outside = edge * np.exp(-2 * (distance - half_mm) / half_mm)
    return np.where(distance < half_mm, inside, outside)


AXIS = np.linspace(-10, 10, 201)
X, Y = np.meshgrid(AXIS, AXIS)


def test_a_ball_shades_blue_along_the_finger_and_red_and_green_across() -> None:
    """The logarithm of each channel's change, fitted to the slopes that the picture shows."""
    drawn, radius = renderer("blue"), 5.0
    cap = dent(np.hypot(X, Y), radius, 1.5)
    picture = [drawn.values(drawn.still[..., 0] * 0, s) for s in (None, pressed(cap, X, Y))]
    rest = drawn.sight.rest_mm
    inside = np.hypot(rest[..., 0], rest[..., 1]) < 1.2
    change = np.log(picture[1][inside] / picture[0][inside])
    slopes = np.column_stack([rest[inside] / radius, np.ones(inside.sum())])
    gains = np.linalg.lstsq(slopes, change, rcond=None)[0]
    along, across = gains[0], gains[1]
    # Red light shines from -y: what faces it falls towards +y. Blue comes from +x.
    assert across[0] < -0.6 < 0.6 < across[1]
    assert along[2] > 0.9
    assert np.all(np.abs([*along[:2], across[2]]) < 0.35 * np.abs([*across[:2], along[2]]).min())


@pytest.mark.slow
@pytest.mark.parametrize(("tip", "seen"), [("none", False), ("blue", True)])
def test_a_rod_across_the_finger_is_found_by_the_light_of_the_tip(tip: str, seen: bool) -> None:
    """The slopes of a rod that lies from side to side hardly change the light of two sides.

    Its depth shifts their light a little, so that a part of it may be found, not the rod.
    """
    drawn, radius, half = renderer(tip), 8.0, 1.0
    cap = dent(np.abs(X - 1.0), radius, half)
    rest, touched = drawn.frame(), drawn.frame(pressed(cap, X, Y))
    finder = PatchFinder(
        drawn.camera,
        rest.image,
        rest.centres_px,
        marker_radius_px=rest.diameter_px / 2,
        surface_mm=np.asarray(bundle(tip).mesh.surface_mm),
        indenter=parse_indenter(f"cylinder:{radius:g}"),
    )
    patch = finder.find(touched.image, touched.centres_px)
    if seen:
        assert patch is not None
        assert abs(patch.angle_deg) == pytest.approx(90, abs=2)
        assert patch.centre_mm[0] == pytest.approx(1.0, abs=0.1)
        assert patch.size_mm == pytest.approx(half, rel=0.2)
    elif patch is not None:
        assert patch.size_mm < 0.8 * half
        assert abs(patch.centre_mm[1]) > 5.0


def test_the_paths_of_the_tip_start_at_the_end_face() -> None:
    d = finger()
    paths = shown_paths(d)["paths"]
    starts = {c: [p["points_mm"][0] for p in paths if p["colour"] == c] for c in ("red", "blue")}
    assert all(x == pytest.approx(d["guide.distal_end_x_mm"]) for x, _, _ in starts["blue"])
    assert all(x < d["guide.distal_end_x_mm"] for x, _, _ in starts["red"])
    drawn = light_paths([(p["colour"], np.array(p["points_mm"])) for p in paths])
    assert [overlay.name for overlay in drawn] == ["light_red", "light_green", "light_blue"]
    two = shown_paths(finger(tip="none"))["paths"]
    assert paths[: len(two)] == two


@pytest.mark.slow
@pytest.mark.parametrize(("light", "tip"), [("red_green", "blue"), ("white", "white")])
def test_pictures_are_larger_by_those_of_the_tip(light: str, tip: str) -> None:
    d, two = finger(light, tip), finger(light, "none")
    heights = [
        [struct.unpack(">I", picture[20:24])[0] for picture in pictures]
        for pictures in (
            (paths_png(d), irradiance_png(d, study(light, tip))),
            (paths_png(two), irradiance_png(two, study(light, "none"))),
        )
    ]
    assert all(three > of_two for three, of_two in zip(*heights, strict=True))


def test_notes_tell_of_the_tip() -> None:
    for light, tip in (("red_green", "blue"), ("white", "white")):
        found = study(light, tip)
        notes = {n.title: n.text for n in light_notes(json.dumps(study_record(found)).encode())}
        note = notes["Light from the tip"]
        assert found.tip is not None
        assert f"{found.tip.over_sides:.2f} times" in note
        assert f"{found.light.slope_sensitivity(found.tip.colour, 'x').value:+.2f}" in note
    captions = [light_pictures(finger(tip=tip)) for tip in ("none", "blue")]
    assert captions[0].keys() == captions[1].keys()
    assert captions[0] != captions[1]
    record = json.dumps(study_record(study(tip="none"))).encode()
    assert "Light from the tip" not in {n.title for n in light_notes(record)}


def test_the_rule_on_the_reach_of_the_tips_light() -> None:
    """2 t cot(18.9 deg) for acrylic of 2.5 mm, less what lies before the gel."""
    d = finger()
    before = d["guide.distal_end_x_mm"] - d["design.gel.length_mm"] / 2
    found = check(d).of("led.tip_reach_mm")
    elevation = math.acos(1.41 / 1.4906)
    assert found.value == pytest.approx(2 * 2.5 / math.tan(elevation) - before)
    assert found.limit == pytest.approx(20.0 / 3)
    assert check(finger(tip="none")).of("led.tip_reach_mm").limit is None
    # Most of the light that enters the gel does so within that reach.
    light = study().light.maps[2].mean(axis=(0, 2))
    lit = math.ceil(len(light) * found.value / d["design.gel.length_mm"])
    assert light[-lit:].sum() > 0.75 * light.sum()


def test_built_fingers_vary_the_leds_of_the_tip() -> None:
    d, two = finger(), finger(tip="none")
    names = {cause.name for cause in causes(d)} - {cause.name for cause in causes(two)}
    assert names == {"tip_flux_percent"}
    errors = {cause.name: np.zeros(2) for cause in causes(d)}
    errors["tip_flux_percent"] = np.array([0.0, -10.0])
    found = margins(d, errors, "as_built")
    least = d["tolerance.least_light_ratio"]
    assert found["light@blue"] + least == pytest.approx([1.0, 0.9])
    assert found["light@red"] + least == pytest.approx([1.0, 1.0])


@pytest.mark.slow
def test_the_command_prints_the_third_light(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "three.yaml"
    text = MINI20.read_text(encoding="utf-8").replace("design:\n", "design:\n  leds: {tip: blue}\n")
    path.write_text(text, encoding="utf-8")
    given: tuple[str, ...] = ("light", str(path), "--no-pictures", "--rays", "4096")
    assert main([*given]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Light from the tip (blue)" in said
    assert "Blue: an exposure" in said
    assert main([*given, "--json"]) == 0
    record: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert [e["colour"] for e in record["exposures"]] == ["red", "green", "blue"]
    assert record["tip"]["over_sides"] > 0.3


@pytest.mark.slow
def test_the_bends_are_chosen_by_the_light_of_the_sides() -> None:
    ratios = []
    for tip in ("none", "blue"):
        content = spec("red_green", tip).model_dump()
        content["design"]["light_guide"]["bend_radius_ratio"] = "auto"
        ratios.append(derive(Spec.model_validate(content))["guide.bend_ratio"])
    assert ratios[0] == ratios[1]
