"""Exports of a bundle's stiffness matrix for other programs: Matrix Market, MATLAB and safetensors.

`stiffness` is K (3n, 3n) in N/mm, where unknown 3a+i is displacement i of node a. `free_unknowns`
are the rows that are not bonded, counted from 0 (in the .mat file from 1, as MATLAB does).
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import replace_file
from gelslim_core.optional_library import load
from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError

Arrays = dict[str, NDArray[Any]]
HEADER_DATE = b"gelslim-bundle"


def export_matrix(bundle: Bundle, path: str | os.PathLike[str]) -> None:
    """Write the stiffness matrix in the format that the ending of the name selects.

    Args:
        bundle: The sensor.
        path: File to write atomically, with an ending of `EXPORTS`: ".mtx" (symmetric Matrix
            Market, 17 digits), ".mat" (MATLAB 5, with the mesh; numbers count from 1) or
            ".safetensors" (CSR arrays and the mesh, which C++ and Rust read without copies).

    Raises:
        IfemError: The ending is unknown.
        MissingLibraryError: The package safetensors is not installed.
        OSError: The file cannot be written.
    """
    target = Path(path)
    if target.suffix not in EXPORTS:
        raise IfemError(
            f"{target}: the ending {target.suffix!r} names no format; use {', '.join(EXPORTS)}",
            field="path",
            value=target.suffix,
        )
    replace_file(target, EXPORTS[target.suffix](bundle), parents=True)


def _matrix_market(bundle: Bundle) -> bytes:
    from scipy.io import mmwrite

    stream = io.BytesIO()
    comment = f"K in N/mm of geometry {bundle.geometry_hash}; unknown 3a+i of node a"
    mmwrite(stream, bundle.stiffness_matrix, comment, "real", 17, "symmetric")
    return stream.getvalue()


def _mat(bundle: Bundle) -> bytes:
    from scipy.io import savemat

    stream = io.BytesIO()
    arrays = _arrays(bundle)
    for name in ("hexes", "surface_nodes", "bonded_nodes", "free_unknowns"):
        arrays[name] = arrays[name] + 1
    savemat(stream, {"stiffness": bundle.stiffness_matrix.tocsc(), **arrays}, oned_as="column")
    # The header of 116 bytes contains a date, which would make two exports differ.
    return (b"MATLAB 5.0 MAT-file, " + HEADER_DATE).ljust(116) + stream.getvalue()[116:]


def _safetensors(bundle: Bundle) -> bytes:
    save = load("safetensors.numpy", "writing safetensors").save
    matrix = bundle.stiffness_matrix
    arrays = {
        "stiffness_data": np.asarray(matrix.data),
        "stiffness_indices": np.asarray(matrix.indices),
        "stiffness_indptr": np.asarray(matrix.indptr),
        **_arrays(bundle),
    }
    facts = {"format": "gelslim-bundle/1", "geometry_hash": bundle.geometry_hash}
    data: bytes = save({k: np.ascontiguousarray(v) for k, v in arrays.items()}, facts)
    return data


EXPORTS: dict[str, Callable[[Bundle], bytes]] = {
    ".mtx": _matrix_market,
    ".mat": _mat,
    ".safetensors": _safetensors,
}
"""Content of an exported file by the ending of its name."""


def _arrays(bundle: Bundle) -> Arrays:
    mesh = bundle.mesh
    free = np.asarray(mesh.free)
    return {
        "nodes_mm": np.asarray(mesh.nodes_mm),
        "hexes": np.asarray(mesh.hexes),
        "surface_nodes": np.asarray(mesh.surface),
        "bonded_nodes": np.asarray(mesh.bonded),
        "free_unknowns": (3 * free[:, None] + np.arange(3)).reshape(-1),
        "element_matrix": np.asarray(bundle.element_matrix),
        "self_test_displacement_mm": np.asarray(bundle.self_test.displacement_mm),
        "self_test_force_n": np.asarray(bundle.self_test.force_n),
    }
