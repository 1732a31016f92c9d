"""The folder of one simulated scene: the key of its input, and whether it is complete."""

from __future__ import annotations

import contextlib
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gelslim_core.errors import GelslimError
from gelslim_core.files.replaced_file import is_part, json_bytes, replace_file, sweep

FORMAT = "gelslim-simulation/1"
RUN, PLAN, LEDGER = "run.json", "plan.json", "ledger.json"
TRUTH, FIELDS = "truth.csv", "truth.npz"
FRAMES, STATES = "frames", "states"
_STATE_FILES = "states_*.npz"


class SimulationError(GelslimError, ValueError):
    """A simulation cannot start or continue; the message says why and what to do."""


@dataclass(frozen=True)
class RunFolder:
    """A folder and the key of what is simulated into it."""

    path: Path
    key: str

    @classmethod
    def opened(cls, path: Path, key: str, overwrite: bool = False) -> RunFolder:
        """Make the folder, or continue in it where it holds the same simulation.

        Raises SimulationError for a folder with anything else in it. With `overwrite` the files
        of another simulation, and only those, are deleted.
        """
        found = cls(path, key)
        try:
            path.mkdir(parents=True, exist_ok=True)
            record = found.record()
            if record is None and found.foreign():
                raise SimulationError(
                    f"{path} is not empty and holds no simulation; choose another folder"
                )
            if record is not None and record.get("key") != key:
                if not overwrite:
                    raise SimulationError(
                        f"{path} holds another simulation ({record.get('scene')}); choose another "
                        "folder or replace it with --force"
                    )
                found.clear()
            if not found.complete:
                (path / FRAMES).mkdir(exist_ok=True)
                (path / STATES).mkdir(exist_ok=True)
            for folder in (path, path / FRAMES, path / STATES):
                sweep(folder, again=True)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise SimulationError(f"{path}: {reason}; choose a folder you can write to") from error
        return found

    @property
    def complete(self) -> bool:
        """Whether the simulation is finished."""
        record = self.record()
        return record is not None and record.get("state") == "complete"

    def foreign(self) -> bool:
        """Whether it holds files that no simulation wrote before its first record."""
        for path in self.path.iterdir():
            begun = path.name in (FRAMES, STATES) and path.is_dir() and not any(path.iterdir())
            if not begun and not is_part(path.name):
                return True
        return False

    def record(self) -> dict[str, Any] | None:
        """Content of run.json; None where there is none."""
        try:
            record = json.loads((self.path / RUN).read_bytes())
        except (OSError, ValueError):
            return None
        return record if isinstance(record, dict) and record.get("format") == FORMAT else None

    def write(self, name: str, data: bytes) -> None:
        """Write a file atomically."""
        replace_file(self.path / name, data)

    def mark(self, state: str, about: dict[str, Any]) -> None:
        """Rewrite run.json."""
        self.write(RUN, json_bytes({"format": FORMAT, "key": self.key, "state": state, **about}))

    def remove_states(self) -> None:
        """Delete the solved poses, from which only an unfinished simulation continues."""
        for file in (self.path / STATES).glob(_STATE_FILES):
            file.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # a file of the user's may be in it
            (self.path / STATES).rmdir()

    def frame_path(self, number: int) -> Path:
        """Picture of a frame."""
        return self.path / FRAMES / f"frame_{number:06d}.png"

    def clear(self) -> None:
        """Delete the files of a simulation."""
        for name in (RUN, PLAN, LEDGER, TRUTH, FIELDS):
            (self.path / name).unlink(missing_ok=True)
        self.remove_states()
        for file in self.path.glob(f"{FRAMES}/frame_*.png"):
            file.unlink()


def simulation_key(scene_record: str, plan_json: str, geometry_hash: str, material: str) -> str:
    """Hash of scene, plan, pad and gel."""
    digest = hashlib.sha256(b"gelslim-simulation/1")
    for part in (scene_record, plan_json, geometry_hash, material):
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part.encode())
    return digest.hexdigest()
