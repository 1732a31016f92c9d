"""What numbers were measured on: the header of every file in docs/data."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

VERSIONS = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "opencv": "opencv-python-headless",
    "cadquery": "cadquery",
    "gelslim_cad": "gelslim-cad",
}
"""Key in the header and distribution whose version it is; null where that is not installed."""


def machine(seed: int | None = None) -> dict[str, Any]:
    """Machine, threads, versions, and the seed of all random numbers (null where none is drawn)."""
    return {
        "seed": seed,
        "machine": platform.machine(),
        "system": platform.system(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "threads": int(os.environ.get("OMP_NUM_THREADS", 0)) or "default",
        "python": platform.python_version(),
        **{key: installed(name) for key, name in VERSIONS.items()},
    }


def installed(distribution: str) -> str | None:
    """Version of a distribution."""
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None


def processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())
