"""The pad condensed to its outer surface, as dense matrices for other programs.

Stiffness S and compliance C = S⁻¹ join forces and displacements of the surface alone, F = S u and
u = C F, where unknown 3a+i is component i of surface node a.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from gelslim_core.files.replaced_file import replace_file
from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError
from ifem_export.exports.matrix_files import HEADER_DATE
from ifem_export.operators.condensed_operators import condensed_stiffness
from ifem_export.operators.crowned_system import pad_system

SurfaceMatrix = Literal["surface_stiffness", "surface_compliance"]
SURFACE_MATRICES: tuple[SurfaceMatrix, ...] = get_args(SurfaceMatrix)
ENDINGS = (".npz", ".mat")
MOST_SURFACE_NODES = 8000
"""A dense matrix of so many nodes has 4.6 GB."""


def surface_matrix(bundle: Bundle, kind: SurfaceMatrix) -> NDArray[np.float64]:
    """S in N/mm or C in mm/N, (3c, 3c) and symmetric, of the c nodes of the outer surface.

    Args:
        bundle: The sensor.
        kind: Which of the two.

    Returns:
        The matrix.

    Raises:
        IfemError: The kind is unknown, or the surface has more than `MOST_SURFACE_NODES` nodes.
        MeshError: The pad is neither flat nor crowned.
    """
    if kind not in SURFACE_MATRICES:
        raise IfemError(
            f"matrix {kind!r}: must be one of {', '.join(SURFACE_MATRICES)}",
            field="matrix",
            value=kind,
        )
    system = pad_system(bundle.mesh, np.asarray(bundle.element_matrix))
    if system.columns > MOST_SURFACE_NODES:
        raise IfemError(
            f"the surface has {system.columns} nodes, and a dense matrix of more than "
            f"{MOST_SURFACE_NODES} is not written: export the sparse matrix of all nodes (.mtx)",
            field="matrix",
            value=system.columns,
        )
    stiffness = condensed_stiffness(system, np.float64)
    if kind == "surface_stiffness":
        return stiffness
    inverse = linalg.inv(stiffness, overwrite_a=True)
    return np.asarray((inverse + inverse.T) / 2)


def export_surface_matrix(
    bundle: Bundle, path: str | os.PathLike[str], kind: SurfaceMatrix
) -> None:
    """Write a condensed matrix with the places of its nodes.

    The file has the arrays `surface_stiffness` or `surface_compliance`, and `nodes_mm` (c, 3) with
    the points of the outer surface in the order of the unknowns.

    Args:
        bundle: The sensor.
        path: File to write atomically, NAME.npz (NumPy) or NAME.mat (MATLAB 5).
        kind: The matrix.

    Raises:
        IfemError: The ending or the kind is unknown, or the matrix is too large.
        OSError: The file cannot be written.
    """
    target = Path(path)
    if target.suffix not in ENDINGS:
        raise IfemError(
            f"{target}: the ending {target.suffix!r} names no format of a surface matrix; "
            f"use {' or '.join(ENDINGS)}",
            field="path",
            value=target.suffix,
        )
    arrays = {kind: surface_matrix(bundle, kind), "nodes_mm": surface_points_mm(bundle)}
    stream = io.BytesIO()
    if target.suffix == ".npz":
        np.savez(stream, **arrays)  # type: ignore[arg-type]
        data = stream.getvalue()
    else:
        from scipy.io import savemat

        savemat(stream, arrays, oned_as="column")
        data = (b"MATLAB 5.0 MAT-file, " + HEADER_DATE).ljust(116) + stream.getvalue()[116:]
    replace_file(target, data, parents=True)


def surface_points_mm(bundle: Bundle) -> NDArray[np.float64]:
    """Points (c, 3) of the outer surface: its nodes, raised to a crown where the pad has one."""
    mesh = bundle.mesh
    points = np.array(mesh.nodes_mm)[np.asarray(mesh.surface)]
    if mesh.surface_shift is not None:
        points[:, 2] += np.asarray(mesh.surface_shift) * mesh.cell_size_mm[2]
    return points
