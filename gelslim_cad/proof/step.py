"""STEP files read back: solids, validity, names and volumes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gelslim_cad.geometry.part import Part
from gelslim_cad.proof import ProofResult, at_most, equal
from gelslim_cad.proof.validity import is_valid

VOLUME_LIMIT = 1e-4


@dataclass(frozen=True)
class ReadPart:
    """A named product of a STEP file with its shape (`cadquery.Shape`, mm)."""

    name: str
    shape: Any


def read_step(path: Path) -> list[ReadPart]:
    """Read the products of a STEP file, those of an assembly in their assembled places.

    Returns an empty list if the file cannot be read.
    """
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    with _millimetres():
        reader = STEPCAFControl_Reader()
        reader.SetNameMode(True)
        if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
            return []
        reader.Transfer(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    return [part for label in _free(shapes) for part in _leaves(label, shapes)]


def prove_step(path: Path, parts: Part | Sequence[Part]) -> list[ProofResult]:
    """Reopen a STEP file: one valid solid per part, under its name, volume within 0.01 %."""
    expected = [parts] if isinstance(parts, Part) else list(parts)
    read = read_step(path)
    file = path.name
    solids = sum(len(r.shape.Solids()) for r in read)
    results = [equal(file, "solids", solids, len(expected), "one per part")]
    for part in expected:
        found = [r.shape for r in read if r.name == part.name]
        results.append(equal(file, "name present", len(found), 1, part.name))
        if len(found) == 1:
            results += _prove_part(file, part, found[0])
    return results


def _prove_part(file: str, part: Part, shape: Any) -> list[ProofResult]:
    good = is_valid(shape) and len(shape.Solids()) == 1
    exact, read = part.solid.Volume(), shape.Volume()
    error = abs(read / exact - 1.0) if exact > 0 else float("inf")
    detail = f"{part.name}: {read:.6g} mm3 read, {exact:.6g} mm3 built"
    return [
        equal(file, "valid solid", good, True, part.name),
        at_most(file, "volume", error, VOLUME_LIMIT, detail),
    ]


@contextmanager
def _millimetres() -> Iterator[None]:
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller

    STEPControl_Controller.Init_s()
    before = Interface_Static.CVal_s("xstep.cascade.unit")
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    try:
        yield
    finally:
        Interface_Static.SetCVal_s("xstep.cascade.unit", before)


def _free(shapes: Any) -> list[Any]:
    from OCP.TDF import TDF_LabelSequence

    found = TDF_LabelSequence()
    shapes.GetFreeShapes(found)
    return [found.Value(i) for i in range(1, found.Length() + 1)]


def _leaves(label: Any, shapes: Any) -> list[ReadPart]:
    import cadquery as cq
    from OCP.TDF import TDF_Label, TDF_LabelSequence

    if shapes.IsAssembly_s(label):
        found = TDF_LabelSequence()
        shapes.GetComponents_s(label, found)
        components = [found.Value(i) for i in range(1, found.Length() + 1)]
        return [leaf for c in components for leaf in _leaves(c, shapes)]
    product = TDF_Label()
    if not shapes.GetReferredShape_s(label, product):
        product = label
    elif shapes.IsAssembly_s(product):
        return _leaves(product, shapes)
    shape = cq.Shape.cast(shapes.GetShape_s(label))
    return [ReadPart(_name(product), shape)]


def _name(label: Any) -> str:
    from OCP.TDataStd import TDataStd_Name

    attribute = TDataStd_Name()
    found = label.FindAttribute(TDataStd_Name.GetID_s(), attribute)
    return str(attribute.Get().ToExtString()) if found else ""
