"""The forward model against the design's dimensions and against an independent traced lens."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import root
from tolerance_samples import NAMES, drawn, exact, spec

from bench.models.thin_lens import ThinLens
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.tolerance.assembly import assembled, border_points, frame_mm
from gelslim_cad.tolerance.built import as_dropped_in, built, play_left
from gelslim_cad.tolerance.causes import causes, no_errors
from gelslim_cad.tolerance.margins import margins
from gelslim_cad.tolerance.picture import image_distances_mm, on_sensor, rays
from gelslim_cad.tolerance.yields import ALL, yield_of

NO_PLAY = {"design.housing.camera_play_mm": 0.0, "design.housing.camera_seat": "loose"}


@pytest.mark.parametrize("k1", [-0.12, pytest.param(0.12, marks=pytest.mark.slow)])
def test_a_distorting_lens_counts_as_in_the_rules(k1: float) -> None:
    """Barrel and pincushion; the rules also look between corners and middles of the edges."""
    d = derive(spec("mini20", camera__distortion={"model": "brown", "k1": k1}))
    found = {place: float(v[0]) for place, v in margins(d, no_errors(d), "as_built").items()}
    along = min(found["coverage.along@near"], found["coverage.along@far"])
    across = min(found["coverage.across@left"], found["coverage.across@right"])
    assert along == pytest.approx(1 - d["view.along_use"], abs=1e-6)
    assert across == pytest.approx(1 - d["view.across_use"], abs=1e-3)
    plain = derive(spec("mini20"))
    assert abs(across - (1 - plain["view.across_use"])) > 0.005


@pytest.mark.parametrize("name", NAMES)
def test_a_finger_without_errors_has_the_margins_of_its_dimensions(name: str) -> None:
    d = derive(spec(name))
    found = {place: float(v[0]) for place, v in margins(d, no_errors(d), "as_built").items()}
    diameter = d["design.markers.diameter_mm"]
    along = min(found["coverage.along@near"], found["coverage.along@far"])
    across = [found[f"coverage.across@{side}"] for side in ("left", "right")]
    assert along == pytest.approx(1 - d["view.along_use"], abs=1e-9)
    assert across == pytest.approx([1 - d["view.across_use"]] * 2, abs=1e-9)
    for edge in ("near", "far"):
        blur = d.value(f"view.{edge}_blur_mm") / diameter
        assert found[f"blur@{edge}"] == pytest.approx(0.5 - blur, abs=1e-9)
    px = min(d["view.marker_along_px"], d["view.marker_across_px"])
    least = 0.9 * d["design.optics.min_px_per_marker"]
    assert min(found["marker.px@near"], found["marker.px@far"]) == pytest.approx(
        px - least, abs=1e-5
    )
    keystone = max(d["view.keystone"], 1 / d["view.keystone"])
    assert found["keystone@middle"] == pytest.approx(
        d["design.optics.max_keystone"] / 0.9 - keystone, abs=1e-9
    )
    # The glass is as long and wide as the view plus its border.
    border = d["design.mirror.border_mm"]
    for side in ("upper", "lower", "left", "right"):
        assert found[f"mirror.covers@{side}"] == pytest.approx(border, abs=1e-6)
    assert found["calibration@worst"] == pytest.approx(5.0)


def turned(vector: NDArray, axis: NDArray, angle_rad: float) -> NDArray:
    """Rodrigues' formula."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return vector * c + np.cross(axis, vector) * s + axis * (axis @ vector) * (1 - c)


