"""What `gelslim simulate` says is in the folder is in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gelslim.cli.commands.trial.simulate import _is_linear, _report

ANSWER = {
    "poses_solved": 4, "frames_drawn": 4, "frames_kept": 0, "seconds_in_all": 1.0,
    "solver_worst": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("drawn", "listed"),
    [
        (True, "In {}/: truth.csv, truth.npz, plan.json, ledger.json, frames/."),
        (False, "In {}/: truth.csv, truth.npz, plan.json, ledger.json."),
    ],
)
def test_last_line_names_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], drawn: bool, listed: str
) -> None:
    """No frames where no picture is observed."""
    (tmp_path / "frames").mkdir()
    if drawn:
        (tmp_path / "frames" / "frame_000000.png").write_bytes(b"")
    _report(tmp_path, ANSWER)
    assert capsys.readouterr().out.splitlines()[-1] == listed.format(tmp_path)


def test_pictures_without_a_response_are_linear_in_the_light(tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    assert not _is_linear(plan)
    plan.write_text('{"order": ["drawing", "shading"]}')
    assert _is_linear(plan)
    plan.write_text('{"order": ["drawing", "shading", "exposure"]}')
    assert not _is_linear(plan)
