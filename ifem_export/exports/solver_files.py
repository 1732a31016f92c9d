"""The pad as input of other finite-element programs: Abaqus and CalculiX (.inp), gmsh (.msh).

Units are mm, N and MPa, and t/mm³ for the density. Nodes and elements count from 1. The gel's
material is linear, or neo-Hookean with the energy W = C₁₀(Ī₁ - 3) + (J - 1)²/D₁ of the twin, where
C₁₀ = G/2 and D₁ = 2/κ. A cell that the gel fills in part has a material of its own, whose stiffness
is scaled as in the bundle.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import replace_file
from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.exports.solid_mesh import QUADRATIC, ElementType, SolidMesh, solid_mesh

Law = Literal["linear", "neo_hookean"]
LAWS: tuple[Law, ...] = get_args(Law)

ELEMENT_OF: dict[Formulation, ElementType] = {
    "full": "C3D8",
    "bbar": "C3D8",
    "incompatible": "C3D8I",
}
"""The type nearest to a formulation. Abaqus' C3D8 has a mean dilatation as `bbar`; CalculiX's does
not, and is that of `full`."""
_KG_M3 = 1e-12
"""t/mm³."""
_PER_LINE = 16
"""Numbers that a line of an input file may hold."""
_MSH_HEX8, _MSH_HEX20, _MSH_QUAD4 = 5, 17, 3
_MSH_HEX20_ORDER = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14,
)  # fmt: skip
"""Nodes of a C3D20 in the order of gmsh's element 17."""
_GEL, _BONDED, _SURFACE = 1, 2, 3


def export_mesh(
    bundle: Bundle,
    path: str | os.PathLike[str],
    element: ElementType | None = None,
    law: Law = "linear",
) -> None:
    """Write mesh, sets and material of a pad; loads and steps are the reader's own.

    Args:
        bundle: The sensor.
        path: File to write atomically, NAME.inp or NAME.msh. A .msh has no material.
        element: Type of the elements; by default that of the bundle's formulation.
        law: Material of the .inp.

    Raises:
        IfemError: The ending, the type of the elements or the law is unknown.
        OSError: The file cannot be written.
    """
    target = Path(path)
    if law not in LAWS:
        raise IfemError(f"law {law!r}: must be one of {', '.join(LAWS)}", field="law", value=law)
    mesh = solid_mesh(bundle.mesh, element or ELEMENT_OF[bundle.formulation])
    if target.suffix == ".inp":
        lines = inp_lines(mesh, bundle.material, law, bundle.geometry_hash)
    elif target.suffix == ".msh":
        lines = msh_lines(mesh)
    else:
        raise IfemError(
            f"{target}: the ending {target.suffix!r} names no format; use .inp or .msh",
            field="path",
            value=target.suffix,
        )
    replace_file(target, ("\n".join(lines) + "\n").encode("ascii"), parents=True)


def inp_lines(mesh: SolidMesh, gel: Material, law: Law, geometry_hash: str) -> Iterator[str]:
    """Lines of an input file for Abaqus or CalculiX, without loads and steps.

    Args:
        mesh: The pad's mesh.
        gel: The gel.
        law: Its material law.
        geometry_hash: Told in the heading.

    Yields:
        A line each.
    """
    yield "*HEADING"
    yield f"Gel pad of geometry {geometry_hash}, units mm, N, MPa"
    yield "*NODE, NSET=ALL"
    for number, (x, y, z) in enumerate(mesh.nodes_mm.tolist(), 1):
        yield f"{number}, {x:.12e}, {y:.12e}, {z:.12e}"
    yield f"*ELEMENT, TYPE={mesh.element}, ELSET=PAD"
    for number, cell in enumerate((mesh.cells + 1).tolist(), 1):
        yield from _wrapped([number, *cell], comma=True)
    for name, nodes in mesh.sets.items():
        yield f"*NSET, NSET={name}"
        yield from _wrapped((nodes + 1).tolist())
    yield "*SURFACE, NAME=OUTER_FACES, TYPE=ELEMENT"
    yield from (f"{number}, S2" for number in (mesh.top_cells + 1).tolist())
    yield from _materials(mesh, gel, law)
    yield "*BOUNDARY"
    yield "BONDED, 1, 3, 0"


def msh_lines(mesh: SolidMesh) -> Iterator[str]:
    """Lines of a file in gmsh's format 2.2 with the groups GEL, BONDED and SURFACE.

    Args:
        mesh: The pad's mesh.

    Yields:
        A line each.
    """
    yield from ("$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "3")
    yield from (f'3 {_GEL} "GEL"', f'2 {_BONDED} "BONDED"', f'2 {_SURFACE} "SURFACE"')
    yield from ("$EndPhysicalNames", "$Nodes", str(len(mesh.nodes_mm)))
    for number, (x, y, z) in enumerate(mesh.nodes_mm.tolist(), 1):
        yield f"{number} {x!r} {y!r} {z!r}"
    quadratic = mesh.element in QUADRATIC
    cells = mesh.cells[:, _MSH_HEX20_ORDER] if quadratic else mesh.cells
    blocks: list[tuple[int, int, NDArray[np.int64]]] = [
        (_MSH_QUAD4, _BONDED, mesh.lower_faces),
        (_MSH_QUAD4, _SURFACE, mesh.upper_faces),
        (_MSH_HEX20 if quadratic else _MSH_HEX8, _GEL, cells),
    ]
    yield from ("$EndNodes", "$Elements", str(sum(len(block) for _, _, block in blocks)))
    number = 0
    for kind, group, block in blocks:
        for nodes in (block + 1).tolist():
            number += 1
            yield f"{number} {kind} 2 {group} {group} {' '.join(map(str, nodes))}"
    yield "$EndElements"


def _materials(mesh: SolidMesh, gel: Material, law: Law) -> Iterator[str]:
    factors, group = np.unique(mesh.fill, return_inverse=True)
    for index, factor in enumerate(factors.tolist()):
        name = "GEL" if factor == 1.0 else f"GEL_{index + 1}"
        yield f"*ELSET, ELSET={name}"
        yield from _wrapped((1 + np.flatnonzero(group == index)).tolist())
        yield f"*MATERIAL, NAME={name}"
        if law == "linear":
            yield "*ELASTIC"
            yield f"{factor * gel.youngs_modulus_mpa:.12e}, {gel.poissons_ratio:.12e}"
        else:
            yield "*HYPERELASTIC, NEO HOOKE"
            shear, bulk = factor * gel.shear_modulus_mpa, factor * gel.bulk_modulus_mpa
            yield f"{shear / 2:.12e}, {2 / bulk:.12e}"
        yield "*DENSITY"
        yield f"{gel.density_kg_m3 * _KG_M3:.12e}"
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"


def _wrapped(numbers: Sequence[int], *, comma: bool = False) -> Iterator[str]:
    """The numbers in lines of at most 16; `comma` marks that an entry goes on in the next line."""
    for first in range(0, len(numbers), _PER_LINE):
        goes_on = comma and first + _PER_LINE < len(numbers)
        yield ", ".join(map(str, numbers[first : first + _PER_LINE])) + ("," if goes_on else "")
