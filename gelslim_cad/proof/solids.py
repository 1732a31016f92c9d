"""Checks on solids: parts that overlap, and the mould's cavity against the gel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from gelslim_cad.geometry.part import Part
from gelslim_cad.proof import ProofResult, at_most

TOLERANCE_MM3 = 1e-3
"""A common volume up to this counts as touching: a Boolean leaves slivers on coincident faces."""


@dataclass(frozen=True)
class Interference:
    """Two parts whose common volume exceeds the tolerance."""

    first: str
    second: str
    volume_mm3: float


def interferences(parts: Sequence[Part]) -> list[Interference]:
    """List the pairs of parts whose solids overlap; touching faces do not count.

    Pairs whose bounding boxes are apart are skipped. Of the others one Boolean compares a part
    with several at once. Where their common volume is within the tolerance, so is that of each
    pair; the other pairs are measured one by one.
    """
    volumes = [float(p.solid.Volume()) for p in parts]
    found = []
    for one, others in sorted(_suspects([p.solid for p in parts])):
        a, b = parts[one], parts[others]
        volume = _common_volume(a.solid, b.solid, min(volumes[one], volumes[others]))
        if not volume <= TOLERANCE_MM3:  # a volume that is not a number counts too
            found.append(Interference(a.name, b.name, volume))
    return found


def _suspects(solids: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """Pairs of solids, smaller number first, that no Boolean with several has shown to be apart."""
    boxes = [bounding_box(solid) for solid in solids]
    left = {(a, b) for a, b in combinations(range(len(solids)), 2) if not boxes[a].IsOut(boxes[b])}
    while left:
        near: dict[int, list[int]] = {}
        for a, b in sorted(left):
            near.setdefault(a, []).append(b)
            near.setdefault(b, []).append(a)
        one = max(near, key=lambda number: len(near[number]))
        for group in _apart(near[one], boxes):
            volume = _boolean([solids[one]], [solids[other] for other in group], 0.0)
            if volume is None or not 0.0 <= volume <= TOLERANCE_MM3:
                yield from ((min(one, other), max(one, other)) for other in group)
        left = {pair for pair in left if one not in pair}


def _apart(numbers: Sequence[int], boxes: Sequence[Any]) -> list[list[int]]:
    """Groups of solids whose boxes are apart from those of the others in the group.

    Tools of a Boolean that share faces would be divided by each other.
    """
    groups: list[list[int]] = []
    for number in numbers:
        for group in groups:
            if all(boxes[number].IsOut(boxes[other]) for other in group):
                group.append(number)
                break
        else:
            groups.append([number])
    return groups


def bounding_box(shape: Any) -> Any:
    """A box (OCP.Bnd.Bnd_Box) around a shape, which may be wider than it."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(shape.wrapped, box, False)
    return box


def common_volume(first: Any, second: Any) -> float:
    """Common volume of two solids in mm³.

    A Boolean of the exact solids gives it. Where that fails or gives more than the smaller
    solid's volume, fine meshes of both are intersected instead.
    """
    return _common_volume(first, second, min(first.Volume(), second.Volume()))


def _common_volume(first: Any, second: Any, most: float) -> float:
    """As `common_volume`, of which no more than the volume `most` can be common."""
    for fuzzy_mm in (0.0, 1e-5):
        volume = _boolean([first], [second], fuzzy_mm)
        if volume is not None and -1e-6 * most <= volume <= most * (1 + 1e-6):
            return max(volume, 0.0)
    return _mesh_common(first, second)


def _boolean(first: Sequence[Any], second: Sequence[Any], fuzzy_mm: float) -> float | None:
    """Volume that is both in one of the first and in one of the second solids, None on failure."""
    import cadquery as cq
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.Standard import Standard_Failure
    from OCP.TopTools import TopTools_ListOfShape

    sides = []
    for shapes in (first, second):
        side = TopTools_ListOfShape()
        for shape in shapes:
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

    from gelslim_cad.export.mesh import tessellate

    bodies = []
    for shape in (first, second):
        mesh = tessellate(shape, 0.01, 5.0)
        vertices, faces = mesh.vertices_mm.astype(np.float32), mesh.faces.astype(np.uint32)
        bodies.append(manifold3d.Manifold(manifold3d.Mesh(vertices, faces)))
    if any(b.status() != manifold3d.Error.NoError for b in bodies):
        return float("nan")
    return float((bodies[0] ^ bodies[1]).volume())


CAVITY_LIMIT = 1e-6


def prove_mould(cavity: Any, gel: Any, scale: float) -> list[ProofResult]:
    """Check that a cavity is the gel scaled by `scale` (1 / (1 - shrinkage)), to 1e-6.

    Compared are volume, area and the principal moments of inertia, relative to the gel's times
    `scale` to the 3rd, 2nd and 5th power; none depends on where the two solids lie. The largest
    relative difference of each is reported.
    """
    volume = _relative(cavity.Volume(), gel.Volume() * scale**3)
    area = _relative(cavity.Area(), gel.Area() * scale**2)
    moments = np.array(_moments(gel)) * scale**5
    inertia = max(_relative(c, g) for c, g in zip(_moments(cavity), moments, strict=True))
    shown = f"scale {scale:.9g}"
    return [
        at_most("mould", "cavity volume = gel x scale^3", volume, CAVITY_LIMIT, shown),
        at_most("mould", "cavity area = gel x scale^2", area, CAVITY_LIMIT, shown),
        at_most("mould", "cavity inertia = gel x scale^5", inertia, CAVITY_LIMIT, shown),
    ]


def _relative(value: float, expected: float) -> float:
    return abs(value / expected - 1.0) if expected > 0 else float("inf")


def _moments(shape: Any) -> list[float]:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape.wrapped, properties)
    return sorted(properties.PrincipalProperties().Moments())
