"""The memory of a data set does not grow with the number of its samples."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pyarrow", reason="data sets need the extra `record`")
TESTS = Path(__file__).parents[2]
ALLOCATORS = {
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "MALLOC_ARENA_MAX": "1",
    "OMP_NUM_THREADS": "1",
}
"""One heap for all threads, so that peaks are those of what is held."""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peaks as Linux counts them")
def test_a_hundred_thousand_samples_take_the_memory_of_ten_thousand(tmp_path: Path) -> None:
    paths = [str(TESTS.parent), str(TESTS), str(TESTS / "twin"), os.environ.get("PYTHONPATH", "")]
    ran = subprocess.run(
        [sys.executable, str(TESTS / "twin" / "data_set_memory.py"), str(tmp_path)],
        capture_output=True, text=True, check=False,
        env={**os.environ, **ALLOCATORS, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    peak = json.loads(ran.stdout.splitlines()[-1])
    growth = {
        stage: (peak[f"{stage} 102400"] - peak[f"{stage} 10240"]) / (102_400 - 10_240)
        for stage in ("made", "verified", "merged", "described")
    }
    # In bytes per sample. The description of LeRobot has statistics of every episode in its table.
    assert max(growth["made"], growth["verified"], growth["merged"]) < 100, growth
    assert growth["described"] < 1000, growth
