"""STEP files: one part, or an assembly of named and coloured parts.

The bytes depend on the parts alone. OCCT would add a time stamp, a counter that runs through
the process, styles in the order of memory addresses, and the last bits of Boolean results; so
header and identifiers are set here, styles are written part by part, and reals are rounded.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import bare_copy, only_solid
from gelslim_cad.geometry.part import Part

SCHEMA = "AP242DIS"

DECIMALS = 10
"""Reals are rounded to 1e-10 mm, a thousandth of OCCT's modelling tolerance."""

TIME_STAMP = "1970-01-01T00:00:00"

_REAL = re.compile(r"-?\d+\.\d*(?:E[+-]?\d+)?")
_MARK, _CUT = "\0", "\1"
"""Characters that no STEP file holds: the place of a string, and the end of a value."""
_CONTINUATION = re.compile(r"(?<!;)\n *")


def step_bytes(parts: Part | Sequence[Part], *, name: str = "assembly") -> bytes:
    """Write a part, or an assembly called `name` of several parts, as STEP in mm.

    Colours are taken as sRGB and alpha becomes STEP transparency. Every part is written where
    it is assembled.

    Args:
        parts: One part, or the parts of an assembly.
        name: Name of the assembly.

    Returns:
        Content of the file, as AP242.

    Raises:
        ExportError: There are no parts, two share a name, or one is not a single solid.
    """
    single = isinstance(parts, Part)
    chosen = [parts] if isinstance(parts, Part) else list(parts)
    _check_names(chosen)
    solids = [bare_copy(only_solid(p.solid, p.name)).wrapped for p in chosen]
    title = chosen[0].name if single else name
    with _settings():
        raw = _write(chosen, solids, title, single)
    return _normalised(raw.decode("ascii")).encode("ascii")


def _check_names(parts: Sequence[Part]) -> None:
    if not parts:
        raise ExportError("STEP: 0 parts given, at least 1 needed")
    names = [p.name for p in parts]
    repeated = sorted({n for n in names if names.count(n) > 1})
    if repeated:
        raise ExportError(f"STEP: part name {repeated[0]!r} used twice; give each part its own")


