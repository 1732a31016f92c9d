"""Distortion of the spec: closed forms, limits, and OpenCV's picture of the gel's border."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from fold_samples import shipped
from pydantic import ValidationError
from shipped_fingers import varied

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.optics import lens_distortion, virtual_camera
from gelslim_cad.spec import Spec
from gelslim_cad.spec.distortion import k1_of_tv
from gelslim_optics.camera.lens_distortion import LensDistortion

LENSES: dict[str, dict[str, Any]] = {
    "brown": {"k1": -0.3, "k2": 0.1, "k3": -0.02, "p1": 8e-4, "p2": -5e-4},
    "pincushion": {"k1": 0.2},
    "moustache": {"k1": 0.2, "k2": -0.3},
    "wide": {"model": "kannala_brandt", "k1": -0.04, "k2": 0.02, "k3": 0.01, "k4": -0.003},
}
WIDTH, HEIGHT, FOCAL = (shipped("mini20").model_dump()["camera"][n] for n in (
    "sensor_width_mm", "sensor_height_mm", "focal_length_mm"))  # fmt: skip


def mini20(**distortion: Any) -> Spec:
    return varied(shipped("mini20"), {f"camera.distortion.{k}": v for k, v in distortion.items()})


def with_camera(distortion: dict[str, Any], **camera: Any) -> Spec:
    changes = {f"camera.{name}": value for name, value in camera.items()}
    return varied(mini20(**distortion), changes)


def border(d: Dimensions, count: int = 2001) -> np.ndarray:
    """Points (n, 3) all around the gel."""
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    t = np.linspace(-1, 1, count)
    sides = [np.column_stack([0 * t + s * x, t * y, 0 * t]) for s in (-1, 1)]
    return np.vstack(sides + [np.column_stack([t * x, 0 * t + s * y, 0 * t]) for s in (-1, 1)])


@pytest.mark.parametrize("name", LENSES)
def test_the_gel_fills_what_opencv_draws_of_it(name: str) -> None:
    """The outermost point of the border, by another program's distortion."""
    cv2 = pytest.importorskip("cv2")
    d = derive(mini20(**LENSES[name]))
    camera, lens = virtual_camera(d), LENSES[name]
    rays = camera.air_directions(border(d)) @ camera.axes.T
    matrix, none = np.diag([camera.focal_px, camera.focal_px, 1.0]), np.zeros(3)
    if "model" in lens:
        radial = np.array([lens[f"k{n}"] for n in (1, 2, 3, 4)])
        drawn, _ = cv2.fisheye.projectPoints(rays[:, None], none, none, matrix, radial)
    else:
        given = np.array([lens.get(n, 0.0) for n in ("k1", "k2", "p1", "p2", "k3")])
        drawn, _ = cv2.projectPoints(rays, none, none, matrix, given)
    reach = np.abs(drawn.reshape(-1, 2)).max(axis=0)
    half = np.array([camera.image_width_px, camera.image_height_px]) / 2
    expected = np.array([d["view.across_use"], d["view.along_use"]]) * half
    np.testing.assert_allclose(reach, expected, atol=2e-3)
    np.testing.assert_allclose(
        camera.project(border(d)) - camera.principal_px, drawn[:, 0], atol=1e-9
    )


@pytest.mark.parametrize("name", LENSES)
def test_pixels_per_marker_are_those_of_the_picture(name: str) -> None:
    """Width and height of a small marker at the edges' middles and corners, drawn as the lens does.

    The rule takes the ideal scale of a corner for that of its edge's middle: within 5 %.
    """
    d = derive(mini20(**LENSES[name]))
    camera, x, y = virtual_camera(d), d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    for points, within in (([(-x, 0.0), (x, 0.0)], 1e-2), ([(-x, y), (x, y)], 5e-2)):
        at = np.column_stack([points, np.zeros(len(points))])
        sides = np.hypot(*np.moveaxis(camera.jacobian(at), 1, 0)) * d["design.markers.diameter_mm"]
        along, across = sides.min(axis=0)
        assert along >= d["view.marker_along_px"] * (1 - within)
        assert across >= d["view.marker_across_px"] * (1 - within)


