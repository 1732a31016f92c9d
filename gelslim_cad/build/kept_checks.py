"""Results of the rules on solids, which the next build takes over where nothing they read changed.

The rules read the solids of the finger and some dimensions by name. What they read is noted, as in
`gelslim_cad/solids/reuse.py`: with the same solids and the same values under these names the same
rules find the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from gelslim_cad.build.fingerprint import combined
from gelslim_cad.build.manifest import Manifest
from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.reuse import WatchedDimensions


@dataclass(frozen=True)
class KeptChecks:
    """Results of the rules on solids.

    Attributes:
        key: Key of the solids and of the values that the rules read.
        names: Names of these values.
        checks: The results.
    """

    key: str
    names: tuple[str, ...]
    checks: tuple[Check, ...]

    def record(self) -> dict[str, Any]:
        """The results as plain data for the manifest."""
        return {
            "key": self.key,
            "names": list(self.names),
            "checks": [asdict(check) for check in self.checks],
        }

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> KeptChecks:
        """The results from plain data. Raises KeyError or TypeError for anything else."""
        checks = tuple(Check(**each) for each in record["checks"])
        return cls(record["key"], tuple(record["names"]), checks)

    def hold(self, solids_key: str, d: Dimensions) -> bool:
        """Whether solids with this key and these dimensions give the same results."""
        return self.key == _key(solids_key, d, self.names)


def solid_checks(solids_key: str, d: Dimensions, parts: Sequence[Part]) -> KeptChecks:
    """Apply the rules on solids and note what they read.

    Args:
        solids_key: Key of the code, of the parts and of their solids.
        d: Dimensions of the finger.
        parts: Its parts.

    Returns:
        The results, with their key.
    """
    from gelslim_cad.build.solid_checks import check_mould, check_solids

    watched = WatchedDimensions(d.values, d.given, d.solved)
    checks = (*check_solids(watched, parts), *check_mould(watched))
    names = tuple(sorted(watched.read))
    return KeptChecks(_key(solids_key, d, names), names, checks)


def last_checks(manifest: Manifest | None) -> KeptChecks | None:
    """Those of the last build; None where its manifest has none."""
    if manifest is None or not manifest.solid_checks:
        return None
    try:
        return KeptChecks.from_record(manifest.solid_checks)
    except (KeyError, TypeError):
        return None


def _key(solids_key: str, d: Dimensions, names: Sequence[str]) -> str:
    values = [d.value(name) if name in d.values or name in d.given else None for name in names]
    return combined(solids_key, repr(list(zip(names, values, strict=True))))