@contextmanager
def _settings() -> Iterator[None]:
    """Set OCCT's writer settings, which hold for the whole process, and restore them."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller

    STEPControl_Controller.Init_s()
    texts = {"write.step.schema": SCHEMA, "write.step.unit": "MM"}
    numbers = {
        "write.precision.mode": -1,
        "write.surfacecurve.mode": 1,
        "write.step.assembly": 1,
        "write.step.vertex.mode": 0,
        "write.step.nonmanifold": 0,
        "write.stepcaf.subshapes.name": 0,
    }
    old_texts = {key: Interface_Static.CVal_s(key) for key in texts}
    old_numbers = {key: Interface_Static.IVal_s(key) for key in numbers}
    try:
        for key, text in texts.items():
            Interface_Static.SetCVal_s(key, text)
        for key, number in numbers.items():
            Interface_Static.SetIVal_s(key, number)
        yield
    finally:
        for key, text in old_texts.items():
            Interface_Static.SetCVal_s(key, text)
        for key, number in old_numbers.items():
            Interface_Static.SetIVal_s(key, number)


def _write(parts: Sequence[Part], solids: Sequence[Any], title: str, single: bool) -> bytes:
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType

    writer = STEPCAFControl_Writer()
    # Styles come from `_add_colours`: OCCT writes them in the order of memory addresses.
    writer.SetColorMode(False)
    writer.SetLayerMode(False)
    writer.SetPropsMode(False)
    document = _document([p.name for p in parts], solids, title, single)
    if not writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs):
        raise ExportError(f"STEP: OCCT could not translate {title!r}; check that it is valid")
    model = writer.Writer().Model(False)
    _add_colours(writer.Writer().WS(), model, parts, solids)
    if not single:
        _number_occurrences(model)
    _set_header(model, title)
    stream = io.BytesIO()
    if writer.WriteStream(stream) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise ExportError(f"STEP: OCCT could not write {title!r}; check that it is valid")
    return stream.getvalue()


def _document(names: Sequence[str], solids: Sequence[Any], title: str, single: bool) -> Any:
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    def set_name(label: Any, text: str) -> None:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(text, True))

    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 0.001)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    if single:
        set_name(shapes.AddShape(solids[0], False), title)
        return document
    assembly = shapes.NewShape()
    set_name(assembly, title)
    for name, solid in zip(names, solids, strict=True):
        label = shapes.AddShape(solid, False)
        set_name(label, name)
        set_name(shapes.AddComponent(assembly, label, TopLoc_Location()), name)
    shapes.UpdateAssemblies()
    return document


def _add_colours(session: Any, model: Any, parts: Sequence[Part], solids: Sequence[Any]) -> None:
    from OCP.STEPConstruct import STEPConstruct_Styles
    from OCP.StepRepr import StepRepr_HArray1OfRepresentationItem
    from OCP.StepVisual import (
        StepVisual_ColourRgb,
        StepVisual_MechanicalDesignGeometricPresentationRepresentation,
    )
    from OCP.TCollection import TCollection_HAsciiString

    styles = STEPConstruct_Styles(session)
    for part, solid in zip(parts, solids, strict=True):
        red, green, blue, alpha = part.colour
        colour = StepVisual_ColourRgb()
        colour.Init(TCollection_HAsciiString(""), red, green, blue)
        look = styles.MakeColorPSA(None, colour, None, colour, 1.0 - alpha)
        styled = styles.AddStyle(solid, look, None)
        if styled is None:
            raise ExportError(f"STEP: {part.name} was not written as a solid; check it is valid")
        items = StepRepr_HArray1OfRepresentationItem(1, 1)
        items.SetValue(1, styled)
        shown = StepVisual_MechanicalDesignGeometricPresentationRepresentation()
        shown.Init(TCollection_HAsciiString(part.name), items, styles.FindContext(solid))
        model.AddWithRefs(shown)


def _number_occurrences(model: Any) -> None:
    from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
    from OCP.TCollection import TCollection_HAsciiString

    count = 0
    for index in range(1, model.NbEntities() + 1):
        entity = model.Entity(index)
        if isinstance(entity, StepRepr_NextAssemblyUsageOccurrence):
            count += 1
            entity.SetId(TCollection_HAsciiString(str(count)))


def _set_header(model: Any, title: str) -> None:
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.TCollection import TCollection_HAsciiString

    header = APIHeaderSection_MakeHeader(model)
    header.SetName(TCollection_HAsciiString(title))
    header.SetTimeStamp(TCollection_HAsciiString(TIME_STAMP))
    for setter in (header.SetAuthorValue, header.SetOrganizationValue):
        setter(1, TCollection_HAsciiString(""))
    header.SetAuthorisation(TCollection_HAsciiString(""))
    header.SetOriginatingSystem(TCollection_HAsciiString("gelslim-cad"))


def _normalised(text: str) -> str:
    """Put each entity on one line, as line breaks depend on the unrounded digits; round reals."""
    head, mark, data = text.partition("DATA;\n")
    # Every second piece lies between quotation marks; a doubled mark only adds an empty piece.
    pieces = _CONTINUATION.sub("", data).split("'")
    pieces[::2] = _with_rounded_reals(_MARK.join(pieces[::2])).split(_MARK)
    return head + mark + "'".join(pieces)


def _with_rounded_reals(text: str) -> str:
    """Round the reals of a text without strings, value by value.

    Most values occur in it many times, so that a table is faster than a search.
    """
    for delimiter in ",)":
        text = text.replace(delimiter, _CUT + delimiter)
    values = text.replace("(", "(" + _CUT).split(_CUT)
    known = _Rounded()
    return "".join([known[value] if "." in value else value for value in values])


class _Rounded(dict[str, str]):
    """Values with their reals rounded, worked out when they are first looked up."""

    def __missing__(self, value: str) -> str:
        found = self[value] = _REAL.sub(_rounded, value)
        return found


def _rounded(real: re.Match[str]) -> str:
    digits = f"{float(real[0]):.{DECIMALS}f}".rstrip("0")
    return "0." if digits == "-0." else digits