def test_the_k1_of_a_tv_distortion_bends_a_rectangle_by_it() -> None:
    for percent, x, y in ((-5.0, 0.5, 0.375), (2.0, 0.5, 0.375), (-12.0, 0.9, 0.6)):
        lens = LensDistortion(k1=float(k1_of_tv(percent, x, y)))
        side, middle = lens.distort([[x, y], [0.0, y]])[:, 1]
        assert 100 * (side - middle) / middle == pytest.approx(percent, rel=1e-12)
        # To first order it is the coefficient times the square of the half side.
        assert lens.k1 == pytest.approx(percent / 100 / x**2, rel=0.1)


def test_a_tv_distortion_holds_at_the_field_of_view_of_the_sheet() -> None:
    at = 40.0
    image = FOCAL * at / (at - FOCAL)
    d = derive(with_camera({"tv_percent": -3.0}, field_of_view_at_mm=at))
    assert lens_distortion(d).k1 == pytest.approx(
        float(k1_of_tv(-3.0, WIDTH / 2 / image, HEIGHT / 2 / image)), rel=1e-12
    )


@pytest.mark.slow
def test_an_f_theta_lens_has_the_field_of_view_of_its_arc() -> None:
    """Sensor width = 2 f θ: the angle of the sheet is that of the arc, not of the tangent."""
    focal, wide = 2.0, {"model": "kannala_brandt"}
    sheet = {
        "focal_length_mm": focal,
        "horizontal_fov_deg": math.degrees(WIDTH / focal),
        "vertical_fov_deg": math.degrees(HEIGHT / focal),
    }
    d = derive(with_camera(wide, **sheet))
    v = d["view.image_distance_mm"]
    assert d["view.across_fov_deg"] == pytest.approx(math.degrees(WIDTH / v), rel=1e-12)
    assert d["view.along_fov_deg"] == pytest.approx(math.degrees(HEIGHT / v), rel=1e-12)
    assert d["view.sensor_across_mm"] == pytest.approx(WIDTH, rel=1e-12)
    with pytest.raises(ValidationError):
        with_camera({}, **sheet)


def test_a_lens_focused_inside_draws_its_field_of_view_on_the_sensor() -> None:
    half = math.radians(35)
    d = derive(
        with_camera(
            {"model": "kannala_brandt", "k1": -0.03},
            focusing="internal",
            horizontal_fov_deg=math.degrees(2 * half),
            field_of_view_at_mm=30.0,
        )
    )
    drawn = half - 0.03 * half**3
    assert d["view.image_distance_mm"] == pytest.approx(WIDTH / 2 / drawn, rel=1e-12)
    assert d["view.across_fov_deg"] == pytest.approx(math.degrees(2 * half), rel=1e-12)


@pytest.mark.parametrize("model", ["brown", "kannala_brandt"])
def test_a_lens_that_folds_the_picture_within_the_sensor_is_refused(model: str) -> None:
    """r + k1 r³ turns back at 2/3 / sqrt(-3 k1), in the tangent or in the angle."""
    corner = math.hypot(WIDTH, HEIGHT) / 2 / FOCAL
    turns_at_corner = -((2 / 3 / corner) ** 2) / 3
    mini20(model=model, k1=0.999 * turns_at_corner)
    with pytest.raises(ValidationError) as raised:
        mini20(model=model, k1=1.001 * turns_at_corner)
    (error,) = raised.value.errors()
    assert error["ctx"]["error"].field == "distortion.k1"


def test_an_f_theta_sensor_beyond_the_half_sphere_is_refused() -> None:
    """No ray at more than 90° from the axis reaches a flat gel."""
    with pytest.raises(ValidationError):
        with_camera({"model": "kannala_brandt"}, focal_length_mm=1.4)
    with_camera({"model": "kannala_brandt"}, focal_length_mm=1.5)


@pytest.mark.parametrize(
    "wrong", [{"model": "kannala_brandt", "p1": 1e-3}, {"k4": 0.1}, {"tv_percent": 1.0, "k2": 0.1}]
)
def test_coefficients_of_another_model_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        mini20(**wrong)
