"""manifest.json of a `gelslim-bundle/1` directory, and ladder.json with its operators."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import BundleError, IfemError
from ifem_export.operators.operator_ladder import OperatorLadder

FORMAT = "gelslim-bundle/1"
MANIFEST = "manifest.json"
LADDER = "ladder.json"
REBUILD = "rebuild the bundle from its spec (gelslim bundle SPEC)"
ADJOINT_VERSION = 1
"""Meaning of the array `adjoint_fields`; readers compute the fields where they know another."""
_SEAL = "manifest_sha256"
_MAX_BYTES = 16_000_000
_FILE_NAME = re.compile(r"[a-z][a-z0-9_]{0,80}\.npy")
_SECTIONS: dict[str, tuple[type, ...]] = {
    "units": (dict,),
    "conventions": (dict,),
    "versions": (dict,),
    "spec_hash": (str,),
    "geometry_hash": (str,),
    "material": (dict,),
    "mesh": (dict,),
    "element": (dict,),
    "stiffness": (dict,),
    "markers": (dict, type(None)),
    "camera": (dict,),
    "arrays": (dict,),
}
_UNITS = {"length": "mm", "force": "N", "modulus": "MPa", "stiffness": "N/mm", "density": "kg/m3"}
_CONVENTIONS = {
    "frame": "origin at the centre of the gel's outer surface; x along the finger towards the "
    "tip, y across it, z out of the gel",
    "unknowns": "3a+i is displacement i (x, y, z) of node a",
    "node_order": "corners of existing cells, x fastest, z slowest",
    "cell_order": "existing cells, x fastest, z slowest",
    "corner_order": "VTK_HEXAHEDRON",
    "occupancy": "axes (x, y, z); with the element matrix it determines the stiffness matrix",
    "cell_fill": "where present, what each cell's element matrix is multiplied by",
    "surface_shift": "where present, cells by which the outer surface lies above its nodes",
    "adjoint_fields": "where present, (6, surface nodes, 3): forces that hold the surface in unit "
    "translations (N/mm) and rotations (N/rad) about x, y and z through the origin; their products "
    "with a motion of the surface are its force and torque",
    "forces": "external force on the gel; on bonded nodes the reaction of the acrylic",
}


def describe(bundle: Bundle, arrays: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Manifest of a bundle whose arrays have been written.

    Args:
        bundle: The bundle.
        arrays: For each array its file, sha256, dtype and shape.
    """
    mesh, markers = bundle.mesh, bundle.markers
    manifest: dict[str, Any] = {
        "format": FORMAT,
        "units": _UNITS,
        "conventions": _CONVENTIONS,
        "versions": _versions(),
        "spec_hash": bundle.spec_hash,
        "geometry_hash": bundle.geometry_hash,
        "material": {
            "youngs_modulus_mpa": bundle.material.youngs_modulus_mpa,
            "poissons_ratio": bundle.material.poissons_ratio,
            "density_kg_m3": bundle.material.density_kg_m3,
        },
        "mesh": {
            "cells": list(mesh.occupancy.shape),
            "cell_size_mm": list(mesh.cell_size_mm),
            "origin_mm": list(mesh.origin_mm),
            "nodes": mesh.n_nodes,
            "elements": mesh.n_elements,
            "bonded_nodes": len(mesh.bonded),
            "free_nodes": len(mesh.free),
            "surface_nodes": len(mesh.surface),
            "side_nodes": len(mesh.sides),
            "weighted": mesh.fill is not None,
            "crowned": mesh.surface_shift is not None,
        },
        "element": {"type": "hex8", "formulation": bundle.formulation},
        "stiffness": {
            "stored": bundle.stiffness is not None,
            "rows": 3 * mesh.n_nodes,
            "nonzeros": None if bundle.stiffness is None else int(bundle.stiffness.nnz),
        },
        "markers": None
        if markers is None
        else {
            "count": len(markers.positions_mm),
            "arrays": sorted(markers.arrays),
            "thin_plate": markers.spline is not None,
        },
        "camera": dict(bundle.camera),
        "outline": None if bundle.outline is None else asdict(bundle.outline),
        "tolerances": dict(bundle.tolerances),
        "light": sorted(bundle.light) or None,
        "adjoint": None if bundle.stored_adjoint is None else {"version": ADJOINT_VERSION},
        "ladder": _ladder_section(bundle),
        "arrays": arrays,
    }
    if bundle.skin is not None:
        manifest["skin"] = bundle.skin.to_record()
    if bundle.imported is not None:
        manifest["imported"] = bundle.imported.to_record()
    return {**manifest, _SEAL: _seal(manifest)}


