"""Real sensors from one picture to tangential motion and a contact region, where they are at hand.

No design of these sensors is published. Size of the gel and pitch are plain values that fit the
pictures, so that lengths and the size of forces are not tested, but what the picture itself shows:
dots, lattice, where the gel moves, and where it is touched.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_real_frames import FRAMES, PRESSES, picture
from test_real_patches import SEEN

from gelslim_core.yaml.reader import load_bytes
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.error import ImportSensorError
from gelslim_force.imported.importer import ImportedSensor, import_sensor
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import open_sensor

pytestmark = pytest.mark.slow


def described(reference: str, gel: tuple[float, float, float], pitch: float, **view: object):
    blocks = {
        "format": "gelslim-sensor/1",
        "name": "real",
        "gel": dict(zip(("length_mm", "width_mm", "thickness_mm"), gel, strict=True)),
        "markers": {"pitch_mm": pitch},
        "view": {"reference": reference, **view},
    }
    return load_bytes("real", json.dumps(blocks).encode(), SensorDescription)


def real(reference: str, gel: tuple[float, float, float], pitch: float, **view: object):
    picture(reference)
    loaded = described(reference, gel, pitch, **view)
    return import_sensor(loaded.model, FRAMES, frozenset(loaded.defaulted), ladder=False)


@pytest.fixture(scope="module")
def gelslim3() -> ImportedSensor:
    return real("gelslim3/reference.jpg", (27.0, 20.2, 3.0), 1.35)


@pytest.fixture(scope="module")
def pipeline(gelslim3: ImportedSensor) -> ForcePipeline:
    return open_sensor(gelslim3.bundle, calibration=gelslim3.calibration)


def off_lattice_px(made: ImportedSensor) -> float:
    return float(np.median(np.hypot(*made.calibration.residual_px.T)))


def test_gelslim3_is_imported(gelslim3: ImportedSensor) -> None:
    """Double dots before a lens of strong distortion: 19 x 14, of which one column is cut."""
    assert len(gelslim3.calibration) >= 245
    assert gelslim3.calibration.grid.lattice_shape == (18, 14)
    assert off_lattice_px(gelslim3) < 1.1
    told = gelslim3.bundle.imported
    assert told is not None
    assert len(told.missing) >= 4
    assert gelslim3.calibration.camera.project(gelslim3.bundle.mesh.surface_mm).shape[1] == 2


def pressed(pipeline: ForcePipeline, name: str) -> FrameResult:
    """The press after the untouched gel."""
    pipeline.reset()
    pipeline.process(picture("gelslim3/reference.jpg"))
    return pipeline.process(picture(f"gelslim3/{name}.jpg"))


@pytest.mark.parametrize("name", PRESSES)
def test_gelslim3_moves_where_the_ball_is(pipeline: ForcePipeline, name: str) -> None:
    x, y, half = SEEN[name]
    motion = pressed(pipeline, name).marker_displacement_mm
    assert motion is not None
    rest_px = pipeline.calibration.reference.positions_px
    size = np.hypot(*motion[:, :2].T)
    away = np.hypot(*(rest_px - [x, y]).T)
    assert np.nanmax(size[away < half]) > 0.2
    assert np.hypot(*(rest_px[np.nanargmax(size)] - [x, y])) < half
    far = away > 2.5 * half
    assert far.sum() > 100
    assert np.nanmedian(size[far]) < 0.02


def test_gelslim3_is_touched_where_the_ball_is_by_the_markers_alone(
    pipeline: ForcePipeline,
) -> None:
    """Against the coloured spot as a person sees it. Of press_33, at the edge of the picture, half
    of the gel around the ball is not seen; there and where too many dots are not seen whole, the
    region is worse or the normal force unknown, as of press_44 and press_49."""
    places_px = pipeline.calibration.camera.project(pipeline.points_mm)
    found = 0
    for name in PRESSES:
        x, y, half = SEEN[name]
        result = pressed(pipeline, name)
        assert result.field is not None
        if not result.normal_known:
            assert result.problems, name
            continue
        push, from_spot = -result.field.force_n[:, 2], np.hypot(*(places_px - [x, y]).T)
        off = np.hypot(*(push @ places_px / push.sum() - [x, y]))
        assert off < (1.2 if name == "press_33" else 0.4) * half, name
        if name == "press_33":
            continue
        touched = result.field.contact
        assert np.mean(from_spot[touched] < 1.5 * half) > 0.8, name
        assert push[from_spot > 2 * half].sum() < 0.12 * push.sum(), name
        found += 1
    assert found >= 5


def test_gelslim3_is_touched_where_a_named_ball_is(gelslim3: ImportedSensor) -> None:
    """The patch of colour that the ball makes, in mm on the imported gel. Its radius is a guess.

    Of press_33 a part is beyond the edge of the picture: its size has a wide deviation, and its
    normal force is unknown.
    """
    ball = open_sensor(gelslim3.bundle, calibration=gelslim3.calibration, indenter="sphere:3.2")
    for name in PRESSES:
        x, y, half = SEEN[name]
        result = pressed(ball, name)
        patch = result.extra["normal"]
        assert patch["touched"], name
        centre = ball.calibration.camera.project(np.array([[*patch["centre_mm"], 0.0]]))[0]
        assert np.hypot(*(centre - [x, y])) < 0.4 * half, name
        cut = name == "press_33"
        least = 1.7 - (patch["size_sigma_mm"] if cut else 0.0)
        assert least < patch["size_mm"] < 2.7, name
        assert not (cut and result.normal_known)


def test_gelslim3_at_rest_is_not_touched(pipeline: ForcePipeline) -> None:
    pipeline.reset()
    result = pipeline.process(picture("gelslim3/reference.jpg"))
    assert result.wrench is not None
    assert np.abs(result.wrench.force_n).max() < 0.05
    assert result.field is not None
    assert not result.field.contact.any()


def test_gelslim2_is_imported() -> None:
    """Over a mirror, 44 degrees off the gel's normal by how much the picture converges."""
    made = real("gelslim2/reference.png", (30.0, 30.0, 3.0), 1.1, x_points="down", mirrored=True)
    assert len(made.calibration) >= 500
    assert made.calibration.grid.lattice_shape == (25, 25)
    assert off_lattice_px(made) < 1.2
    axes = made.calibration.camera.axes
    assert np.linalg.det(axes) < 0
    assert 35 < np.degrees(np.arccos(axes[2, 2])) < 50


def test_difftactile_is_imported_among_debris() -> None:
    made = real("difftactile/reference.png", (22.0, 16.0, 4.0), 1.5)
    assert len(made.calibration) >= 130
    assert sorted(made.calibration.grid.lattice_shape) == [10, 14]
    assert off_lattice_px(made) < 0.6


def test_a_pressed_gel_is_no_reference() -> None:
    picture("fots/press_0.png")
    loaded = described("fots/press_0.png", (20.0, 16.0, 4.0), 1.6)
    with pytest.raises(ImportSensorError):
        import_sensor(loaded.model, FRAMES, ladder=False)
