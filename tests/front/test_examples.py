"""The designs and scenes that come with the program can be listed and copied."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim.examples import ExampleError, example, examples
from gelslim_cad.spec.reader import read_spec
from gelslim_twin.scene.reader import read_scene

DESIGNS = Path(__file__).parents[2] / "designs"


def test_all_files_of_the_folder_are_listed() -> None:
    found = {(e.kind, e.name) for e in examples()}
    assert {name for kind, name in found if kind == "design"} == {
        p.stem for p in DESIGNS.glob("*.yaml")
    }
    assert {name for kind, name in found if kind == "scene"} == {
        p.stem for p in (DESIGNS / "scenes").glob("*.yaml")
    }
    assert all(len(e.summary) > 5 for e in examples())


def test_an_unknown_example_is_refused() -> None:
    with pytest.raises(ExampleError):
        example("absent")


@pytest.mark.parametrize("entry", examples(), ids=lambda e: e.name)
def test_each_copy_can_be_read(entry: object, tmp_path: Path) -> None:
    source = example(entry.name)  # type: ignore[attr-defined]
    assert main(["new", "mine", "--from", source.name, "-o", str(tmp_path / "mine.yaml")]) == 0
    if source.kind == "design":
        assert read_spec(tmp_path / "mine.yaml").spec.name == "mine"
        return
    loaded = read_scene(tmp_path / "mine.yaml")
    assert loaded.scene.name == "mine"
    assert loaded.sensor_path.parent == tmp_path
    assert loaded.sensor_path.is_file()


def test_nothing_is_overwritten_and_the_same_file_is_no_conflict(tmp_path: Path) -> None:
    copy = ["new", "--from", "press_sphere", "-o"]
    assert main([*copy, str(tmp_path / "a.yaml"), "a"]) == 0
    assert main([*copy, str(tmp_path / "b.yaml"), "b"]) == 0
    (tmp_path / "gelslim2.yaml").write_text("another")
    assert main([*copy, str(tmp_path / "c.yaml"), "c"]) == 2
    assert not (tmp_path / "c.yaml").exists()
    assert (tmp_path / "gelslim2.yaml").read_text() == "another"


def test_a_name_that_no_finger_may_have_is_refused(tmp_path: Path) -> None:
    assert main(["new", "a b", "--from", "mini20", "-o", str(tmp_path / "x.yaml")]) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_list_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert {"name", "kind", "path", "summary"} == set(listed[0])