def to_json(manifest: dict[str, Any]) -> str:
    """The manifest as JSON text, the same for the same manifest."""
    return json.dumps(manifest, indent=2, sort_keys=True, allow_nan=False) + "\n"


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read manifest.json and check its format, seal and sections.

    Raises:
        BundleError: The file is missing, unreadable, altered or of another format.
    """
    manifest = _parse(folder)
    found = manifest.get("format")
    if found != FORMAT:
        remedy = REBUILD
        if isinstance(found, str) and found.startswith("gelslim-bundle/"):
            remedy = f"use the release that wrote it, or {REBUILD}"
        raise BundleError(MANIFEST, f"format is {found!r}, this release reads {FORMAT!r}", remedy)
    sealed = manifest.pop(_SEAL, None)
    if sealed != _seal(manifest):
        raise BundleError(
            MANIFEST, "its content does not match its own SHA-256, it was altered", REBUILD
        )
    for name, types in _SECTIONS.items():
        if not isinstance(manifest.get(name, ...), types):
            raise BundleError(MANIFEST, f"section {name!r} is missing or malformed", REBUILD)
    for name, entry in manifest["arrays"].items():
        _check_entry(name, entry)
    return manifest


def _parse(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise BundleError(MANIFEST, f"is larger than {_MAX_BYTES} bytes", REBUILD)
        manifest = json.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise BundleError(
            MANIFEST, f"is missing from {folder}", f"check the path or {REBUILD}"
        ) from None
    except OSError as error:
        raise BundleError(
            MANIFEST, f"cannot be read ({error.strerror})", "check the permissions"
        ) from error
    except (ValueError, RecursionError) as error:
        raise BundleError(MANIFEST, f"is not valid JSON ({error})", REBUILD) from error
    if not isinstance(manifest, dict):
        raise BundleError(MANIFEST, "is not a JSON object", REBUILD)
    return manifest


def _check_entry(name: str, entry: Any) -> None:
    try:
        file, digest, dtype, shape = (entry[k] for k in ("file", "sha256", "dtype", "shape"))
        good = (
            _FILE_NAME.fullmatch(file) is not None
            and re.fullmatch(r"[0-9a-f]{64}", digest) is not None
            and np.dtype(dtype).kind in "biufU"
            and all(isinstance(size, int) and size >= 0 for size in shape)
        )
    except (KeyError, TypeError, ValueError):
        good = False
    if not good:
        raise BundleError(MANIFEST, f"entry of array {name!r} is malformed", REBUILD)


def _seal(manifest: dict[str, Any]) -> str:
    text = json.dumps(manifest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _versions() -> dict[str, str]:
    try:
        own = metadata.version("gelslim-cad")
    except metadata.PackageNotFoundError:
        own = "unknown"
    return {"gelslim-cad": own, "numpy": np.__version__, "scipy": scipy.__version__}


def ladder_json(bundle: Bundle) -> bytes:
    """The ladder as JSON; empty if none was measured."""
    if bundle.ladder is None:
        return b""
    record = bundle.ladder.to_record()
    return (json.dumps(record, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def _ladder_section(bundle: Bundle) -> dict[str, Any] | None:
    """The section of the manifest on the ladder."""
    data = ladder_json(bundle)
    if not data:
        return None
    digest = hashlib.sha256(data).hexdigest()
    return {"file": LADDER, "sha256": digest, "operator": bundle.operator}


def read_ladder(folder: Path, manifest: dict[str, Any]) -> tuple[OperatorLadder | None, str]:
    """The ladder and the label of the default operator.

    Raises:
        BundleError: The file is missing, altered or malformed.
    """
    section = manifest.get("ladder")
    if section is None:
        return None, ""
    try:
        data = (folder / LADDER).read_bytes()
    except OSError as error:
        raise BundleError(LADDER, f"cannot be read ({error.strerror})", REBUILD) from error
    if not isinstance(section, dict) or hashlib.sha256(data).hexdigest() != section.get("sha256"):
        raise BundleError(LADDER, "its SHA-256 differs from the manifest, it was altered", REBUILD)
    try:
        return OperatorLadder.from_record(json.loads(data)), str(section.get("operator", ""))
    except (ValueError, IfemError) as error:
        raise BundleError(LADDER, str(error), REBUILD) from error
