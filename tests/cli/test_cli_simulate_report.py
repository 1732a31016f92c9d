"""What `gelslim simulate` says is in the folder is in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gelslim.cli.commands.trial.simulate import _report

ANSWER = {
    "poses_solved": 4, "frames_drawn": 4, "frames_kept": 0, "seconds_in_all": 1.0,
    "solver_worst": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("scenes", "drawn", "listed"),
    [
        (1, True, "In {}/: truth.csv, truth.npz, plan.json, ledger.json, frames/."),
        (1, False, "In {}/: truth.csv, truth.npz, plan.json, ledger.json."),
        (3, True, "In {}/scene_*/: truth.csv, truth.npz, plan.json, ledger.json, frames/."),
        (3, False, "In {}/scene_*/: truth.csv, truth.npz, plan.json, ledger.json."),
    ],
)
def test_last_line_names_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], scenes: int, drawn: bool, listed: str
) -> None:
    """No frames where no picture is observed; a folder per scene where there are several."""
    for k in range(scenes):
        frames = (tmp_path if scenes == 1 else tmp_path / f"scene_{k:05d}") / "frames"
        frames.mkdir(parents=True)
        if drawn:
            (frames / "frame_000000.png").write_bytes(b"")
    _report(tmp_path, {**ANSWER, "scenes": scenes})
    assert capsys.readouterr().out.splitlines()[-1] == listed.format(tmp_path)
