"""The family's picture: to scale, level, and the same bytes each time; and a real family."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from gelslim.cli import main
from gelslim_cad import family
from gelslim_cad.dimensions import derive
from gelslim_cad.family import (
    EDGE,
    FRONT,
    Member,
    Mesh,
    _middles,
    _row,
    _upright,
    dots,
    family_png,
)
from gelslim_cad.pictures.window import offscreen_window
from gelslim_cad.spec.reader import read_spec
from gelslim_core.optional_library import install_command

DESIGNS = Path(__file__).parents[2] / "designs"
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(family, "WIDTH_PX", 700)


def block(name: str, length: float, width: float, thickness: float) -> Member:
    """A red block as a finger, in the sensor frame: tip at +x, gel at z = 0."""
    vertices = CORNERS * (length, width, thickness) - (0, width / 2, thickness)
    mesh = Mesh("block", vertices, FACES, (0.8, 0.1, 0.1, 1.0))
    return Member(name, (length, width, 2.0), (length, width, thickness), Path("nowhere"), (mesh,))


FAMILY = (block("short", 40, 30, 15), block("long", 80, 40, 25))


def spans(image: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Left, right, top, bottom in px of each stretch of columns that is not white."""
    ink = (image < 250).any(axis=2)
    columns = np.flatnonzero(np.diff(np.concatenate([[0], ink.any(axis=0), [0]]).astype(int)))
    found = []
    for left, right in columns.reshape(-1, 2):
        rows = np.flatnonzero(ink[:, left:right].any(axis=1))
        found.append((int(left), int(right), int(rows[0]), int(rows[-1]) + 1))
    return found


def test_fingers_stand_on_one_floor_and_are_to_scale() -> None:
    pytest.importorskip("vtkmodules")
    shapes = [_upright(m) for m in FAMILY]
    with offscreen_window() as window:
        image, places, mm_per_px = _row(window, FAMILY, shapes, EDGE, _middles(shapes))
    short, long = spans(image)
    for (left, right, top, bottom), m, place in zip((short, long), FAMILY, places, strict=True):
        assert (bottom - top) * mm_per_px == pytest.approx(m.size_mm[0], abs=6 * mm_per_px)
        assert (right - left) * mm_per_px == pytest.approx(m.size_mm[2], abs=6 * mm_per_px)
        assert place == pytest.approx((left + right) / 2, abs=4)
    assert abs(short[3] - long[3]) <= 2
    with offscreen_window() as window:
        _, _, front = _row(window, FAMILY, shapes, FRONT, _middles(shapes))
    assert front == pytest.approx(mm_per_px, rel=0.25)


def test_the_gel_faces_the_viewer_and_tips_are_up() -> None:
    mesh = Mesh("gel", CORNERS * (1.0, 1.0, -0.1), FACES, (1, 1, 1, 1))
    finger = Member("f", (1, 1, 1), (1, 1, 1), Path("x"), (block("b", 10, 5, 4).meshes[0], mesh))
    points = _upright(finger)
    gel = points[-8:]
    assert gel[:, 1].min() == pytest.approx(points[:, 1].min())  # towards -y, the viewer
    assert points[:, 2].min() == 0.0
    tip = points[:8][CORNERS[:, 0] == 1]
    assert (tip[:, 2] > points[:8][CORNERS[:, 0] == 0][:, 2].max()).all()


@pytest.mark.slow
def test_the_picture_is_the_same_each_time() -> None:
    pytest.importorskip("vtkmodules")
    data = family_png(FAMILY)
    assert data.startswith(b"\x89PNG")
    assert data == family_png(FAMILY)
    assert data != family_png(FAMILY[:1])
    with pytest.raises(ValueError, match="finger"):
        family_png([])


def test_dots_lie_on_the_gel_where_the_markers_are() -> None:
    d = derive(read_spec(DESIGNS / "mini20.yaml").spec)
    mesh = dots(d)
    count = round(d["marker_grid.rows"] * d["marker_grid.columns"])
    assert len(mesh.vertices_mm) % 13 == 0
    assert 0.9 * count <= len(mesh.vertices_mm) / 13 <= count
    assert (mesh.vertices_mm[:, 2] > 0).all()
    assert (mesh.vertices_mm[:, 2] < 0.1).all()
    assert np.abs(mesh.vertices_mm[:, :2]).max() < 10.0
    a, b, c = (mesh.vertices_mm[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_two_specs_of_one_name_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = str(DESIGNS / "mini20.yaml")
    assert main(["family", spec, spec, "-o", str(tmp_path / "f")]) == 2
    assert "mini20" in capsys.readouterr().err
    assert not (tmp_path / "f").exists()


def test_without_the_cad_extra_nothing_is_left_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "gelslim_core.optional_library.installed", lambda module: module != "cadquery"
    )
    assert main(["family", str(DESIGNS / "mini20.yaml"), "-o", str(tmp_path / "f")]) == 2
    assert install_command("cad") in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_family_is_built_once_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("cadquery")
    hopeless = tmp_path / "hopeless.yaml"
    text = (DESIGNS / "mini20.yaml").read_text()
    hopeless.write_text(
        text.replace("length_mm: 20", "length_mm: 60").replace("name: mini20", "name: hopeless")
    )
    specs = [str(DESIGNS / "mini20.yaml"), str(hopeless)]
    command = ["family", *specs, "-o", str(tmp_path / "f"), "-j", "1", "--json"]
    assert main(command) == 1
    answer = json.loads(capsys.readouterr().out)
    assert [m["name"] for m in answer["members"]] == ["mini20"]
    assert "hopeless" in answer["refused"]
    rows = list(csv.DictReader(io.StringIO((tmp_path / "f" / "family.csv").read_text())))
    truth = derive(read_spec(specs[0]).spec)
    assert float(rows[0]["finger_thickness_mm"]) == truth["finger.thickness_mm"]
    picture = (tmp_path / "f" / "family.png").read_bytes()
    assert main(command) == 1
    again = json.loads(capsys.readouterr().out)
    assert again["members"][0]["units_rebuilt"] == 0
    assert (tmp_path / "f" / "family.png").read_bytes() == picture
