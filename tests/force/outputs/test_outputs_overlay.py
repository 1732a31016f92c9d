"""Overlay pictures: arrows where and as long as they should be, by counting coloured pixels."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
import output_samples as samples
import pytest
from camera_rig import finger_view
from scipy.interpolate import LinearNDInterpolator

from gelslim_core.errors import OutputError
from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.arrow_scale import (
    ArrowScale,
    Extent,
    LiveScale,
    extent,
    round_step,
    scale_for,
    scale_of_run,
)
from gelslim_force.outputs.legend import LEAST_HEIGHT_PX, ORANGE, RED, WIDTH_PX, YELLOW
from gelslim_force.outputs.overlay import Overlay, SurfaceView, write_overlay
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

BLACK = np.zeros((480, 640, 3), dtype=np.uint8)
SCALE = ArrowScale(2.0, 20.0, 0.2, 5.0, 5.0)
pytest.importorskip("cv2")


def coloured(picture: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    """(k, 2) x, y of the pixels within 40 levels of a colour."""
    near = np.abs(picture.astype(int) - colour).max(axis=2) < 40
    return np.argwhere(near)[:, ::-1]


def one_marker(position: tuple[float, float], motion: tuple[float, float]) -> FrameResult:
    moved = np.array([motion])
    tracks = Tracks(np.array([position]) + moved, moved, np.zeros(1, int), np.zeros(1, int))
    return FrameResult(index=0, time_s=0.0, tracks=tracks)


def test_a_motion_arrow_spans_gain_times_motion() -> None:
    overlay = Overlay((480, 640))
    picture = overlay.draw(BLACK, one_marker((200.0, 150.0), (30.0, -20.0)), SCALE)
    yellow = coloured(picture[:, :-WIDTH_PX], YELLOW)
    # From (200, 150) by gain 2: to (260, 110); pixel p of the frame is at 2 p + 1/2.
    start, tip = yellow[yellow[:, 0].argmin()], yellow[yellow[:, 0].argmax()]
    np.testing.assert_allclose(start, [400.5, 300.5], atol=3)
    np.testing.assert_allclose(tip, [520.5, 220.5], atol=3)


def test_a_force_arrow_follows_the_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    """One node alone carries shear; its arrow ends where the camera sees its end on the gel."""
    camera = finger_view()
    field = samples.force_field(0.0, (0.0, 0.0))
    node = int(np.argmin(np.hypot(*(field.points_mm[:, :2] - [2.0, -1.0]).T)))
    traction = np.zeros_like(field.traction_mpa)
    traction[node, :2] = [0.06, 0.09]
    field = dataclasses.replace(field, traction_mpa=traction)
    result = FrameResult(index=0, time_s=0.0, field=field)
    monkeypatch.setattr("gelslim_force.outputs.overlay._CELL_MM", 0.3)
    overlay = Overlay((480, 640), camera.project)
    red = coloured(overlay.draw(BLACK, result, SCALE)[:, :-WIDTH_PX], RED)
    ends = np.array([field.points_mm[node], field.points_mm[node] + 20.0 * traction[node]])
    seen = camera.project(ends) * overlay.zoom + (overlay.zoom - 1) / 2
    along = (seen[1] - seen[0]) / np.linalg.norm(seen[1] - seen[0])
    reach = red @ along
    np.testing.assert_allclose(red[reach.argmin()], seen[0], atol=4)
    # Perspective bends a long arrow a little against its linear picture.
    np.testing.assert_allclose(red[reach.argmax()], seen[1], atol=6)


def test_arrow_and_shade_against_the_camera_and_scipy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_force.outputs.overlay._CELL_MM", 0.3)
    camera = finger_view()
    view = SurfaceView(samples.NODES_MM, camera.project, (480, 640))
    rng = np.random.default_rng(2)
    traction = rng.normal(0, 1, samples.NODES_MM.shape)
    step = 1e-3 * traction * [1, 1, 0]
    found = view.arrows_px(traction, 1e-3)
    # Cells smaller than the nodes' pitch hold one node each, sorted by x and then y.
    order = np.lexsort((samples.NODES_MM[:, 1], samples.NODES_MM[:, 0]))
    exact = camera.project(samples.NODES_MM + step) - camera.project(samples.NODES_MM)
    np.testing.assert_allclose(found, exact[order], atol=2e-3 * np.abs(exact).max())
    smooth = samples.NODES_MM[:, 0] + 0.5 * samples.NODES_MM[:, 1] ** 2
    picture = view.spread(smooth)
    pixels = np.array([[320.0, 240.0], [250.0, 200.0], [400.0, 300.0]])
    truth = LinearNDInterpolator(camera.project(samples.NODES_MM), smooth)(pixels)
    there = [picture[int(y), int(x)] for x, y in pixels]
    np.testing.assert_allclose(there, truth, atol=0.25)
    assert picture[470, 5] == 0.0


def test_arrows_cover_what_the_field_needs() -> None:
    overlay = Overlay((480, 640), finger_view().project)
    picture = overlay.draw(np.full_like(BLACK, 120), samples.frame(3), SCALE)
    assert picture.shape == (960, 1280 + WIDTH_PX, 3)
    for colour in (YELLOW, RED):
        assert len(coloured(picture[:, :1280], colour)) > 2000


def test_unknown_normal_draws_shear_without_shade() -> None:
    overlay = Overlay((480, 640), finger_view().project)
    shaded = overlay.draw(np.full_like(BLACK, 120), samples.frame(1), SCALE)
    plain = overlay.draw(np.full_like(BLACK, 120), samples.frame(1, normal_known=False), SCALE)
    grey = (np.ptp(plain[:, :1280].astype(int), axis=2) < 6).sum()
    grey_shaded = (np.ptp(shaded[:, :1280].astype(int), axis=2) < 6).sum()
    assert grey - grey_shaded > 20_000
    assert len(coloured(plain[:, :1280], RED)) > 1000


def test_no_contact_draws_no_arrows() -> None:
    overlay = Overlay((480, 640), finger_view().project)
    result = samples.frame(0, depth_mm=0.0, shear_mm=(0.0, 0.0))
    picture = overlay.draw(BLACK, result, scale_of_run([result]))[:, :-WIDTH_PX]
    assert len(coloured(picture, YELLOW)) == 0
    assert len(coloured(picture, RED)) == 0


def test_lost_markers_stay_where_they_were_seen() -> None:
    overlay = Overlay((480, 640))
    seen = one_marker((100.0, 80.0), (0.0, 0.0))
    nowhere = np.full((1, 2), np.nan)
    lost = Tracks(nowhere, nowhere, np.array([int(MarkerStatus.LOST)]), np.array([-1]))
    later = dataclasses.replace(seen, index=1, tracks=lost)
    assert not overlay.draw(BLACK, later, SCALE)[:, :-WIDTH_PX].any()
    overlay.draw(BLACK, seen, SCALE)
    picture = overlay.draw(BLACK, later, SCALE)[:, :-WIDTH_PX]
    bright = np.argwhere(picture.max(axis=2) > 100)
    np.testing.assert_allclose(bright.mean(axis=0), [160.5, 200.5], atol=1)


def test_a_frame_that_could_not_be_read_has_its_problem_in_the_column() -> None:
    overlay = Overlay((200, 300))
    picture = overlay.draw(None, samples.unreadable(5), SCALE)
    assert picture.shape == (*overlay.size_px, 3) == (800, 1200 + WIDTH_PX, 3)
    assert len(coloured(picture, ORANGE)) > 100
    quiet = overlay.draw(np.zeros((5, 5, 3), np.uint8), FrameResult(index=5, time_s=0.0), SCALE)
    # The sign of a predicted marker in the key is orange too.
    assert len(coloured(picture, ORANGE)) > 2 * len(coloured(quiet, ORANGE))


def test_grey_frames_and_low_ones() -> None:
    overlay = Overlay((60, 120))
    picture = overlay.draw(np.full((60, 120), 200, np.uint8), samples.unreadable(0), SCALE)
    assert picture.shape == (LEAST_HEIGHT_PX, 8 * 120 + WIDTH_PX, 3)
    np.testing.assert_array_equal(picture[50, 60], [160, 160, 160])


def test_the_given_frame_is_left_alone() -> None:
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    before = image.copy()
    overlay = Overlay((480, 640), finger_view().project)
    overlay.draw(image, samples.frame(1), SCALE)
    np.testing.assert_array_equal(image, before)


def test_scales_are_round_and_hold_for_a_run() -> None:
    results = [samples.frame(k, depth_mm=0.1 * k) for k in range(1, 8)]
    scale = scale_of_run(results)
    largest = max(np.hypot(*r.tracks.displacement_px[r.tracks.tracked].T).max() for r in results)
    assert 24 / 2.5 / 1.5 < scale.motion_gain * largest < 24 * 1.5
    for value in dataclasses.astuple(scale):
        assert f"{value:.0e}"[0] in "125"
    assert scale_for(Extent()).motion_gain == 10.0
    assert scale_of_run([]) == scale_for(Extent())
    assert [round_step(v) for v in (1.0, 1.99, 2.0, 4.9, 0.05, 730.0)] == [1, 1, 2, 2, 0.05, 500]
    with pytest.raises(ValueError, match="motion_gain = nan"):
        ArrowScale(float("nan"), 1.0, 1.0, 1.0, 1.0)


def test_live_scale_steps_once_and_does_not_flicker() -> None:
    rng = np.random.default_rng(3)
    live = LiveScale(extent(samples.frame(0, depth_mm=0.6)))
    depths = [*rng.uniform(0.1, 0.7, 20), 3.0, *rng.uniform(0.1, 3.0, 20)]
    scales = [live.scale(samples.frame(k, depth_mm=d)) for k, d in enumerate(depths)]
    changes = [k for k in range(1, len(scales)) if scales[k] != scales[k - 1]]
    assert changes == [20]
    assert scales[-1].pressure_mpa > scales[0].pressure_mpa


def test_files(tmp_path: Path) -> None:
    pillow = pytest.importorskip("PIL.Image")
    overlay = Overlay((480, 640))
    picture = overlay.draw(BLACK, samples.frame(1), SCALE)
    path = tmp_path / "ein Bild, größer.png"
    write_overlay(path, picture)
    np.testing.assert_array_equal(np.asarray(pillow.open(path)), picture)
    write_overlay(tmp_path / "a.jpg", picture)
    back = np.asarray(pillow.open(tmp_path / "a.jpg")).astype(float)
    assert np.abs(back - picture).mean() < 3
    with pytest.raises(OutputError, match=r"\.bmp"):
        write_overlay(tmp_path / "a.bmp", picture)
    with pytest.raises(OutputError, match=r"a\.png"):
        write_overlay(tmp_path / "none" / "a.png", picture)


def test_without_libraries_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    overlay = Overlay((480, 640))
    with pytest.raises(MissingLibraryError) as refused:
        overlay.draw(BLACK, samples.frame(1), SCALE)
    assert (refused.value.name, refused.value.extra) == ("cv2", "vision")


def test_words_of_the_scales_are_of_what_is_drawn() -> None:
    """Arrows as long as their words say, and the pressure of the full shade, in kPa."""
    from gelslim_force.outputs.legend import _scales

    class RecordedText:
        words: ClassVar[list[str]] = []

        def text(self, position: object, text: str, *_: object) -> None:
            self.words.append(text)

        def line(self, *_: object) -> None: ...

        def polygon(self, *_: object) -> None: ...

    _scales(RecordedText(), SCALE, 1.0, 10.0, 50.0)  # type: ignore[arg-type]
    assert "0 to 200 kPa pressure" in RecordedText.words
    # 20 mm per MPa at 10 px/mm: an arrow of 90 px is 450 kPa, and a round value is below it.
    (shear,) = (w for w in RecordedText.words if w.endswith("kPa shear"))
    assert 0.3 * 450 < float(shear.split()[0]) <= 450
