"""The manifest of a build: its files and their inputs, so that the next build can reuse them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

FORMAT = "gelslim-build/1"
NAME = "manifest.json"


@dataclass(frozen=True)
class FileEntry:
    """One written file."""

    sha256: str
    size_bytes: int
    purpose: str
    unit: str


@dataclass(frozen=True)
class Manifest:
    """Files by path, and the key of the inputs of each unit of work.

    Files that depend on less than their unit have keys of their own among those of the units.
    `solid_checks` is the record of `KeptChecks`.
    """

    name: str
    spec_hash: str
    key: str
    versions: Mapping[str, str]
    units: Mapping[str, str]
    files: Mapping[str, FileEntry]
    proofs: tuple[Mapping[str, Any], ...] = field(default=())
    solid_checks: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> bytes:
        """The manifest as it is written, byte for byte the same for the same content."""
        content = {
            "format": FORMAT,
            "name": self.name,
            "spec_hash": self.spec_hash,
            "key": self.key,
            "versions": dict(self.versions),
            "units": dict(sorted(self.units.items())),
            "files": {path: asdict(e) for path, e in sorted(self.files.items())},
            "proofs": [dict(p) for p in self.proofs],
            "solid_checks": dict(self.solid_checks),
        }
        return json_bytes(content)


def entry(data: bytes, purpose: str, unit: str) -> FileEntry:
    """Entry of a file with this content."""
    return FileEntry(hashlib.sha256(data).hexdigest(), len(data), purpose, unit)


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of an earlier build; None when there is none that can be used."""
    try:
        content = json.loads((folder / NAME).read_bytes())
        if content["format"] != FORMAT:
            return None
        files = {path: FileEntry(**e) for path, e in content["files"].items()}
        return Manifest(
            content["name"],
            content["spec_hash"],
            content["key"],
            content["versions"],
            content["units"],
            files,
            tuple(content["proofs"]),
            content.get("solid_checks", {}),
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None


def intact(folder: Path, manifest: Manifest, paths: list[str]) -> bool:
    """Whether all these files are there with the content the manifest states."""
    for path in paths:
        try:
            data = (folder / path).read_bytes()
        except OSError:
            return False
        stated = manifest.files[path]
        if len(data) != stated.size_bytes or hashlib.sha256(data).hexdigest() != stated.sha256:
            return False
    return True


def json_bytes(content: object) -> bytes:
    """Indented UTF-8 JSON with a final newline; the same content gives the same bytes."""
    return (json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
