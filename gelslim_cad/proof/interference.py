"""Parts of an assembly that take up the same space."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.result import ProofResult, at_most, equal

TOLERANCE_MM3 = 1e-3
"""Common volume that counts as touching: slivers of a Boolean between coincident faces."""

Mapper = Callable[[Callable[["_Pair"], "Common"], Iterable["_Pair"]], Iterable["Common"]]
_Pair = tuple[bytes, bytes]


@dataclass(frozen=True)
class Common:
    """Common volume of two solids in mm3 and how it was found."""

    volume_mm3: float
    method: str


@dataclass(frozen=True)
class Interference:
    """Two parts whose common volume exceeds the tolerance."""

    first: str
    second: str
    volume_mm3: float
    method: str


def interferences(
    parts: Sequence[Part], *, tolerance_mm3: float = TOLERANCE_MM3, mapper: Mapper = map
) -> list[Interference]:
    """List the pairs of parts whose solids overlap; touching faces do not count.

    Pairs whose bounding boxes are apart are skipped. `mapper` may be the `map` of a process
    pool: solids travel to it as bytes.
    """
    from gelslim_cad.export.brep import shape_to_bytes

    pairs = candidates(parts)
    needed = sorted({index for pair in pairs for index in pair})
    packed = {index: shape_to_bytes(parts[index].solid) for index in needed}
    found = mapper(common_volume, [(packed[a], packed[b]) for a, b in pairs])
    return [
        Interference(parts[a].name, parts[b].name, common.volume_mm3, common.method)
        for (a, b), common in zip(pairs, found, strict=True)
        if not common.volume_mm3 <= tolerance_mm3
    ]


def prove_assembly(
    parts: Sequence[Part],
    *,
    file: str = "assembly",
    tolerance_mm3: float = TOLERANCE_MM3,
    mapper: Mapper = map,
) -> list[ProofResult]:
    """One result for the whole assembly and one for each pair that interferes."""
    bad = interferences(parts, tolerance_mm3=tolerance_mm3, mapper=mapper)
    pairs = len(parts) * (len(parts) - 1) // 2
    return [
        equal(file, "interfering pairs", len(bad), 0, f"of {pairs} pairs"),
        *(
            at_most(
                file,
                "common volume",
                b.volume_mm3,
                tolerance_mm3,
                f"{b.first} and {b.second} share {b.volume_mm3:.4g} mm3 ({b.method})",
            )
            for b in bad
        ),
    ]


def candidates(parts: Sequence[Part]) -> list[tuple[int, int]]:
    """Pairs of indices whose axis-aligned boxes overlap by more than a touch."""
    boxes = [_box(p.solid) for p in parts]
    return [(a, b) for a, b in combinations(range(len(parts)), 2) if not boxes[a].IsOut(boxes[b])]


def _box(shape: Any) -> Any:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(shape.wrapped, box, False)
    return box


def common_volume(pair: _Pair) -> Common:
    """Common volume of two solids given as bytes (`shape_to_bytes`).

    By Boolean on the exact solids; where that fails or contradicts itself, on fine meshes.
    """
    from gelslim_cad.export.brep import shape_from_bytes

    first, second = (shape_from_bytes(data) for data in pair)
    most = min(first.Volume(), second.Volume())
    for fuzzy_mm in (0.0, 1e-5):
        volume = _boolean(first, second, fuzzy_mm)
        if volume is not None and -1e-6 * most <= volume <= most * (1 + 1e-6):
            return Common(max(volume, 0.0), "exact")
    return Common(_mesh_common(first, second), "mesh")


def _boolean(first: Any, second: Any, fuzzy_mm: float) -> float | None:
    import cadquery as cq
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.Standard import Standard_Failure
    from OCP.TopTools import TopTools_ListOfShape

    sides = []
    for shape in (first, second):
        side = TopTools_ListOfShape()
        side.Append(shape.wrapped)
        sides.append(side)
    common = BRepAlgoAPI_Common()
    common.SetArguments(sides[0])
    common.SetTools(sides[1])
    common.SetNonDestructive(True)
    common.SetRunParallel(False)
    if fuzzy_mm:
        common.SetFuzzyValue(fuzzy_mm)
    try:
        common.Build()
    except Standard_Failure:
        return None
    if not common.IsDone() or common.Shape().IsNull():
        return None
    solids = cq.Shape.cast(common.Shape()).Solids()
    return float(sum(s.Volume() for s in solids)) if all(s.isValid() for s in solids) else None


def _mesh_common(first: Any, second: Any) -> float:
    import manifold3d
    import numpy as np

    from gelslim_cad.export.mesh import tessellate

    bodies = []
    for shape in (first, second):
        mesh = tessellate(shape, 0.01, 5.0)
        vertices, faces = mesh.vertices_mm.astype(np.float32), mesh.faces.astype(np.uint32)
        bodies.append(manifold3d.Manifold(manifold3d.Mesh(vertices, faces)))
    if any(b.status() != manifold3d.Error.NoError for b in bodies):
        return float("nan")
    return float((bodies[0] ^ bodies[1]).volume())
