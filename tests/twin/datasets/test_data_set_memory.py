"""The memory of a data set does not grow with the number of its samples."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pyarrow", reason="data sets need the extra `record`")
pytest.importorskip("resource", reason="peaks of memory as POSIX counts them")
TESTS = Path(__file__).parents[2]


@pytest.mark.slow
def test_a_hundred_thousand_samples_take_the_memory_of_ten_thousand(tmp_path: Path) -> None:
    paths = [str(TESTS.parent), str(TESTS), str(TESTS / "twin"), os.environ.get("PYTHONPATH", "")]
    ran = subprocess.run(
        [sys.executable, str(TESTS / "twin" / "data_set_memory.py"), str(tmp_path)],
        capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    peak = json.loads(ran.stdout.splitlines()[-1])
    more = 102_400 - 10_240
    assert (peak["made 102400"] - peak["made 10240"]) / more < 100
    assert (peak["verified"] - peak["made 102400"]) / more < 100
    assert (peak["merged"] - peak["verified"]) / more < 100
    assert (peak["described 102400"] - peak["described 10240"]) / more < 500
