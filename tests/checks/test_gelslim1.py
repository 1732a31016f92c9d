"""The closed forms of GelSlim 1 against traced lines and against our own fold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gelslim1_forms import gelslim1_closed_form, gelslim1_length_mm
from rule_samples import smallest


def crossing(p: np.ndarray, u: np.ndarray, q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
    """Parameters of the crossing of the lines p + s u and q + t v."""
    s, t = np.linalg.solve(np.column_stack([u, -v]), q - p)
    return float(s), float(t)


@pytest.mark.parametrize(("mirror", "pitch"), [(20, 20), (25, 10), (28, 5), (30, 12), (20, 0)])
def test_closed_forms_agree_with_traced_lines(mirror: float, pitch: float) -> None:
    length, fov = 25.0, 41.4
    fold = gelslim1_closed_form(length_mm=length, mirror_deg=mirror, pitch_deg=pitch, fov_deg=fov)
    gamma = math.radians(90 - pitch - 2 * mirror)
    half, alpha = math.radians(fov / 2), math.radians(mirror)
    # Gel from (-L, 0) to (0, 0), where the mirror begins; marginal rays leave it downwards.
    near_dir = -np.array([math.sin(gamma - half), math.cos(gamma - half)])
    far_dir = -np.array([math.sin(gamma + half), math.cos(gamma + half)])
    near_edge, far_edge = np.array([-length, 0.0]), np.array([0.0, 0.0])
    slope = -np.array([math.cos(alpha), math.sin(alpha)])
    to_pinhole, far_ray = crossing(near_edge, near_dir, far_edge, far_dir)
    to_mirror, slant = crossing(near_edge, near_dir, far_edge, slope)
    assert fold.near_ray_mm == pytest.approx(to_pinhole)
    assert fold.far_ray_mm == pytest.approx(far_ray)
    assert fold.mirror_slant_mm == pytest.approx(slant)
    assert fold.mirror_height_mm == pytest.approx(slant * math.sin(alpha))
    assert fold.mirror_gap_mm == pytest.approx(to_pinhole - to_mirror)
    assert fold.mirror_behind_camera == (to_pinhole < to_mirror)


def test_published_length_is_that_of_the_fold() -> None:
    angles = {"mirror_deg": 28.0, "pitch_deg": 8.0, "fov_deg": 41.4}
    fold = gelslim1_closed_form(length_mm=25.0, **angles)
    depth = fold.far_ray_mm - fold.near_ray_mm
    assert gelslim1_length_mm(depth_mm=depth, **angles) == pytest.approx(25.0)


def test_the_documented_case_puts_the_mirror_behind_the_camera() -> None:
    level = gelslim1_closed_form(length_mm=25.0, mirror_deg=20, pitch_deg=0, fov_deg=41.4)
    assert level.mirror_behind_camera
    # The printed "h" is a plausible positive number all the same: nothing in it warns.
    assert level.mirror_slant_mm > 0
    looking_down = gelslim1_closed_form(length_mm=25.0, mirror_deg=20, pitch_deg=20, fov_deg=41.4)
    assert not looking_down.mirror_behind_camera


def test_our_solved_fold_stands_before_its_mirror_by_the_same_measure() -> None:
    d = smallest()
    fold = gelslim1_closed_form(
        length_mm=d["design.gel.length_mm"],
        mirror_deg=d["mirror.angle_deg"],
        pitch_deg=d["camera_pose.pitch_deg"],
        fov_deg=d["view.along_fov_deg"],
    )
    assert not fold.mirror_behind_camera


@pytest.mark.parametrize(
    ("angles", "word"),
    [
        ({"mirror_deg": 20.0, "pitch_deg": -60.0, "fov_deg": 41.4}, "misses"),
        ({"mirror_deg": 0.0, "pitch_deg": 10.0, "fov_deg": 41.4}, "0 to 90"),
        ({"mirror_deg": 20.0, "pitch_deg": 10.0, "fov_deg": 0.0}, "0 to 180"),
    ],
)
def test_angles_without_a_fold_are_refused(angles: dict[str, float], word: str) -> None:
    with pytest.raises(ValueError, match=word):
        gelslim1_closed_form(length_mm=25.0, **angles)
    with pytest.raises(ValueError, match="length_mm"):
        gelslim1_closed_form(length_mm=0.0, mirror_deg=20, pitch_deg=20, fov_deg=41)
