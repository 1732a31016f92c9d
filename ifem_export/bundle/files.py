"""Write and read `gelslim-bundle/1`: a directory of `.npy` arrays and a manifest.json.

Arrays open memory-mapped and are never unpickled. A bundle is written beside its place and
renamed into it, so a reader sees the old one or the new one.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.beside import beside
from gelslim_core.files.file_lock import locked
from gelslim_core.files.replaced_folder import FolderError, recover, replaced_folder
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.check import check_bundle
from ifem_export.bundle.ladder import LADDER, ladder_json, read_ladder
from ifem_export.bundle.layout import bundle_arrays, bundle_from
from ifem_export.bundle.manifest import MANIFEST, REBUILD, describe, read_manifest, to_json
from ifem_export.errors import BundleError

FAMILY = "gelslim-bundle/"
"""How the format of a bundle's manifest begins, whatever its version."""
_ALTERED = "copy the bundle again from where it was built, or " + REBUILD


def write_bundle(path: str | os.PathLike[str], bundle: Bundle) -> None:
    """Check the bundle and write it as a directory, replacing a bundle already there.

    Args:
        path: the bundle's directory; folders above it are made.
        bundle: what to write.

    Raises:
        BundleError: the bundle does not hold together, something else is at `path`, or the
            disk refuses.
    """
    check_bundle(bundle)
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


def load_bundle(
    path: str | os.PathLike[str],
    verify: bool = True,
    *,
    expected_geometry_hash: str | None = None,
) -> Bundle:
    """Open a bundle; its arrays are memory-mapped and read-only.

    Args:
        path: the bundle's directory.
        verify: check every file's SHA-256, all values and the self-test pair. Without it only
            the manifest and the array headers are read, and nothing else until it is used.
        expected_geometry_hash: refuse the bundle of any other pad.

    Returns:
        The bundle.

    Raises:
        BundleError: names the file, what is wrong and what to do.
    """
    folder = Path(path)
    if not folder.is_dir():
        what = "is a file, not a bundle directory" if folder.exists() else "does not exist"
        raise BundleError(str(folder), what, "give the path of a bundle directory")
    manifest = read_manifest(folder)
    if expected_geometry_hash not in (None, manifest["geometry_hash"]):
        raise BundleError(
            MANIFEST,
            f"geometry hash {manifest['geometry_hash'][:12]}… belongs to another sensor, "
            f"expected {str(expected_geometry_hash)[:12]}…",
            "load the bundle that was built for this sensor",
        )
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
    return bundle


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
    """The manifest as it is; empty where there is none or it is damaged."""
    try:
        found = json.loads((folder / MANIFEST).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _files_of(folder: Path) -> set[str]:
    """The files that a bundle there consists of; any others are not ours."""
    arrays = _manifest_of(folder).get("arrays")
    entries = arrays.values() if isinstance(arrays, dict) else ()
    return {MANIFEST, LADDER, *(str(e.get("file")) for e in entries if isinstance(e, dict))}


class _Plain:
    """A stream that NumPy writes through, and not past: past it, a full disk has no reason."""

    def __init__(self, stream: IO[bytes]) -> None:
        self.write = stream.write


def _write_array(folder: Path, name: str, array: NDArray[Any]) -> dict[str, Any]:
    file = f"{name}.npy"
    contiguous = np.ascontiguousarray(array)
    with open(folder / file, "wb") as stream:
        np.save(_Plain(stream), contiguous, allow_pickle=False)
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
    """Memory-map one array after checking its header against the manifest."""
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
        # An empty array cannot be mapped; anything else fails here again, with its own reason.
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
