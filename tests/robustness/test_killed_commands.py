"""Killed at random moments, whatever the command: nothing lost, nothing half-written, no junk."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from clean_run import CleanRun, CleanRuns
from sweep_commands import (
    COMMANDS,
    Command,
    digests,
    environment,
    finished,
)

pytest.importorskip("cadquery", reason="building needs the [cad] extra")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="kills process groups")


def killed(argv: list[str], scratch: Path, after_s: float) -> bool:
    """Start, kill the whole group after a while; whether it was still at work."""
    process = subprocess.Popen(
        argv, env=environment(scratch), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    try:
        process.wait(after_s)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True


def kill_and_finish(
    command: Command, place: Path, clean: CleanRun, tmp_path: Path, kills: int
) -> None:
    scratch, whole, took = tmp_path / "tmp", clean.whole, clean.took_s
    assert whole
    out = tmp_path / "killed" / "out"
    moments = random.Random(f"kill {command.name}")
    for k in range(kills):
        # Most of the first seconds go to imports: kill late rather than early.
        killed(command.argv(place, out), scratch, took * moments.uniform(0.3, 1.0))
        if kills > 3 and k == kills // 2 and command.name not in ("force", "new"):
            # Once over halfway, so that a resumed run is killed too.
            assert finished(command.argv(place, out), scratch).returncode == 0
            assert digests(out.parent, command.ignored) == whole
            shutil.rmtree(out.parent)
    done = finished(command.argv(place, out), scratch)
    assert done.returncode == 0, done.stderr
    found = digests(out.parent, command.ignored)
    assert {n for n in found if n not in whole} == set()
    assert found == whole
    left = [p.name for p in scratch.iterdir() if p.name.startswith("gelslim")]
    assert left == []


def old_or_new(command: Command, place: Path, clean: CleanRun, tmp_path: Path, kills: int) -> None:
    """Over an earlier output of another kind every file is the old or the new one, whole."""
    scratch, earlier = tmp_path / "tmp", tmp_path / "earlier" / "out"
    assert finished(command.argv(place, earlier, other=True), scratch).returncode == 0
    old, new = digests(earlier), digests(clean.folder)
    assert old != new
    moments = random.Random(f"over {command.name}")
    for k in range(kills):
        out = tmp_path / f"over_{k}" / "out"
        shutil.copytree(earlier, out)
        killed(command.argv(place, out), scratch, clean.took_s * moments.uniform(0.5, 1.1))
        shown = {n: d for n, d in digests(out).items() if not n.rpartition("/")[2].startswith(".")}
        if command.name == "bundle":
            assert shown in (old, new)
        for name, digest in shown.items():
            assert digest in (old.get(name), new.get(name)), name
        assert set(old) & set(new) <= set(shown)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_killed_at_random_moments_it_ends_with_the_same_bytes(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    kill_and_finish(command, place, clean_runs(command), tmp_path, command.kills)


@pytest.mark.slow
@pytest.mark.parametrize("command", [c for c in COMMANDS if c.other], ids=lambda c: c.name)
def test_killed_over_an_earlier_output_each_file_is_whole(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    old_or_new(command, place, clean_runs(command), tmp_path, 4)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_two_at_once_into_one_folder_end_whole_or_say_why(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    out, scratch = tmp_path / "both" / "out", tmp_path / "tmp"
    both = [
        subprocess.Popen(
            command.argv(place, out), env=environment(scratch), text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        for _ in range(2)
    ]  # fmt: skip
    told = [process.communicate(timeout=600) for process in both]
    for process, (_, err) in zip(both, told, strict=True):
        assert "Traceback" not in err
        if process.returncode:
            assert process.returncode == 2, err
            assert "another process" in err or "another gelslim" in err
    assert 0 in [process.returncode for process in both], told
    assert digests(out.parent, command.ignored) == clean_runs(command).whole
