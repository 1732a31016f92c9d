"""Running the command line in this process and in a fresh one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
MINI20 = ROOT / "designs" / "mini20.yaml"


def altered(folder: Path, old: str, new: str, name: str = "altered.yaml") -> Path:
    """mini20 with one piece of its text replaced."""
    text = MINI20.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = folder / name
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def too_long(folder: Path) -> Path:
    """A 50 mm gel, which no finger of 18 mm shows."""
    return altered(folder, "length_mm: 20", "length_mm: 50")


def fresh(
    *arguments: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """`python -m gelslim` in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "gelslim", *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=cwd or ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        timeout=120,
        check=False,
    )
