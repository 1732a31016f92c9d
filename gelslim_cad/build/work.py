"""Units of work: files that are written together, with a key over all their inputs.

A unit with the same key as in the last build is not done again: its files are taken over. Units
run in worker processes, so they carry their shapes as bytes.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from gelslim_cad.build.fingerprint import code_hash, combined
from gelslim_cad.geometry.part import Part

Files = dict[str, tuple[bytes, str]]
"""Content and purpose of files by their path."""
VOLUME_TOLERANCE = 2e-4
"""Largest volume error of meshes for printing; smaller than the proof's limit, for smooth arcs."""
COLLECTED_AFTER = 50_000, 20, 100
"""Thresholds of the garbage collector during a build; Python's own begin with 700."""


@dataclass(frozen=True)
class Written:
    """Files that a unit wrote, and the results of their checks."""

    files: Files
    proofs: tuple[dict[str, Any], ...] = ()
    note: str = ""
    """Why a file could not be made, where the design is not the reason."""


@dataclass(frozen=True)
class PackedPart:
    """A part whose solid is bytes, to cross process borders."""

    part: Part
    shape: bytes

    @classmethod
    def of(cls, part: Part) -> PackedPart:
        """Pack a part."""
        from gelslim_cad.export.brep import shape_to_bytes

        return cls(replace(part, solid=None, printed=None), shape_to_bytes(part.solid))

    def unpacked(self) -> Part:
        """The part with its solid again."""
        from gelslim_cad.export.brep import only_solid, shape_from_bytes

        return replace(self.part, solid=only_solid(shape_from_bytes(self.shape)))

    def key(self) -> str:
        """Key of shape and description."""
        return combined(self.shape, described(self.part))


def described(part: Part) -> str:
    """All fields of a part but its solid."""
    return repr(replace(part, solid=None, printed=None, tags=frozenset())) + repr(sorted(part.tags))


@dataclass(frozen=True)
class Unit:
    """One unit of work, picklable: a name, the kind of work, its inputs and their key.

    Attributes:
        name: Its name.
        kind: The kind of work, one of `WRITERS`.
        parts: The parts that it shows or writes.
        options: Its other inputs, by name.
        cost: About how long it takes, to begin the longest units first.
        file_keys: Files that depend on less than the whole unit, which is most of its work: their
            paths, each with the key of its inputs.
        known: Those of these files that the last build left, which need not be made again.
    """

    name: str
    kind: str
    parts: tuple[PackedPart, ...] = ()
    options: tuple[tuple[str, Any], ...] = ()
    cost: float = field(default=1.0, compare=False)
    file_keys: tuple[tuple[str, str], ...] = ()
    known: tuple[tuple[str, bytes], ...] = field(default=(), compare=False)

    def key(self) -> str:
        """Key of everything that shapes the unit's files."""
        keys = (p.key() for p in self.parts)
        return combined(code_hash(), self.kind, repr(self.options), *keys)


def run(unit: Unit) -> Written:
    """Do a unit of work in this process. Raises ExportError when a file cannot be written."""
    from gelslim_cad.build.writers import WRITERS

    parts = tuple(p.unpacked() for p in unit.parts)
    known = {"known": dict(unit.known)} if unit.file_keys else {}
    return WRITERS[unit.kind](parts, **dict(unit.options), **known)


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Let the garbage collector run seldom here and in workers that are forked meanwhile.

    A build makes many objects and few cycles: searching for these takes a twentieth of its time.
    """
    before = gc.get_threshold()
    gc.set_threshold(*COLLECTED_AFTER)
    try:
        yield
    finally:
        gc.set_threshold(*before)
