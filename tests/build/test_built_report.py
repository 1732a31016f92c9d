"""The report of a real build, opened in a browser with the network off, shows the finger."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("cadquery", reason="building needs the [cad] extra")
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        BROWSER is None, reason="NO BROWSER: the page test did not run; apt-get install chromium"
    ),
]
SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--host-resolver-rules=MAP * ~NOTFOUND", "--no-first-run",
    "--enable-logging=stderr", "--virtual-time-budget=8000", "--window-size=1280,1400",
)  # fmt: skip


def browse(built: Path, folder: Path, *switches: str) -> subprocess.CompletedProcess[str]:
    page = (built / "report.html").as_uri()
    profile = f"--user-data-dir={folder / 'profile'}"
    command = [str(BROWSER), *SWITCHES, profile, *switches, page]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=True)


def test_viewer_starts_and_asks_for_nothing(built: Path, tmp_path: Path) -> None:
    done = browse(built, tmp_path, "--dump-dom")
    viewer = re.search(r'<div id="viewer"[^>]*>', done.stdout)
    assert viewer is not None
    assert 'data-state="ready"' in viewer.group()
    triangles = re.search(r'data-triangles="(\d+)"', viewer.group())
    assert triangles is not None
    assert int(triangles.group(1)) > 5000
    console = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    assert [line for line in console if "GPU stall due to ReadPixels" not in line] == []
    assert not re.search(r'(?:src|href)="https?://', done.stdout)


def test_screenshot_shows_the_finger(built: Path, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    browse(built, tmp_path, f"--screenshot={shot}")
    image = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")).astype(int)
    view = image[340:960, 60:950]
    dark = view.max(axis=2) < 90
    assert 0.1 < dark.mean() < 0.7, "the black body is not in the viewer"
    rows, columns = np.nonzero(dark)
    assert np.ptp(columns) > 400
    assert np.ptp(rows) > 200
    pale = (view.min(axis=2) > 170) & (np.ptp(view, axis=2) > 2)
    inside = pale[rows.min() : rows.max(), columns.min() : columns.max()]
    assert inside.mean() > 0.02, "no gel is to be seen in the bezel's window"
    pictures = image[1040:1280]
    red = (pictures[..., 0] > pictures[..., 1] + 60) & (pictures[..., 0] > pictures[..., 2] + 60)
    assert red.sum() > 50, "the red LED board is not in the exploded picture"
