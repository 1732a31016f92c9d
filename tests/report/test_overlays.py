"""What pictures show beside the parts: dots on the gel, the camera's view, paths of light."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import report_sample

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.geometry.overlay import (
    LIFT_MM,
    RAY_RADIUS_MM,
    Overlay,
    camera_view,
    light_paths,
    printed_dots,
)
from gelslim_cad.light.figures import shown_paths
from gelslim_cad.report.render import render_report
from gelslim_cad.sensor import marker_grid
from gelslim_cad.spec.reader import read_spec

D = derive(read_spec(Path(__file__).parents[2] / "designs" / "gelslim2.yaml").spec)


def triangle_areas(overlay: Overlay) -> np.ndarray:
    a, b, c = (overlay.vertices_mm[overlay.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def dots() -> Overlay:
    grid = marker_grid(D)
    return printed_dots(D, grid.positions_mm, grid.diameter_mm)


def test_each_dot_is_a_disc_of_its_size_on_the_gel() -> None:
    grid = marker_grid(D)
    areas = triangle_areas(dots()).reshape(len(grid), -1).sum(axis=1)
    # A regular polygon of 16 corners has 0.9745 of the area of its circle.
    assert areas == pytest.approx(0.97450 * np.pi * grid.diameter_mm**2 / 4, rel=1e-4)
    middles = dots().vertices_mm.reshape(len(grid), -1, 3).mean(axis=1)
    assert (
        np.abs(middles - np.column_stack([grid.positions_mm, np.full(len(grid), LIFT_MM)])).max()
        < 1e-9
    )


def test_the_view_is_what_the_camera_sees_of_the_gel() -> None:
    view = camera_view(D)
    pinhole, mirror, window = view.vertices_mm[0], view.vertices_mm[1:5], view.vertices_mm[5:]
    camera = virtual_camera(D)
    assert window[:, 2] == pytest.approx(camera.window_bottom_z_mm)
    # Mirrored at the fold mirror, the pinhole is the virtual camera (Householder).
    u, v = mirror[1] - mirror[0], mirror[2] - mirror[0]
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    image = pinhole - 2 * ((pinhole - mirror[0]) @ normal) * normal
    assert image == pytest.approx(camera.position_mm, abs=1e-6)
    for near, far in zip(mirror, window, strict=True):
        ray = (far - image) / np.linalg.norm(far - image)
        assert np.linalg.norm(np.cross(near - image, ray)) < 1e-6


def test_light_paths_start_at_the_leds_and_stay_in_guide_and_gel() -> None:
    paths = [(p["colour"], np.array(p["points_mm"])) for p in shown_paths(D)["paths"]]
    drawn = light_paths(paths)
    assert {o.name for o in drawn} == {"light_red", "light_green"}
    for colour, points in paths:
        assert points[0, 2] == pytest.approx(D["guide.leg_end_z_mm"], abs=0.3)
        assert points[0, 1] * (-1 if colour == "red" else 1) > D["design.gel.width_mm"] / 2
        assert points[:, 2].max() <= 1e-6
    length = sum(float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum()) for _, p in paths)
    # Three rectangles round the ray, each √3 radii wide.
    area = sum(float(triangle_areas(o).sum()) for o in drawn)
    assert area == pytest.approx(3 * np.sqrt(3) * RAY_RADIUS_MM * length, rel=1e-2)


def test_an_overlay_survives_its_way_through_plain_values() -> None:
    view = camera_view(D)
    again = Overlay.unpacked(view.packed())
    assert np.abs(again.vertices_mm - view.vertices_mm).max() < 1e-6
    assert (again.faces == view.faces).all()
    assert (again.name, again.colour, again.shown) == (view.name, view.colour, view.shown)


def test_the_page_carries_overlays_as_data() -> None:
    from dataclasses import replace

    shown = (camera_view(D).record({}), dots().record({"gel_pad": (0.0, 0.0, 9.0)}))
    data = replace(report_sample.report(), overlays=shown)
    page = render_report(data).decode()
    (found,) = re.findall(r'<script type="application/json" id="overlays">(.*?)</script>', page)
    view, printed = json.loads(found)
    assert view["name"] == "camera_view"
    assert view["shown"] is False
    assert len(view["positions"]) == 27
    assert max(view["indices"]) == 8
    assert (view["explode"], printed["explode"]) == ([0, 0, 0], [0, 0, 9])
    assert view["colour"][3] < 1 == printed["colour"][3]
