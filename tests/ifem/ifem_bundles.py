"""A small complete bundle for the tests, and ways to damage a stored one.

Cells are not square and the markers have two pitches, so that x and y cannot be exchanged.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from ifem_export.bundle.bundle import build_bundle
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

MARKERS = np.stack(np.meshgrid(np.arange(-3, 4) * 0.9, np.arange(-2, 3) * 0.7), -1).reshape(-1, 2)
CAMERA = {"model": "OV5647", "matrix_px": [[600.0, 0, 320], [0, 600.0, 240], [0, 0, 1]]}


def make_bundle(gel, **options):
    mesh, _ = build_pad_mesh(RoundedRectangle(8.0, 6.0, 1.0), 2.0, pitch_mm=(0.4, 0.5))
    return build_bundle(
        mesh,
        gel,
        "full",
        marker_positions_mm=MARKERS,
        marker_arrays={"row": np.arange(35) // 7, "kind": ["dot"] * 34 + ["anchor"]},
        camera=CAMERA,
        spec_hash="5pec",
        **options,
    )


def flip_byte(path: Path, at: int = -100) -> None:
    content = bytearray(path.read_bytes())
    content[at] ^= 0x10
    path.write_bytes(content)


def reseal(folder: Path, change=lambda manifest: None, rehash: bool = True) -> None:
    """Make a damaged bundle look honest: only checks of its content can catch it now."""
    manifest = json.loads((folder / "manifest.json").read_text())
    change(manifest)
    if rehash:
        for entry in manifest["arrays"].values():
            file = folder / entry["file"]
            array = np.load(file)
            entry["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
            entry["dtype"], entry["shape"] = array.dtype.str, list(array.shape)
    manifest.pop("manifest_sha256")
    text = json.dumps(manifest, sort_keys=True, separators=(",", ":"))
    manifest["manifest_sha256"] = hashlib.sha256(text.encode()).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))


def edit(folder: Path, name: str, change) -> None:
    array = np.load(folder / f"{name}.npy")
    changed = change(array)
    np.save(folder / f"{name}.npy", array if changed is None else changed)