def traced(d: Dimensions, e: dict[str, float], left: float) -> ThinLens:
    """A lens with the errors of one finger, its gel's outer surface at z = 0."""
    lens = ThinLens.as_built(d, extension_mm=d["view.lens_extension_mm"])
    focal = lens.focal_mm * (1 + e["focal_percent"] / 100)
    target = d["view.focus_mm"] - e["pupil_mm"]
    sensor = focal * target / (target - focal) + e["extension_mm"]
    # One turn about the axis whose components are the three tilts.
    tilt = np.radians([e[f"rock_{n}_deg"] + e[f"seat_{n}_deg"] for n in ("pitch", "yaw", "roll")])
    rotation = -tilt[0] * lens.right + tilt[1] * lens.down + tilt[2] * lens.forward
    angle = float(np.linalg.norm(rotation))
    axes = [turned(v, rotation / angle, angle) for v in (lens.right, lens.down, lens.forward)]
    behind = d["camera_pose.face_mm"] + d["camera.module_depth_mm"] / 2
    module = lens.centre - behind * lens.forward
    module = module + np.array([e["clamp_x_mm"], e["clamp_y_mm"], e["clamp_z_mm"]])
    for name, axis in (("right", lens.right), ("down", lens.down), ("forward", lens.forward)):
        module = module + left * e[f"play_{name}_mm"] * axis
    more = sensor - focal - d["view.lens_extension_mm"]
    centre = module + (behind + e["pupil_mm"] + more) * axes[2]
    along = np.array([-lens.mirror_normal[2], 0.0, lens.mirror_normal[0]]) * -1
    normal = (
        lens.mirror_normal
        + np.tan(np.radians(e["mirror_slope_deg"])) * along
        + np.tan(np.radians(e["mirror_roll_deg"])) * np.array([0.0, 1.0, 0.0])
    )
    ends = [np.array([d.value(f"mirror.{k}_x_mm"), 0, d.value(f"mirror.{k}_z_mm")]) for k in
            ("lower", "upper")]  # fmt: skip
    point = np.mean(ends, axis=0) + e["mirror_stop_mm"] * along
    point = point + (e["mirror_seat_mm"] + e["mirror_glass_mm"]) * lens.mirror_normal
    up = np.array([0.0, 0.0, e["body_z_mm"] - e["gel_mm"]])
    gel = d["stack.gel_total_mm"] + e["gel_mm"]
    acrylic = d["design.light_guide.thickness_mm"] + e["acrylic_mm"]
    (_, n_acrylic), (_, n_gel) = lens.layers
    return replace(
        lens,
        centre=centre + up,
        right=axes[0],
        down=axes[1],
        forward=axes[2],
        focal_mm=focal,
        sensor_mm=sensor,
        aperture_mm=focal / d["camera.f_number"],
        mirror_point=point + up,
        mirror_normal=normal / np.linalg.norm(normal),
        layers=((-gel - acrylic, n_acrylic), (-gel, n_gel)),
    )


def seen(lens: ThinLens, point: NDArray, guess: NDArray) -> NDArray:
    """The pixel whose chief ray meets a point of the gel."""
    found = root(
        lambda pixel: lens.on_gel(pixel[None], np.zeros((1, 2)))[0] - point, guess, tol=1e-12
    )
    assert np.abs(found.fun).max() < 1e-8
    return np.asarray(found.x)


