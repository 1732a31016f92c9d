"""What the page shows of a design: its figures at once, its prices next, its solids after that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gelslim_cad.build.documents import headline
from gelslim_cad.checks import check
from gelslim_cad.checks.binding import binding_sentences
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.export.glb import glb_bytes
from gelslim_cad.report.rules import rules, verdict
from gelslim_cad.solids.reuse import PartStore
from gelslim_cad.spec import Spec
from gelslim_cad.spec.parts import OwnPart
from gelslim_cad.spec.reader import LoadedSpec
from gelslim_core.errors import GelslimError

Read = Callable[[Path], LoadedSpec]
"""Reads a spec file; raises GelslimError where it is refused."""


@dataclass(frozen=True)
class Design:
    """A spec that could be read, its dimensions, and the parts of its author's own."""

    spec: Spec
    dimensions: Dimensions
    own: tuple[OwnPart, ...] = ()

    @classmethod
    def of(cls, path: Path, read: Read) -> Design:
        """Read the file and derive. Raises GelslimError where it is refused."""
        loaded = read(path)
        return cls(loaded.spec, derive(loaded.spec), loaded.own_parts)

    def figures(self) -> dict[str, Any]:
        """Headline, rules and dimensions as plain data."""
        d = self.dimensions
        checks = check(d)
        status, phrase = verdict(checks)
        records = {name: d.record(name) for name in d.values}
        return {
            "name": self.spec.name,
            "verdict": {"status": status, "phrase": phrase},
            "headline": [list(pair) for pair in headline(d)],
            "rules": rules(checks),
            "dimensions": [
                [name, float(r["value"]), r["unit"], r["meaning"]] for name, r in records.items()
            ],
        }

    def prices(self) -> list[str]:
        """What limits the design and what concessions would gain."""
        return list(binding_sentences(self.spec, self.dimensions))


@dataclass
class Modeller:
    """Makes the solids of one design after another and reuses the parts that did not change."""

    store: PartStore = field(default_factory=PartStore)

    def glb(self, d: Dimensions, own: tuple[OwnPart, ...] = ()) -> bytes:
        """The assembly as GLB. Raises GelslimError where a part cannot be made."""
        from gelslim_cad.solids.finger import finger_parts

        parts = finger_parts(d, own, self.store)
        return glb_bytes(parts)


def problem_lines(error: GelslimError) -> list[str]:
    """What is wrong with a spec, a line each."""
    return str(error).splitlines()
