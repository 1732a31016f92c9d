"""Inputs and undisturbed outputs of the sweep, made once."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from clean_run import CleanRun, CleanRuns
from sweep_commands import NAMED, Command, digests, finished, prepare, prepare_specs


@pytest.fixture(scope="session")
def specs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of two specs, with a blank and a letter that is not ASCII in its path."""
    return prepare_specs(tmp_path_factory.mktemp("inputs") / "in puts é")


@pytest.fixture(scope="session")
def place(specs: Path) -> Path:
    """The same folder with every input; commands that read more than specs need it."""
    folder = prepare(specs)
    done = finished(NAMED["simulate"].argv(folder, folder / "run"), folder.parent / "tmp")
    assert done.returncode == 0, done.stderr
    (folder / "run" / "frames").rename(folder / "drawn")
    return folder


@pytest.fixture(scope="session")
def clean_runs(specs: Path, tmp_path_factory: pytest.TempPathFactory) -> CleanRuns:
    """A command's undisturbed run, on the inputs that the test has asked for."""
    made: dict[str, CleanRun] = {}

    def clean(command: Command) -> CleanRun:
        if command.name not in made:
            out = tmp_path_factory.mktemp("clean") / "out"
            started = time.monotonic()
            done = finished(command.argv(specs, out), specs.parent / "tmp")
            took = time.monotonic() - started
            assert done.returncode == 0, done.stderr
            files = [p for p in out.parent.rglob("*") if p.is_file()]
            size = sum(p.stat().st_size for p in files if not p.name.startswith("compliance-"))
            made[command.name] = CleanRun(out, digests(out.parent, command.ignored), size, took)
        return made[command.name]

    return clean