@pytest.mark.parametrize("name", ["gelslim2", "thin"])
def test_pictures_of_random_fingers_are_those_of_a_traced_lens(name: str) -> None:
    d = derive(spec(name))
    count = 6
    e = drawn({c.name: (c.distribution, c.spread) for c in causes(d)}, count, seed=3)
    finger = built(d, e, as_dropped_in(d, e))
    x, y = border_points(d, e)
    ray = rays(finger, x, y)
    u, v = on_sensor(finger, ray)
    s = finger.focus_mm[:, None]
    off = [np.abs(z - s) / z for z in image_distances_mm(finger, ray)]
    blurs = (finger.aperture_mm * finger.image_mm / finger.focus_mm)[:, None] * np.maximum(*off)
    left, pitch = play_left(d, e), d["view.pixel_pitch_mm"]
    found = margins(d, e, "as_built")
    circle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    rim = np.stack([np.cos(circle), np.sin(circle)], axis=1)
    for k in range(count):
        lens = traced(d, {n: float(value[k]) for n, value in e.items()}, float(left[k]))
        middle = (np.array(lens.size_px) - 1) / 2
        on_mirror = []
        for m in range(x.shape[1]):
            sensor = np.array([u[k, m], v[k, m]]) - finger.principal_mm[k]
            pixel = seen(lens, np.array([x[k, m], y[k, m]]), middle + sensor / pitch)
            assert (pixel - middle) * pitch == pytest.approx(sensor, abs=1e-7)
            across, along = (pixel - middle) * pitch
            chief = lens.forward * lens.sensor_mm + lens.right * across + lens.down * along
            away = (lens.mirror_point - lens.centre) @ lens.mirror_normal
            met = lens.centre + chief * (away / (chief @ lens.mirror_normal))
            on_mirror.append(met - lens.mirror_point)
            rim_mm = lens.on_gel(np.broadcast_to(pixel, rim.shape), rim)
            steps = [
                seen(lens, np.array([x[k, m], y[k, m]]) + sign * h, pixel)
                for h in 0.05 * np.eye(2)
                for sign in (1, -1)
            ]
            per_mm = np.array([steps[0] - steps[1], steps[2] - steps[3]]) / 0.1
            width = np.ptp((rim_mm - rim_mm.mean(axis=0)) @ per_mm @ rim.T, axis=0).max() * pitch
            # In the picture A v |Z - s| / (Z s), by the image that is less sharp.
            assert width == pytest.approx(float(blurs[k, m]), rel=0.05, abs=2e-4)
        slope = np.radians(d["mirror.angle_deg"])
        up = np.array(on_mirror) @ np.array([np.cos(slope), 0.0, np.sin(slope)])
        side = np.array(on_mirror)[:, 1]
        half_length, half_width = d["mirror.length_mm"] / 2, d["mirror.width_mm"] / 2
        room = (half_length - up.max(), half_length + up.min())
        room = (*room, half_width + side.min(), half_width - side.max())
        for place, left_over in zip(("upper", "lower", "left", "right"), room, strict=True):
            assert found[f"mirror.covers@{place}"][k] == pytest.approx(left_over, abs=1e-6)


@pytest.mark.parametrize("seat", ["preloaded", "loose"])
def test_an_adjusted_camera_sees_the_gel_in_its_frame(seat: str) -> None:
    """Tilts and shifts that the play reaches are gone; what it does not reach stays."""
    few = {"tolerance.alignment_px": 0.0, "tolerance.print_flatness_mm": 0.01}
    few["design.housing.camera_seat"] = seat
    d = derive(spec("gelslim2", **few))
    e = drawn({c.name: (c.distribution, c.spread) for c in causes(d)}, 200, seed=4)
    finger = assembled(d, e, "adjusted")
    u, v = on_sensor(finger, rays(finger, *border_points(d, e)))
    aim = frame_mm(d)
    off = [(w.max(axis=1) + w.min(axis=1)) / 2 - a for w, a in zip((u, v), aim, strict=True)]
    pixel = d["view.pixel_pitch_mm"]
    reached = np.abs(np.concatenate(off)) / pixel < 0.1
    assert reached.mean() > 0.95
    level = (v[:, 5] - v[:, 4]) / pixel
    assert np.mean(np.abs(level) < 0.5) > 0.95
    stuck = derive(spec("gelslim2", **few | NO_PLAY))
    e = {**e, **{c.name: np.zeros(200) for c in causes(stuck) if c.spread == 0}}
    assert stuck["clamp.tilt_deg"] == 0
    as_built, adjusted = (assembled(stuck, e, s) for s in ("as_built", "adjusted"))
    assert adjusted.axes == pytest.approx(as_built.axes)


def test_focus_of_an_adjusted_lens_blurs_nearest_and_farthest_image_alike() -> None:
    d = derive(
        exact("mini20", tolerance__acrylic_measured_mm=0.5, tolerance__entrance_pupil_mm=0.5)
    )
    e = drawn({c.name: (c.distribution, c.spread) for c in causes(d)}, 50, seed=5)
    finger = assembled(d, e, "adjusted")
    sagittal, tangential = image_distances_mm(finger, rays(finger, *border_points(d, e)))
    least, most = tangential.min(axis=1), sagittal.max(axis=1)
    s = finger.focus_mm
    assert (s - least) / least == pytest.approx((most - s) / most, rel=1e-3)


