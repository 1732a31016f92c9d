"""The Python snippets of docs/force_pipeline.md run, one after the other, as a reader would."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "force"))

from sensor_samples import frame, press, sensor_bundle, stream  # noqa: E402

from gelslim_force.outputs.picture_file import encoded  # noqa: E402
from ifem_export.bundle.files import write_bundle  # noqa: E402

GUIDE = ROOT / "docs" / "force_pipeline.md"
FRAMES = 5


def snippets() -> list[str]:
    """Python blocks of the guide."""
    return re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the guide names."""
    write_bundle(tmp_path / "out" / "gelslim2-bundle", sensor_bundle())
    (tmp_path / "reference.png").write_bytes(encoded(frame(0.0).image, ".png"))
    (tmp_path / "frames").mkdir()
    for k, seen in enumerate(stream(FRAMES)):
        (tmp_path / "frames" / f"{k:04d}.png").write_bytes(encoded(seen.image, ".png"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_snippets_of_the_guide_run(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("PIL")
    blocks = snippets()
    assert len(blocks) >= 5
    names: dict[str, object] = {"w_mm": press().nodes_mm[:, 2]}
    for number, block in enumerate(blocks, 1):
        exec(compile(block, f"{GUIDE.name}, snippet {number}", "exec"), names)
    told = capsys.readouterr().out
    assert "without contact" not in told
    assert names["summary"].frames == FRAMES
    assert names["summary"].with_forces == FRAMES
    assert names["run"].complete
    assert len(list((place / "out" / "press" / "pictures").glob("*.png"))) > 0
    # What the guide says is unknown without a normal source is unknown, and known with one.
    assert np.isnan(names["tangential"].wrench.force_n).tolist() == [False, False, True]
    assert np.isfinite(names["known"].wrench.vector).all()
    assert names["known"].wrench.force_n[2] == pytest.approx(-1.0, abs=0.05)
    assert names["tracked"].tracks.coverage == 1.0


def test_commands_of_the_guide_have_the_options_named() -> None:
    """Every `gelslim COMMAND --option` of the guide is one that the command line has."""
    from typer.main import get_command

    from gelslim.cli.app import app

    commands = get_command(app).commands  # type: ignore[attr-defined]
    lines = re.findall(r"^    gelslim (.*?)(?:\s+#.*)?$", GUIDE.read_text("utf-8"), re.MULTILINE)
    assert len(lines) >= 4
    for line in lines:
        name = line.split()[0]
        assert name in commands, line
        known = {o for p in commands[name].params for o in (*p.opts, *p.secondary_opts)}
        for option in re.findall(r"(?<!\S)--?[a-z][a-z-]*", line):
            assert option in known, f"{option} in: {line}"
