"""Write and read a `gelslim-bundle/1`: a directory of `.npy` arrays and a manifest.json.

Arrays are opened as memory maps and are never unpickled. A bundle is written in a temporary
directory next to its own and then renamed, so a reader finds either the old or the new bundle.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.file_lock import beside, locked
from gelslim_core.files.replaced_folder import FolderError, recover, replaced_folder
from ifem_export.bundle.array_file import save_array
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.check import check_adjoint, check_bundle
from ifem_export.bundle.layout import bundle_arrays, bundle_from
from ifem_export.bundle.manifest import (
    LADDER,
    MANIFEST,
    REBUILD,
    describe,
    ladder_json,
    read_ladder,
    read_manifest,
    to_json,
)
from ifem_export.errors import BundleError, MeshError
from ifem_export.operators.solver import ConvergenceError

FAMILY = "gelslim-bundle/"
"""Prefix of the format of a bundle's manifest, for all versions."""
_ALTERED = "copy the bundle again from where it was built, or " + REBUILD


def write_bundle(path: str | os.PathLike[str], bundle: Bundle) -> None:
    """Check the bundle and write it as a directory, replacing a bundle that is already there.

    Args:
        path: Directory of the bundle; missing parents are created.
        bundle: The bundle.

    Raises:
        BundleError: The parts of the bundle do not agree, `path` is something other than a
            bundle, or the disk cannot be written.
    """
    bundle = _with_adjoint(bundle)
    check_bundle(bundle)
    check_adjoint(bundle)
    target = Path(os.path.abspath(path))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with locked(beside(target, ".lock")):
            recover(target)
            _require_replaceable(target)
            with replaced_folder(target, _files_of(target)) as staging:
                _fill(staging, bundle)
    except FolderError as error:
        raise BundleError(str(target), "cannot be written", str(error)) from error
    except OSError as error:
        raise BundleError(
            str(target),
            f"cannot be written ({error.strerror or error})",
            "check the path and the disk",
        ) from error


def _with_adjoint(bundle: Bundle) -> Bundle:
    """The bundle with adjoint fields, unless the pad has no surface stiffness or no solution."""
    try:
        return bundle.with_adjoint()
    except (ConvergenceError, MeshError):
        return bundle


def _fill(folder: Path, bundle: Bundle) -> None:
    entries = {
        name: _write_array(folder, name, array) for name, array in bundle_arrays(bundle).items()
    }
    ladder = ladder_json(bundle)
    if ladder:
        (folder / LADDER).write_bytes(ladder)
    (folder / MANIFEST).write_text(
        to_json(describe(bundle, entries)), encoding="utf-8", newline="\n"
    )


def load_bundle(path: str | os.PathLike[str], verify: bool = True) -> Bundle:
    """Open a bundle, whose arrays are memory-mapped and read-only.

    Args:
        path: Directory of the bundle.
        verify: Whether the SHA-256 of every file, all values and the self-test pair are checked.
            Otherwise only the manifest and the array headers are read, and values when used.

    Returns:
        The bundle.

    Raises:
        BundleError: A file is missing, damaged or altered.
    """
    folder = Path(path)
    if not folder.is_dir():
        what = "is a file, not a bundle directory" if folder.exists() else "does not exist"
        raise BundleError(str(folder), what, "give the path of a bundle directory")
    manifest = read_manifest(folder)
    arrays = {
        name: _open_array(folder, entry, verify) for name, entry in manifest["arrays"].items()
    }
    bundle = bundle_from(manifest, arrays, read_ladder(folder, manifest))
    if verify:
        check_bundle(bundle)
        if not np.array_equal(arrays["free_nodes"], bundle.mesh.free):
            raise BundleError("free_nodes.npy", "does not follow from the bonded nodes", REBUILD)
        if bundle.geometry_hash != manifest["geometry_hash"]:
            raise BundleError(MANIFEST, "geometry hash does not match the arrays", REBUILD)
        check_adjoint(bundle)
    return bundle


def summarise_bundle(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Describe a bundle and verify it.

    Args:
        path: Directory of the bundle.

    Returns:
        Mapping for JSON: format, hashes, versions, units, material, mesh, element, stiffness,
        markers, camera, the arrays with their sizes in bytes, the total size, and
        `verification` with `ok` and, if it failed, `file`, `reason` and `remedy`.

    Raises:
        BundleError: The manifest itself cannot be read.
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


def _require_replaceable(target: Path) -> None:
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        return
    found = _manifest_of(target) if target.is_dir() else {}
    # Builds and other programs have a manifest.json too.
    if not str(found.get("format")).startswith(FAMILY):
        raise BundleError(
            str(target), "exists and is not a bundle", "give another path or remove it yourself"
        )


def _manifest_of(folder: Path) -> dict[str, Any]:
    """The manifest without checks; empty if it is missing or damaged."""
    try:
        found = json.loads((folder / MANIFEST).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _files_of(folder: Path) -> set[str]:
    """Names of the files that belong to a bundle in this directory."""
    arrays = _manifest_of(folder).get("arrays")
    entries = arrays.values() if isinstance(arrays, dict) else ()
    return {MANIFEST, LADDER, *(str(e.get("file")) for e in entries if isinstance(e, dict))}


def _write_array(folder: Path, name: str, array: NDArray[Any]) -> dict[str, Any]:
    file = f"{name}.npy"
    contiguous = np.ascontiguousarray(array)
    with open(folder / file, "wb") as stream:
        save_array(stream, contiguous)
    return {
        "file": file,
        "sha256": _sha256(folder / file),
        "dtype": contiguous.dtype.str,
        "shape": list(contiguous.shape),
    }


def _sha256(path: Path) -> str:
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _open_array(folder: Path, entry: dict[str, Any], verify: bool) -> NDArray[Any]:
    """Memory-map one array and check its header against the manifest."""
    file = entry["file"]
    path = folder / file
    if not path.is_file():
        raise BundleError(file, "is missing", _ALTERED)
    try:
        array = _map(path)
    except (ValueError, OSError, SyntaxError, EOFError) as error:
        raise BundleError(file, _why_unreadable(path, error), _ALTERED) from error
    dtype, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
    if array.dtype != dtype or array.shape != shape:
        raise BundleError(
            file,
            f"holds {array.dtype} {array.shape}, the manifest says {dtype} {shape}",
            _ALTERED,
        )
    if verify and _sha256(path) != entry["sha256"]:
        raise BundleError(file, "its SHA-256 differs from the manifest, it was altered", _ALTERED)
    return array


def _map(path: Path) -> NDArray[Any]:
    try:
        return np.lib.format.open_memmap(path, mode="r")
    except ValueError:
        # An empty array cannot be mapped. Every other array fails here again with its reason.
        array: NDArray[Any] = np.load(path, allow_pickle=False)
        if array.size:
            raise
        return array


def _why_unreadable(path: Path, error: Exception) -> str:
    with open(path, "rb") as stream:
        head = stream.read(256)
    if head[:1] == b"\x80" or b"'|O'" in head:
        return "holds pickled Python objects, which are never loaded"
    if not head.startswith(b"\x93NUMPY"):
        return "is not a .npy file"
    return f"is truncated or damaged ({error})"
