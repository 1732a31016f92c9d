"""One way to every export: the ending of the file and a few words choose the format."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from ifem_export.bundle.bundle import Bundle
from ifem_export.errors import IfemError
from ifem_export.exports.matrix_files import EXPORTS, export_matrix
from ifem_export.exports.solid_mesh import ELEMENT_TYPES, ElementType
from ifem_export.exports.solver_files import LAWS, Law, export_mesh
from ifem_export.exports.surface_matrices import (
    ENDINGS,
    SURFACE_MATRICES,
    SurfaceMatrix,
    export_surface_matrix,
)

MESH_ENDINGS = (".inp", ".msh")
_ALL_ENDINGS = tuple(dict.fromkeys((*EXPORTS, *ENDINGS, *MESH_ENDINGS)))


@dataclass(frozen=True)
class ExportOptions:
    """What to write; None where the default holds.

    Attributes:
        matrix: Condensed matrix; None for the stiffness of the whole pad, or for a mesh.
        element: Type of the elements of a mesh; None for that of the bundle.
        law: Material of a .inp; None for linear.
    """

    matrix: SurfaceMatrix | None = None
    element: ElementType | None = None
    law: Law | None = None


def export_options(
    path: str | os.PathLike[str],
    *,
    matrix: str | None = None,
    element: str | None = None,
    law: str | None = None,
) -> ExportOptions:
    """Check that the options are known and belong to the ending of the file.

    Args:
        path: File to write later.
        matrix: As in `ExportOptions`.
        element: As in `ExportOptions`.
        law: As in `ExportOptions`.

    Returns:
        The options.

    Raises:
        IfemError: The ending or an option is unknown, or the format has no such option.
    """
    ending = Path(path).suffix
    if ending not in _ALL_ENDINGS:
        raise IfemError(
            f"{path}: the ending {ending!r} names no format; use {', '.join(_ALL_ENDINGS)}",
            field="path",
            value=ending,
        )
    _require("matrix", matrix, SURFACE_MATRICES, ending, ENDINGS)
    _require("element", element, ELEMENT_TYPES, ending, MESH_ENDINGS)
    _require("law", law, LAWS, ending, (".inp",))
    if matrix is None and ending not in (*EXPORTS, *MESH_ENDINGS):
        raise IfemError(
            f"{path}: a file {ending} holds a matrix of the surface; "
            f"choose matrix {' or '.join(SURFACE_MATRICES)}",
            field="matrix",
        )
    return ExportOptions(
        cast("SurfaceMatrix | None", matrix),
        cast("ElementType | None", element),
        cast("Law | None", law),
    )


def export_bundle(bundle: Bundle, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the file.

    Args:
        bundle: The sensor.
        path: File to write atomically.
        options: As `export_options` gives them for this path.

    Raises:
        IfemError: The pad cannot be exported so.
        MissingLibraryError: The package safetensors is not installed.
        OSError: The file cannot be written.
    """
    if options.matrix is not None:
        export_surface_matrix(bundle, path, options.matrix)
    elif Path(path).suffix in MESH_ENDINGS:
        export_mesh(bundle, path, options.element, options.law or "linear")
    else:
        export_matrix(bundle, path)


def _require(
    option: str, value: str | None, known: tuple[str, ...], ending: str, endings: tuple[str, ...]
) -> None:
    if value is None:
        return
    if value not in known:
        raise IfemError(
            f"{option} {value!r}: must be one of {', '.join(known)}", field=option, value=value
        )
    if ending not in endings:
        raise IfemError(
            f"{option} {value!r}: a file {ending} has no such choice, only {' and '.join(endings)}",
            field=option,
            value=value,
        )
