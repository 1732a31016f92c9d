"""States of everything on, kept in a folder for later calls with the times that they took.

They are told apart by the case, by the plan's rungs and by the code that solves them, so that a
change of that code solves them again. Their times are those of the machine that solved them.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from bench.bench_data import ROOT
from gelslim_core.files.replaced_file import replacement
from gelslim_twin.contact.gel_state import GelState

SOLVED_BY = (
    *("gelslim_twin/contact", "gelslim_twin/tools", "gelslim_twin/scene", "gelslim_force/forces"),
    *("ifem_export", "designs", "tests/twin/random_contact_scenes.py"),
)
"""Code and scenes that decide the states of everything on."""
OTHERS = frozenset({"corrected_contact.py"})
"""Modules there that everything on does not use, since it converges."""


@dataclass(frozen=True)
class KeptRun:
    """States of a scene carried out, and the CPU time that they and its frames took."""

    states: tuple[GelState, ...]
    gel_ms: float
    frames_ms: float


@dataclass(frozen=True)
class KeptRuns:
    """Runs of a case in a folder, by the key of their plan; None as folder keeps nothing."""

    folder: Path | None
    case: str

    def _place(self, key: str) -> Path | None:
        if self.folder is None:
            return None
        told = hashlib.sha256("\n".join((self.case, key, code_digest())).encode()).hexdigest()
        return self.folder / f"{self.case.replace(' ', '_')}-{told[:16]}.npz"

    def read(self, key: str) -> KeptRun | None:
        """A run that was kept, without the solver's reports; None where there is none."""
        place = self._place(key)
        if place is None or not place.exists():
            return None
        with np.load(place) as arrays:
            fields = (arrays["displacement_mm"], arrays["force_n"], arrays["touch"])
            states = tuple(GelState(u, f, t) for u, f, t in zip(*fields, strict=True))
            gel_ms, frames_ms = (float(ms) for ms in arrays["ms"])
        return KeptRun(states, gel_ms, frames_ms)

    def keep(self, key: str, run: KeptRun) -> None:
        """Write a run; nothing where nothing is kept."""
        place = self._place(key)
        if place is None:
            return
        with replacement(place, parents=True) as stream:
            np.savez(
                stream,
                displacement_mm=np.array([s.displacement_mm for s in run.states]),
                force_n=np.array([s.force_n for s in run.states]),
                touch=np.array([s.touch for s in run.states]),
                ms=np.array([run.gel_ms, run.frames_ms]),
            )


@cache
def code_digest() -> str:
    """Of the files under `SOLVED_BY`."""
    found = hashlib.sha256()
    for name in SOLVED_BY:
        place = ROOT / name
        files = [place] if place.is_file() else sorted(place.rglob("*"))
        for file in files:
            if file.suffix in (".py", ".yaml", ".csv") and file.name not in OTHERS:
                found.update(file.relative_to(ROOT).as_posix().encode() + b"\0")
                found.update(file.read_bytes())
    return found.hexdigest()