def test_an_led_beside_a_thin_leg_loses_its_light() -> None:
    """A package of 2 mm, 0.5 mm off the middle of a leg of 2.5 mm, has 1.75 mm before it."""
    d = derive(exact("gelslim2"))
    e = {**no_errors(d, 3), "led_mm": np.array([0.0, 0.5, 0.0])}
    e["acrylic_mm"] = np.array([0.0, 0.0, -1.0])
    e["left_flux_percent"] = np.array([-10.0, 0.0, 0.0])
    found = margins(d, e, "as_built")
    assert found["light@red"] + 0.7 == pytest.approx([0.9, 1.75 / 2, 1.5 / 2])
    assert found["light@green"] + 0.7 == pytest.approx([1.0, 1.75 / 2, 1.5 / 2])


def test_calibration_adds_a_tilt_and_an_offset_of_the_lens() -> None:
    """Both shift the picture: its tolerances are 1 degree and 0.2 % of the picture's width."""
    d = derive(exact("gelslim2"))
    v = d["view.image_distance_mm"]
    e = {**no_errors(d, 3), "rock_yaw_deg": np.array([2.0, 0.0, 2.0])}
    shift = v * np.tan(np.radians(2.0))
    e["centre_u_mm"] = np.array([0.0, shift, shift])
    one = np.hypot(np.radians(1.0), 0.002 * 640 * d["view.pixel_pitch_mm"] / v)
    expected = 5 - np.radians(2.0) / one
    found = margins(d, e, "as_built")["calibration@worst"]
    assert found[:2] == pytest.approx([expected] * 2, abs=5e-3)
    # Together they cancel; what stays is how far the camera's turn has moved its pupil.
    behind = d["camera_pose.face_mm"] + d["camera.module_depth_mm"] / 2
    assert found[2] == pytest.approx(5 - behind * np.sin(np.radians(2.0)) / 0.4, abs=5e-3)


def test_points_that_err_alone_tilt_the_camera_as_the_cause_says() -> None:
    """A plane through three points of random heights, against the tilts that are drawn."""
    d = derive(spec("gelslim2"))
    assert d["clamp.preloaded"] == 1
    rng = np.random.default_rng(8)
    e, count = d["clamp.point_error_mm"], 200_000
    height, radius, play = d["camera.module_height_mm"], d["camera.lens_diameter_mm"] / 2, 0.2
    low, high = -height / 2 + 0.5, radius - 0.5
    across = (radius + play + d["camera.module_width_mm"] / 2) / 2
    points = np.array([[-across, low], [-across, high], [across, (low + high) / 2]])
    design = np.column_stack([points, np.ones(3)])
    slopes = np.linalg.solve(design, rng.uniform(-e, e, (3, count)))
    found = {c.name: c for c in causes(d)}
    pitch, yaw = np.degrees(np.arctan(slopes[1])), np.degrees(np.arctan(slopes[0]))
    assert np.std(pitch) == pytest.approx(found["rock_pitch_deg"].deviation, rel=0.01)
    assert np.abs(pitch).max() == pytest.approx(found["rock_pitch_deg"].spread, rel=0.01)
    # The third point errs against the mean of two, so that the yaw is less than is drawn.
    assert np.abs(yaw).max() <= found["rock_yaw_deg"].spread
    assert np.std(yaw) == pytest.approx(found["rock_yaw_deg"].deviation * np.sqrt(0.75), rel=0.01)


def test_a_seat_keeps_more_fingers_than_a_loose_clamp() -> None:
    shares = {
        seat: yield_of(derive(spec("gelslim2", design__housing__camera_seat=seat)), 1024, 5)[ALL]
        for seat in ("loose", "preloaded")
    }
    assert shares["preloaded"].share > 2 * shares["loose"].share
