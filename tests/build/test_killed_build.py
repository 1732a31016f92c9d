"""A build killed with SIGKILL at any moment leaves the previous output whole."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("cadquery", reason="building needs the [cad] extra")

from gelslim_cad.build import build_variant

SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"
LONGEST_S = 240.0


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
@pytest.mark.parametrize("moment", ["working", "staging"])
def test_a_killed_build_leaves_the_old_output(
    built: Path, tmp_path: Path, digests: Callable[[Path], dict[str, str]], moment: str
) -> None:
    out = tmp_path / "mini20"
    shutil.copytree(built, out)
    before = digests(out)
    spec = tmp_path / "changed.yaml"
    text = SPEC.read_text().replace("  envelope:", "  mount:\n    gripper: WSG-50\n  envelope:")
    spec.write_text(text)
    process = start(spec, out)
    reached = until(process, out, moment)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert reached, "the build ended before it could be killed"
    assert digests(out) == before
    if moment == "staging":
        result = build_variant(spec, out, jobs=1)
        assert "part gripper_adapter" in result.rebuilt
        assert sorted(p.name for p in tmp_path.iterdir() if p.is_dir()) == ["mini20"]


def start(spec: Path, out: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "gelslim", "build", str(spec), "-o", str(out)]
    root = Path(__file__).parents[2]
    return subprocess.Popen(
        command, cwd=root, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def until(process: subprocess.Popen[bytes], out: Path, moment: str) -> bool:
    """Wait for the lock (the build works) or for the staging folder; False if the build ended."""
    sign = {"working": out.with_name(".mini20.lock"), "staging": out.with_name(".mini20.building")}
    ends = time.monotonic() + LONGEST_S
    while time.monotonic() < ends:
        if sign[moment].exists():
            return True
        if process.poll() is not None:
            return False
        time.sleep(0.001)
    return False
