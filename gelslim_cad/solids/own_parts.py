"""Parts of one's own in place of built-in ones, with the proofs that a single solid allows.

Interference, the view and the assembly are proved later, as of every part.
"""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cadquery as cq
import numpy as np

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.export.brep import bounds_mm
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.step import read_step
from gelslim_cad.spec.parts import OwnPart

OWN = "own"
"""Tag of a part of one's own."""
MOST_SIZE_RATIO = 8.0
"""A part this many times larger or smaller than the built-in one is in another unit: 25.4 would be
inches, 1000 metres."""
FRAME = (
    "draw it in mm in the frame of the sensor, where it is assembled: origin at the centre of the "
    "gel's outer face, x towards the tip, y across, z out of the gel; start from the step file of "
    "the built-in part"
)


def with_own_parts(
    parts: Iterable[Part], d: Dimensions, own: Iterable[OwnPart]
) -> tuple[Part, ...]:
    """The parts with those of the spec's author in the place of the built-in ones.

    Args:
        parts: The built-in parts.
        d: Dimensions of the finger, which functions are called with.
        own: The parts of the spec's author. Python files among them are run.

    Returns:
        The parts in the same order.

    Raises:
        InputError: A file cannot be used, or what it gives is not one valid closed solid in mm at
            the place of the built-in part.
    """
    by_name = {part.name: part for part in own}
    return tuple(
        _replaced(part, d, by_name[part.name]) if part.name in by_name else part for part in parts
    )


def own_source(part: Part) -> str:
    """Where a part of one's own comes from, such as `own part, my_adapter.step`."""
    return part.note.partition(";")[0]


def _replaced(part: Part, d: Dimensions, own: OwnPart) -> Part:
    note = f"own part, {own.text}; rules on its walls and strength are those of the built-in one"
    change = _change(own)
    printed = part.printed
    if own.function and printed is not None:
        printed = _proved(own, part, change(d, printed))
    return replace(
        part,
        solid=_proved(own, part, change(d, part.solid)),
        printed=printed if own.function else None,
        note=note,
        tags=part.tags | {OWN},
    )


Change = Callable[[Dimensions, cq.Shape], cq.Shape]


def _change(own: OwnPart) -> Change:
    """What makes the own solid from dimensions and built-in solid."""
    if not own.function:
        return lambda d, solid: _step(own)
    function = _function(own)

    def call(d: Dimensions, solid: cq.Shape) -> cq.Shape:
        try:
            made = function(d, solid.copy())
        except Exception as error:
            raise own.error(_told(own, error), "correct the function") from error
        return _shape(own, made)

    return call


def _step(own: OwnPart) -> cq.Shape:
    found = [read.shape for read in read_step(own.file)]
    if not found:
        raise own.error("cannot be read as a STEP file", "export it again as STEP")
    return found[0] if len(found) == 1 else cq.Compound.makeCompound(found)


def _function(own: OwnPart) -> Callable[..., Any]:
    """The function of a Python file, which is run for it; modules beside it can be imported."""
    folder = str(own.file.parent.resolve())
    name = f"gelslim_own_part_{own.file.stem}"
    plan = importlib.util.spec_from_file_location(name, own.file)
    if plan is None or plan.loader is None:
        raise own.error("cannot be read as a Python file", "name a file that ends with .py")
    module = importlib.util.module_from_spec(plan)
    before = set(sys.modules)
    sys.path.insert(0, folder)
    try:
        plan.loader.exec_module(module)
    except Exception as error:
        raise own.error(_told(own, error), "correct the file") from error
    finally:
        sys.path.remove(folder)
        _forget(before, folder)
    function = getattr(module, own.function, None)
    if not callable(function):
        raise own.error(
            f"{own.file.name} has no function {own.function}",
            f"define {own.function}(dimensions, solid) in it",
        )
    checked: Callable[..., Any] = function
    return checked


def _forget(before: set[str], folder: str) -> None:
    """Let modules beside the file be read again the next time: a page may follow their changes."""
    for name in set(sys.modules) - before:
        place = getattr(sys.modules[name], "__file__", None) or ""
        if place.startswith(folder):
            del sys.modules[name]


def _told(own: OwnPart, error: Exception) -> str:
    """An error of the author's code, with its line there."""
    stack = traceback.extract_tb(error.__traceback__)
    frames = [f for f in stack if Path(f.filename).resolve() == own.file.resolve()]
    line = frames[-1].lineno if frames else getattr(error, "lineno", None)
    where = own.file.name if line is None else f"{own.file.name}:{line}"
    return f"{where} raised {type(error).__name__}: {error}"


def _shape(own: OwnPart, made: Any) -> cq.Shape:
    """What a function returned as a shape: of CadQuery, build123d, or the kernel itself."""
    from OCP.TopoDS import TopoDS_Shape

    made = getattr(made, "part", made) if not hasattr(made, "wrapped") else made
    if isinstance(made, cq.Workplane):
        shapes = [v for v in made.vals() if isinstance(v, cq.Shape)]
        return shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)
    wrapped = getattr(made, "wrapped", made)
    if not isinstance(wrapped, TopoDS_Shape) or wrapped.IsNull():
        raise own.error(
            f"{own.function} returned {type(made).__name__}, which is no solid",
            "return a CadQuery Workplane or Shape, or a solid of build123d",
        )
    return cq.Shape.cast(wrapped)


def _proved(own: OwnPart, part: Part, shape: cq.Shape) -> cq.Solid:
    """The one valid, closed solid of a shape, in the unit and at the place of the built-in part."""
    from OCP.BRep import BRep_Tool

    solids = shape.Solids()
    if len(solids) != 1:
        raise own.error(f"gives {len(solids)} solids instead of one", "unite its bodies to one")
    solid: cq.Solid = solids[0]
    if not all(BRep_Tool.IsClosed_s(shell.wrapped) for shell in solid.Shells()):
        raise own.error("gives a solid that is not closed", "close its shell")
    if not solid.isValid():
        raise own.error("gives an invalid solid", "heal it in the program that drew it")
    if solid.Volume() <= 0:
        raise own.error("gives a solid that is inside out", "turn its faces outwards")
    (low, high), (its_low, its_high) = bounds_mm(part.solid), bounds_mm(solid)
    ratio = float(np.linalg.norm(its_high - its_low) / np.linalg.norm(high - low))
    if not 1 / MOST_SIZE_RATIO < ratio < MOST_SIZE_RATIO:
        raise own.error(
            f"is {ratio:.3g} times as large as the built-in part: is it in another unit?", FRAME
        )
    if np.any(its_low > high) or np.any(its_high < low):
        raise own.error("does not lie where the built-in part lies", FRAME)
    return solid
