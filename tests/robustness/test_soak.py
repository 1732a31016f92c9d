"""A thousand frames: memory stays, and every frame is on disk."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from soaked_pipeline import BLACK, UNREADABLE
from sweep_commands import finished

from gelslim_force.outputs.recorded_run import read_run

PROGRAM = Path(__file__).with_name("soaked_pipeline.py")
SETTLED = 200
"""Frames until every kernel, buffer and chunk has been in use."""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc of Linux")
def test_memory_stays_over_a_thousand_frames(tmp_path: Path) -> None:
    done = finished([sys.executable, str(PROGRAM), str(tmp_path / "run")], tmp_path / "tmp")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["frames"] == 1000
    broken = 1000 // UNREADABLE + 1000 // BLACK
    assert told["with_forces"] == 1000 - broken
    settled = SETTLED // told["every"]
    memory = np.array(told["memory_kb"])
    assert len(memory) == 1000 // told["every"]
    grown_kb = memory[settled:].max() - memory[:settled].max()
    assert grown_kb < 2048, memory.tolist()
    run = read_run(tmp_path / "run")
    assert run.complete
    assert run.incomplete == ()
    assert len(run) == 1000
    assert [result.index for result in run.results()] == list(range(1000))
