"""Ctrl-C in every command: one line, the status that shells expect, and nothing left behind."""

from __future__ import annotations

import random
import signal
import sys
from pathlib import Path

import pytest
from clean_run import CleanRuns
from interrupted_run import interrupted, leaves_nothing
from sweep_commands import COMMANDS, Command

pytest.importorskip("cadquery", reason="building needs the [cad] extra")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals process groups")


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_an_interrupt_is_one_line(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    """At moments of the command's own time: imports, work, writing."""
    moments, took = random.Random(f"interrupt {command.name}"), clean_runs(command).took_s
    lines = 0
    for k in range(command.interrupts):
        out, scratch = tmp_path / f"out_{k}" / "out", tmp_path / f"tmp_{k}"
        after_s = max(0.0, took * (k - moments.uniform(0, 1)) / command.interrupts)
        number = signal.SIGTERM if k % 4 == 2 else signal.SIGINT
        run = interrupted(command.argv(place, out), scratch, after_s, number, twice=k % 4 == 3)
        lines += run.was_one_line()
        leaves_nothing(run, scratch, out.parent)
    assert lines  # the first comes at once


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_an_interrupt_amidst_writing_leaves_nothing(
    command: Command, place: Path, tmp_path: Path
) -> None:
    events = random.Random(f"writing {command.name}")
    for k in range(3 * command.interrupts // 4):
        out, scratch = tmp_path / f"out_{k}" / "out", tmp_path / f"tmp_{k}"
        at = f"change:{round(2 ** events.uniform(0, 6))}"
        number = signal.SIGTERM if k % 3 == 2 else signal.SIGINT
        run = interrupted(command.argv(place, out), scratch, number=number, at=at)
        run.was_one_line()
        leaves_nothing(run, scratch, out.parent)
