"""A bundle's matrices for other programs: Matrix Market, MATLAB .mat, safetensors.

`stiffness` is K (3n, 3n) in N/mm, unknown 3a+i for displacement i of node a; `free_unknowns` are
the rows that are not bonded, 0-based (1-based in the .mat file, as MATLAB counts).
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.extras import install_command
from gelslim_core.files.replaced_file import replace_file
from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError

Arrays = dict[str, NDArray[Any]]
HEADER_DATE = b"gelslim-bundle"


def export_matrix_market(bundle: Bundle, path: str | os.PathLike[str]) -> None:
    """Write K as a symmetric Matrix Market file, 17 digits. Raises IfemError, OSError."""
    from scipy.io import mmwrite

    def fill(stream: io.BytesIO) -> None:
        comment = f"K in N/mm of geometry {bundle.geometry_hash}; unknown 3a+i of node a"
        mmwrite(stream, bundle.stiffness_matrix, comment, "real", 17, "symmetric")

    _write(path, ".mtx", fill)


def export_mat(bundle: Bundle, path: str | os.PathLike[str]) -> None:
    """Write K and the mesh as a MATLAB 5 file; node and unknown numbers count from 1."""
    from scipy.io import savemat

    def fill(stream: io.BytesIO) -> None:
        arrays = _arrays(bundle)
        for name in ("hexes", "surface_nodes", "bonded_nodes", "free_unknowns"):
            arrays[name] = arrays[name] + 1
        savemat(stream, {"stiffness": bundle.stiffness_matrix.tocsc(), **arrays}, oned_as="column")

    _write(path, ".mat", fill, _undated)


def export_safetensors(bundle: Bundle, path: str | os.PathLike[str]) -> None:
    """Write K (CSR arrays) and the mesh as safetensors, which C++ and Rust read without copies.

    Raises IfemError where the package safetensors is not installed.
    """
    try:
        from safetensors.numpy import save
    except ImportError as error:
        raise IfemError(
            f"writing safetensors needs the package safetensors: {install_command('export')}"
        ) from error
    matrix = bundle.stiffness_matrix
    arrays = {
        "stiffness_data": np.asarray(matrix.data),
        "stiffness_indices": np.asarray(matrix.indices),
        "stiffness_indptr": np.asarray(matrix.indptr),
        **_arrays(bundle),
    }
    facts = {"format": "gelslim-bundle/1", "geometry_hash": bundle.geometry_hash}
    data = save({k: np.ascontiguousarray(v) for k, v in arrays.items()}, facts)
    _write(path, ".safetensors", lambda stream: stream.write(data))


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


def _undated(data: bytes) -> bytes:
    """The file's 116 bytes of text hold a date, which would make two exports differ."""
    return (b"MATLAB 5.0 MAT-file, " + HEADER_DATE).ljust(116) + data[116:]


def _write(
    path: str | os.PathLike[str],
    suffix: str,
    fill: Callable[[io.BytesIO], Any],
    finish: Callable[[bytes], bytes] = bytes,
) -> None:
    """Whole or not at all."""
    target = Path(path)
    if target.suffix != suffix:
        raise IfemError(f"{target}: the name must end in {suffix}")
    stream = io.BytesIO()
    fill(stream)
    replace_file(target, finish(stream.getvalue()), parents=True)
