"""README and docs/digital_twin.md: commands parse, scenes named exist, snippets run."""

from __future__ import annotations

import csv
import re
import shlex
from pathlib import Path

import click
import numpy as np
import pytest

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.truth import COLUMNS, FrameTruth, fields_npz, wrench_csv

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "digital_twin.md"
PAGES = (ROOT / "README.md", GUIDE)


def blocks(language: str) -> list[str]:
    """Fenced blocks of the guide."""
    return re.findall(rf"```{language}\n(.*?)```", GUIDE.read_text("utf-8"), re.DOTALL)


def commands() -> list[str]:
    """Every line of both pages that calls the command line."""
    found: list[str] = []
    for page in PAGES:
        text = page.read_text("utf-8")
        found += re.findall(r"^    gelslim (.*)$", text, re.MULTILINE)
    return found


def test_both_pages_have_the_commands_of_the_twin() -> None:
    named = {line.split()[0] for line in commands()}
    assert {"plan", "simulate", "validate", "diff", "explore", "optimise", "doctor"} <= named


@pytest.mark.parametrize("line", commands())
def test_command_parses(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.main import get_command

    from gelslim.cli.app import app

    monkeypatch.chdir(ROOT)
    name, *rest = shlex.split(line.split(" > ")[0], comments=True)
    known = get_command(app).commands  # type: ignore[attr-defined]
    assert name in known, line
    try:
        known[name].make_context(name, rest)
    except click.ClickException as error:
        pytest.fail(f"gelslim {line}: {error.format_message()}")


def test_files_that_commands_read_exist() -> None:
    for line in commands():
        for path in re.findall(r"designs/\S+\.yaml", line):
            assert list(ROOT.glob(path)), line


def test_gallery_is_named_whole() -> None:
    text = GUIDE.read_text("utf-8")
    sentence = re.search(r"one scene per topic:(.*?)\.\n", text, re.DOTALL)
    assert sentence is not None
    named = set(re.findall(r"`(\w+)`", sentence.group(1)))
    assert named == {p.stem for p in (ROOT / "designs" / "scenes").glob("*.yaml")}


def test_scene_of_the_guide_is_legal(tmp_path: Path) -> None:
    (text,) = blocks("yaml")
    assert (ROOT / "designs" / "gelslim2.yaml").is_file()
    scene = tmp_path / "scenes" / "my_press.yaml"
    scene.parent.mkdir()
    scene.write_text(text, encoding="utf-8")
    loaded = read_scene(scene)
    assert len(loaded.poses) == 31


def test_every_effect_has_its_row_in_order() -> None:
    rows = re.findall(r"^\| `(\w+)` \|.*\|.*\|$", GUIDE.read_text("utf-8"), re.MULTILINE)
    names = [e.name for e in EFFECTS]
    assert [r for r in rows if r in names] == names


def test_columns_and_arrays_are_named() -> None:
    text = GUIDE.read_text("utf-8")
    for column in COLUMNS:
        assert f"`{column}`" in text, column
    made = fields_npz(frames(), np.zeros((3, 3)), ("displacement", "force"))
    for name in arrays_in(made):
        assert f"`{name}`" in text, name


def arrays_in(data: bytes) -> list[str]:
    import io

    with np.load(io.BytesIO(data)) as held:
        return list(held.files)


def frames() -> list[FrameTruth]:
    """Two frames of three nodes: at rest, and 1 N down on one of them."""
    from dataclasses import replace

    from gelslim_twin.scene.pose import Pose

    rest = GelState.at_rest(3)
    force = np.zeros((3, 3))
    force[1, 2] = -1.0
    pressed = replace(rest, force_n=force)
    seen = np.zeros((4, 2))
    drawn = np.ones(4, dtype=bool)
    return [
        FrameTruth(k, float(k), Pose(float(k)), state, seen, seen, drawn)
        for k, state in enumerate((rest, pressed))
    ]


def test_snippets_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "out" / "press_sphere"
    folder.mkdir(parents=True)
    made = fields_npz(frames(), np.zeros((3, 3)), ("force", "markers"))
    (folder / "truth.npz").write_bytes(made)
    (folder / "truth.csv").write_bytes(wrench_csv(frames(), np.zeros((3, 3))))
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    found = blocks("python")
    assert found
    for number, block in enumerate(found, 1):
        exec(compile(block, f"{GUIDE.name}, snippet {number}", "exec"), names)
    with (folder / "truth.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    told = [[float(r[c]) for c in ("fx_n", "fy_n", "fz_n")] for r in rows]
    assert np.allclose(names["force_n"], told)  # type: ignore[arg-type]
    assert told[-1] == [0.0, 0.0, -1.0]
