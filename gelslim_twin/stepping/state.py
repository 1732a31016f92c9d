"""The state of a stepped twin, and its file."""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import replace_file
from gelslim_twin.contact.gel_state import AnchoredState, GelState, StickTargets, TouchedNodes
from gelslim_twin.contact.relaxation import RelaxationState
from gelslim_twin.contact.solver import Candidates
from gelslim_twin.stepping.mechanics import SolvedStep
from gelslim_twin.stepping.step_error import StepError

Array = NDArray[np.float64]
FORMAT = "gelslim-twin-state/1"
TARGETS = tuple(field.name for field in fields(StickTargets))
GEL_KINDS = ("plain", "anchored", "solid")


@dataclass(frozen=True, eq=False)
class TwinState:
    """All that the next step depends on.

    Attributes:
        key: Pad, gel and bodies that the state belongs to.
        time_s: Time since the start.
        number: Steps since the start, from which the noise of a picture is drawn.
        motions: Rigid motions (k, 4, 4) of the bodies; None before the first step.
        solved: The elastic gel and the candidates of the contact.
        relaxation: Memory of a gel that relaxes; None for an elastic one.
    """

    key: str
    time_s: float
    number: int
    motions: Array | None
    solved: SolvedStep
    relaxation: RelaxationState | None = None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the state to a file, completely or not at all. Raises OSError."""
        stream = io.BytesIO()
        np.savez(stream, **self._arrays())  # type: ignore[arg-type]
        replace_file(Path(path), stream.getvalue())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TwinState:
        """Read a state that `save` wrote; it is the same to the last bit.

        Raises:
            StepError: The file cannot be read or is no state.
        """
        try:
            with np.load(path, allow_pickle=False) as held:
                return cls._read({name: held[name] for name in held.files})
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise StepError(f"{os.fspath(path)}: {reason}; name a state of a twin") from None
        except (KeyError, ValueError, EOFError, IndexError, zipfile.BadZipFile):
            raise StepError(
                f"{os.fspath(path)} is no state of a twin; TwinState.save writes one"
            ) from None

    def _arrays(self) -> dict[str, Array]:
        gel = self.solved.gel
        found: dict[str, Any] = {
            "record": np.array(json.dumps(self._record(), sort_keys=True)),
            "displacement_mm": gel.displacement_mm,
            "force_n": gel.force_n,
            "touch": gel.touch,
            "candidates": self.solved.candidates.nodes,
            "motions": self.motions,
            "anchor_mm": getattr(gel, "anchor_mm", None),
            "whole_mm": getattr(gel, "whole_mm", None),
            "pressure_mpa": getattr(gel, "pressure_mpa", None),
        }
        touched = gel.touched if isinstance(gel, AnchoredState) else None
        if touched is not None:
            found["touched"] = touched.nodes
            found["normal"] = touched.normal
            found |= {name: getattr(touched.targets, name) for name in TARGETS}
        if self.relaxation is not None:
            found["elastic_n"] = self.relaxation.elastic_n
            found["internal_n"] = self.relaxation.internal_n
        return {name: value for name, value in found.items() if value is not None}

    def _record(self) -> dict[str, Any]:
        gel = self.solved.gel
        solid = hasattr(gel, "whole_mm")
        return {
            "format": FORMAT,
            "key": self.key,
            "time_s": self.time_s,
            "number": self.number,
            "gel": GEL_KINDS[2 if solid else 1 if isinstance(gel, AnchoredState) else 0],
            "solver": dict(gel.solver),
            "large_strain": self.solved.large_strain,
            "excess": self.solved.excess,
        }

    @classmethod
    def _read(cls, held: dict[str, Any]) -> TwinState:
        record = json.loads(str(held["record"]))
        if record.get("format") != FORMAT:
            raise ValueError(FORMAT)
        memory = None
        if "elastic_n" in held:
            memory = RelaxationState(held["elastic_n"], held["internal_n"])
        return cls(
            record["key"],
            float(record["time_s"]),
            int(record["number"]),
            held.get("motions"),
            SolvedStep(
                _gel(record, held),
                Candidates(held["candidates"], np.zeros((0, 0), np.float32)),
                bool(record["large_strain"]),
                float(record["excess"]),
            ),
            memory,
        )


def _gel(record: dict[str, Any], held: dict[str, Any]) -> GelState:
    fields = held["displacement_mm"], held["force_n"], held["touch"], record["solver"]
    kind = record["gel"]
    if kind == "plain":
        return GelState(*fields)
    touched = None
    if "touched" in held:
        targets = StickTargets(*(held[name] for name in TARGETS))
        touched = TouchedNodes(held["touched"], held["normal"], targets)
    anchors = held.get("anchor_mm")
    if kind == "anchored":
        return AnchoredState(*fields, anchors, touched=touched)
    from gelslim_twin.contact.newton_contact import SolidState

    whole = held["whole_mm"], held.get("pressure_mpa")
    return SolidState(*fields, anchors, *whole, touched=touched)
