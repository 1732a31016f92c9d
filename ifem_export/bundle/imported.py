"""What a bundle says of itself where its sensor was not generated but imported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ifem_export.markers.lattice_frame import LatticeFrame

KINDS = ("given", "measured", "assumed", "missing")
"""Kinds of knowledge, as the sentences of a bundle are ordered."""


@dataclass(frozen=True, eq=False)
class Imported:
    """Where the knowledge of an imported sensor comes from.

    Attributes:
        lattice: Steps and middle of the lattice of its markers.
        given: What its maker or user stated, in sentences.
        measured: What was measured in its picture.
        assumed: What nobody stated and a default stands for.
        missing: What is unknown, and what is not computed for that reason.
    """

    lattice: LatticeFrame
    given: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    def to_record(self) -> dict[str, Any]:
        """Plain values, for `from_record`."""
        return {"lattice": self.lattice.to_record(), **self.sentences()}

    def sentences(self) -> dict[str, list[str]]:
        """The sentences by kind."""
        return {kind: list(getattr(self, kind)) for kind in KINDS}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Imported:
        """The same from plain values. Raises KeyError, TypeError or IfemError for others."""
        told = {kind: tuple(str(line) for line in record[kind]) for kind in KINDS}
        return cls(LatticeFrame.from_record(record["lattice"]), **told)
