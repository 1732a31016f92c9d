"""Tables of loads: what is read, and what is refused with its line."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from gelslim_force.outputs.canvas import encoded
from gelslim_force.presses.load_table import Load, read_loads
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_pictures import press_pictures, reference_of


def table(folder: Path, text: str) -> Path:
    path = folder / "LOADS.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_grams_and_newtons_say_the_same(tmp_path: Path) -> None:
    grams = read_loads(table(tmp_path, "picture,load_g\na.png,50\nrest.png,0\n"))
    newtons = read_loads(table(tmp_path, "picture;load_n\na.png;0.4903325\n\nrest.png;0\n"))
    assert [load.load_n for load in grams] == pytest.approx([load.load_n for load in newtons])
    assert grams[0].sigma_n == pytest.approx(np.hypot(0.005 * 0.4903325, 9.80665e-3))
    assert grams[0].time_s is None


def test_deviation_and_time(tmp_path: Path) -> None:
    text = "\ufeffPicture,LOAD_G,sigma_n,time_s\na.png, 50 ,0.002,12.5\nb.png,60,,\n"
    first, second = read_loads(table(tmp_path, text))
    assert (first.sigma_n, first.time_s) == (0.002, 12.5)
    assert second.sigma_n > 0.009
    assert second.time_s is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("a.png,50\n", "line 1"),
        ("picture,load\na.png,50\n", "line 1"),
        ("picture,load_g,load_n\na.png,50,1\n", "line 1"),
        ("picture,load_g,colour\na.png,50,red\n", "colour"),
        ("picture,load_g\n", "names no picture"),
        ("picture,load_g\na.png,\n", "line 2: load_g is missing"),
        ("picture,load_g\na.png,fifty\n", "line 2: load_g = 'fifty'"),
        ("picture,load_g\na.png,nan\n", "line 2"),
        ("picture,load_g\na.png,50\nb.png,-3\n", "line 3: load_g = -3"),
        ("picture,load_n\na.png,5000\n", "at most 1000 N"),
        ("picture,load_g\na.png,50\na.png,60\n", "line 3: picture a.png"),
        ("picture,load_g\na.png,50,7\n", "line 2: 3 values"),
        ("picture,load_g\n,50\n", "name of the picture is missing"),
        ("picture,load_g,sigma_g\na.png,50,0\n", "sigma_g"),
    ],
)
def test_refusals_name_the_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(PressError, match=words) as refused:
        read_loads(table(tmp_path, text))
    assert refused.value.reason == "table"
    assert str(tmp_path / "LOADS.csv") in str(refused.value)
    assert str(pickle.loads(pickle.dumps(refused.value))) == str(refused.value)


def test_files_that_are_no_tables(tmp_path: Path) -> None:
    with pytest.raises(PressError, match="no such file"):
        read_loads(tmp_path / "none.csv")
    (tmp_path / "picture.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(PressError, match="UTF-8"):
        read_loads(tmp_path / "picture.csv")


def test_which_picture_is_the_reference(tmp_path: Path) -> None:
    for number, name in enumerate(("a.png", "b.png", "z.png")):
        flat = np.full((40, 48, 3), 10 * number + 5, np.uint8)
        (tmp_path / name).write_bytes(encoded(flat, ".png"))
    pressed = Load("a.png", 1.0, 0.01)
    assert reference_of(tmp_path, [pressed, Load("z.png", 0.0, 0.01)], None)[1] == "z.png"
    assert reference_of(tmp_path, [pressed], None)[1] == "b.png"
    picture, _ = reference_of(tmp_path, [pressed], "z.png")
    assert (picture == 25).all()
    every = [Load(name, 1.0, 0.01) for name in ("a.png", "b.png", "z.png")]
    with pytest.raises(PressError, match="without contact"):
        reference_of(tmp_path, every, None)
    with pytest.raises(PressError, match=r"c.png: no such picture; the folder has a.png"):
        press_pictures(tmp_path, ["c.png"])
    (tmp_path / "b.png").write_bytes(b"no picture")
    with pytest.raises(PressError, match=r"b\.png"):
        press_pictures(tmp_path, ["b.png"])
    with pytest.raises(PressError, match="no such folder"):
        press_pictures(tmp_path / "none", ["b.png"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(PressError, match="no pictures"):
        press_pictures(tmp_path / "empty", ["b.png"])
