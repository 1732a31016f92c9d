"""Still pictures: true to scale, the same each time, and a clear word where none can be made."""

from __future__ import annotations

import hashlib
import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import report_sample

from gelslim_core.optional_library import install_command

pytest.importorskip("vtkmodules", reason="VTK is not installed: no still pictures")
from PIL import Image

from gelslim_cad.pictures import finger_pictures as pictures
from gelslim_cad.pictures import window

try:
    with window.offscreen_window():
        pass
except window.PictureError as error:
    pytest.skip(f"NO OPENGL: still pictures were not tested; {error}", allow_module_level=True)


def mesh(solid, rgba=(0.8, 0.1, 0.1, 1.0), explode=(0.0, 0.0, 0.0), name="part"):
    return (name, np.asarray(solid.vertices), np.asarray(solid.faces), rgba, explode)


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def extent(image: np.ndarray) -> tuple[int, int]:
    """Width and height of what is not white."""
    rows, columns = np.nonzero((image < 245).any(axis=2))
    return int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1


def hollow():
    """A 40 x 30 x 20 mm box around a closed cavity of 24 x 16 x 8 mm."""
    return report_sample.block((40, 30, 20), (0, 0, 0)).difference(
        [report_sample.block((24, 16, 8), (0, 0, 0))]
    )


def views(meshes) -> list[bytes]:
    return [
        pictures.picture_whole(meshes),
        pictures.picture_exploded(meshes),
        pictures.picture_section(meshes, "y", 0.0),
    ]


@pytest.fixture(scope="module")
def drawn() -> list[bytes]:
    return views(report_sample.meshes())


@pytest.mark.slow
def test_pictures_show_many_parts_on_white(drawn):
    for png in drawn:
        image = pixels(png)
        assert image.shape[1] == pictures.WIDTH_PX
        assert (image[0, 0] == 255).all()
        assert (image[-1, -1] == 255).all()
        assert len(np.unique(image.reshape(-1, 3) // 8, axis=0)) > 60
    assert len({hashlib.sha256(png).digest() for png in drawn}) == 3


@pytest.mark.slow
def test_pictures_are_the_same_in_a_fresh_process(drawn):
    code = (
        "import sys, hashlib; sys.path.insert(0, sys.argv[1])\n"
        "import report_sample, test_report_pictures\n"
        "made = test_report_pictures.views(report_sample.meshes())\n"
        "print(*(hashlib.sha256(p).hexdigest() for p in made))"
    )
    here = str(Path(__file__).parent)
    out = subprocess.run([sys.executable, "-c", code, here], capture_output=True, text=True)
    assert out.stdout.split() == [hashlib.sha256(png).hexdigest() for png in drawn], out.stderr


@pytest.mark.parametrize(
    ("axis", "shape"),
    [
        ("x", (30, 20)),
        pytest.param("y", (40, 20), marks=pytest.mark.slow),
        pytest.param("z", (40, 30), marks=pytest.mark.slow),
    ],
)
def test_section_is_to_scale_and_its_cap_has_the_true_area(axis, shape):
    image = pixels(pictures.picture_section([mesh(hollow())], axis, 0.0))
    width, height = extent(image)
    assert width / height == pytest.approx(shape[0] / shape[1], rel=0.01)
    middle = image[image.shape[0] // 2, image.shape[1] // 2]
    wall = {"x": (16, 8), "y": (24, 8), "z": (24, 16)}[axis]
    # Cut faces are flat and light; the back of the cavity is the full red of the part.
    cavity = np.abs(image - middle).max(axis=2) <= 3
    share = cavity.sum() / (width * height)
    assert share == pytest.approx(wall[0] * wall[1] / (shape[0] * shape[1]), rel=0.04)


@pytest.mark.slow
def test_exploding_moves_parts_apart():
    lower = mesh(report_sample.block((20, 20, 4), (0, 0, -2)))
    upper = mesh(report_sample.block((20, 20, 4), (0, 0, 2)), explode=(0, 0, 30.0))
    closed = extent(pixels(pictures.picture_whole([lower, upper])))
    apart = extent(pixels(pictures.picture_exploded([lower, upper])))
    assert apart[1] / apart[0] > 1.5 * closed[1] / closed[0]


def test_a_section_beside_the_parts_is_refused():
    with pytest.raises(ValueError, match=r"90\.0 mm.* -15\.00 to 15\.00 mm"):
        pictures.picture_section([mesh(hollow())], "y", 90.0)


def test_without_any_opengl_the_reason_is_given_instead_of_a_crash():
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import report_sample\n"
        "from gelslim_cad.pictures import finger_pictures as pictures, window\n"
        "window.loads = lambda name: False\n"
        "try: pictures.picture_whole(report_sample.meshes())\n"
        "except window.PictureError as error: print(error)"
    )
    env = os.environ | {"__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent", "DISPLAY": ""}
    here = str(Path(__file__).parent)
    out = subprocess.run(
        [sys.executable, "-c", code, here], capture_output=True, text=True, env=env
    )
    assert out.returncode == 0, out.stderr
    assert "libegl1" in out.stdout


def test_a_missing_library_is_named_with_its_debian_package():
    told = window._missing("libXrender.so.1: cannot open shared object file")
    assert "libxrender1" in told
    assert install_command("view") in window._missing("No module named 'vtkmodules'")


def test_a_part_shows_itself_in_a_notebook(monkeypatch):
    cq = pytest.importorskip("cadquery")
    from gelslim_cad.geometry.part import Part

    part = Part("box", cq.Solid.makeBox(40, 30, 20), "resin", "print", (0.8, 0.1, 0.1, 1.0))
    image = pixels(part._repr_png_())
    assert (image[..., 0] > image[..., 1] + 60).mean() > 0.1
    monkeypatch.setattr(pictures, "picture_whole", unable)
    assert part._repr_png_() is None


def unable(meshes):
    raise window.PictureError("no VTK")


def test_a_window_draws_scenes_of_several_sizes_as_windows_of_their_own_do():
    """Nothing of the pictures that were drawn first is left in those after them."""
    box = [mesh(hollow())]
    with window.offscreen_window() as shared:
        large = window.draw(shared, [pictures._scene(pictures._shown(box), pictures.ISO)], 600, 1)
        after = pictures.picture_set(shared, pictures._shown(box))
    assert large[0].shape[1] == 600
    for png, alone in zip(
        (after["whole"], after["section"]),
        (pictures.picture_whole(box), pictures.picture_section(box)),
        strict=True,
    ):
        assert np.abs(pixels(png) - pixels(alone)).max() <= 2
