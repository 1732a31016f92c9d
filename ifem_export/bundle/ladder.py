"""ladder.json of a bundle: the sensor's operators with measured error and time."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import BundleError, IfemError
from ifem_export.operators.operator_ladder import OperatorLadder

LADDER = "ladder.json"
_REMEDY = "rebuild the bundle from its spec (gelslim bundle SPEC)"


def ladder_json(bundle: Bundle) -> bytes:
    """The ladder as JSON; empty where none was measured."""
    if bundle.ladder is None:
        return b""
    record = bundle.ladder.to_record()
    return (json.dumps(record, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def ladder_section(bundle: Bundle) -> dict[str, Any] | None:
    """What the manifest says of the ladder."""
    data = ladder_json(bundle)
    if not data:
        return None
    digest = hashlib.sha256(data).hexdigest()
    return {"file": LADDER, "sha256": digest, "operator": bundle.operator}


def read_ladder(folder: Path, manifest: dict[str, Any]) -> tuple[OperatorLadder | None, str]:
    """OperatorLadder and chosen operator. Raises BundleError for a missing or altered file."""
    section = manifest.get("ladder")
    if section is None:
        return None, ""
    try:
        data = (folder / LADDER).read_bytes()
    except OSError as error:
        raise BundleError(LADDER, f"cannot be read ({error.strerror})", _REMEDY) from error
    if not isinstance(section, dict) or hashlib.sha256(data).hexdigest() != section.get("sha256"):
        raise BundleError(LADDER, "its SHA-256 differs from the manifest, it was altered", _REMEDY)
    try:
        return OperatorLadder.from_record(json.loads(data)), str(section.get("operator", ""))
    except (ValueError, IfemError) as error:
        raise BundleError(LADDER, str(error), _REMEDY) from error
