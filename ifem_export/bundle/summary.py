"""What is in a bundle and whether it can be trusted, as plain data."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ifem_export.bundle.files import load_bundle
from ifem_export.bundle.manifest import read_manifest
from ifem_export.errors import BundleError


def summarise_bundle(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Describe a bundle and verify it.

    Args:
        path: the bundle's directory.

    Returns:
        JSON-able mapping: format, hashes, versions, units, material, mesh, element, stiffness,
        markers, camera, the arrays with their sizes in bytes, the total size, and
        `verification` with `ok` and, if it failed, `file`, `reason` and `remedy`.

    Raises:
        BundleError: the manifest itself cannot be read, so there is nothing to describe.
    """
    folder = Path(path)
    manifest = read_manifest(folder)
    manifest.pop("conventions")
    for entry in manifest["arrays"].values():
        file = folder / entry["file"]
        entry["bytes"] = file.stat().st_size if file.is_file() else None
    total = sum(entry["bytes"] or 0 for entry in manifest["arrays"].values())
    verification: dict[str, Any] = {"ok": True}
    try:
        loaded = load_bundle(folder)
        if loaded.ladder is not None:
            manifest["ladder"] = {**manifest["ladder"], **loaded.ladder.to_record()}
    except BundleError as error:
        verification = {
            "ok": False,
            "file": error.file,
            "reason": error.reason,
            "remedy": error.remedy,
        }
    return {**manifest, "total_bytes": total, "verification": verification}
