"""`run.json`, the manifest of a run: its contents, settings, versions and state."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from gelslim_core.errors import OutputError, disk_error
from gelslim_core.files.replaced_file import json_bytes, replace_file
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.gel_law import GelUse
from gelslim_force.forces.record import plain
from ifem_export.bundle.bundle import Bundle

MANIFEST = "run.json"
FORMAT_NAME = "gelslim-run/1"
State = Literal["running", "complete", "stopped"]
"""`running` also if the process was killed; `stopped` by the error in `reason`."""
UNITS: Mapping[str, str] = {
    "length": "mm",
    "force": "N",
    "torque": "N mm, about the origin",
    "traction": "MPa",
    "image": "px, centre of the first pixel at (0, 0), x right, y down",
    "time": "s",
    "stamp": "s since 1970-01-01 00:00 UTC",
    "frame": "origin at the centre of the gel's outer surface, x to the tip, z out of the gel",
    "byte_order": "little-endian",
    "unknown": "NaN",
}


@dataclass
class RunCounts:
    """Counts of the frames of a run."""

    frames: int = 0
    with_tracks: int = 0
    with_field: int = 0
    with_wrench: int = 0
    with_problems: int = 0
    first_time_s: float | None = None
    last_time_s: float | None = None
    first_stamp_s: float | None = None
    last_stamp_s: float | None = None
    gel: GelUse = field(default_factory=GelUse)
    """Frames with forces by the law of the gel."""
    problems: dict[str, int] = field(default_factory=dict)
    """Number of frames by problem; beyond `_MAX_PROBLEMS` different ones they count as "other"."""

    def add(self, result: FrameResult) -> None:
        """Add a frame."""
        self.frames += 1
        self.with_tracks += result.tracks is not None
        self.with_field += result.field is not None
        self.with_wrench += result.wrench is not None
        self.with_problems += bool(result.problems)
        if result.wrench is not None and "gel" in result.extra:
            self.gel.add(result.extra["gel"])
        if self.first_time_s is None:
            self.first_time_s = plain(float(result.time_s))
        self.last_time_s = plain(float(result.time_s))
        if result.stamp_s is not None:
            self.last_stamp_s = float(result.stamp_s)
            if self.first_stamp_s is None:
                self.first_stamp_s = self.last_stamp_s
        for problem in result.problems:
            known = problem in self.problems or len(self.problems) < _MAX_PROBLEMS
            name = problem if known else "other"
            self.problems[name] = self.problems.get(name, 0) + 1


_MAX_PROBLEMS = 50


def bundle_identity(bundle: Bundle) -> dict[str, str]:
    """Return the hashes that identify the bundle of a run."""
    return {"geometry_hash": bundle.geometry_hash, "spec_hash": bundle.spec_hash}


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute the results."""
    found = {"python": platform.python_version()}
    for name in ("gelslim-cad", "numpy", "scipy", "numba", "pyarrow", "opencv-python-headless"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def write_manifest(folder: Path, record: Mapping[str, Any]) -> None:
    """Replace `run.json` atomically. Raises OSError."""
    replace_file(folder / MANIFEST, json_bytes(record))


def read_manifest(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Read `run.json`. Raises OutputError if the folder holds no run."""
    path = Path(folder) / MANIFEST
    try:
        record = json.loads(path.read_bytes())
    except FileNotFoundError as error:
        raise OutputError(
            f"{os.fspath(folder)}: no run is in this folder; a run has a file {MANIFEST}"
        ) from error
    except OSError as error:
        raise disk_error(path, "reading the manifest", error) from error
    except ValueError as error:
        raise OutputError(f"{path}: damaged ({error})") from error
    if not isinstance(record, dict) or record.get("format") != FORMAT_NAME:
        raise OutputError(f"{path}: it is not a run of the format {FORMAT_NAME}")
    return record
