"""Gerber X2 files: header with file attributes, coordinates, apertures and their objects.

Written from the Gerber layer format specification (Ucamco, revision 2024.05): millimetres with six
decimals, file attributes in the header, aperture and object attributes where they apply.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal
from uuid import NAMESPACE_URL, uuid5

from gelslim_cad.markers.layout import decimal
from gelslim_core import __version__

Point = Sequence[float]
Polarity = Literal["Positive", "Negative"]
GREATEST_MM = 9999.0
PROJECT = "https://github.com/gelslim-cad/gelslim-cad"


@dataclass(frozen=True)
class Aperture:
    """A shape that is flashed or drawn with.

    Attributes:
        template: Its definition, such as `C,0.5` or `R,0.25X1.7`.
        function: Its `.AperFunction`, such as `Conductor`.
    """

    template: str
    function: str


@dataclass(frozen=True)
class GerberObject:
    """A flash or a straight line.

    Attributes:
        aperture: What it is made with.
        points_mm: One point for a flash, two for a line.
        attributes: Object attributes with their values, such as `.N,VCC`.
    """

    aperture: Aperture
    points_mm: tuple[Point, ...]
    attributes: tuple[str, ...] = ()


def circle(diameter_mm: float, function: str) -> Aperture:
    """A round aperture."""
    return Aperture(f"C,{decimal(diameter_mm, 6)}", function)


def rectangle(x_mm: float, y_mm: float, function: str) -> Aperture:
    """A rectangular aperture."""
    return Aperture(f"R,{decimal(x_mm, 6)}X{decimal(y_mm, 6)}", function)


def gerber_file(
    function: str,
    body: Iterable[str],
    *,
    project: str,
    frame: str,
    comment: str,
    part: str = "Single",
    polarity: Polarity = "Positive",
) -> bytes:
    """A Gerber file.

    Args:
        function: Its `.FileFunction`, such as `Copper,L1,Top`.
        body: Lines between the header and the end.
        project: Name of what the file belongs to; its identifier follows from it.
        frame: Files of one frame may be laid over each other: their `.SameCoordinates`.
        comment: What to say of the view.
        part: Its `.Part`.
        polarity: Whether the image shows where material is, or where there is none.

    Returns:
        The file in ASCII.
    """
    identifier = uuid5(NAMESPACE_URL, f"{PROJECT}#{project}")
    head = [
        f"%TF.GenerationSoftware,gelslim-cad,gelslim-cad,{__version__}*%",
        f"%TF.ProjectId,{project},{identifier},1*%",
        f"%TF.Part,{part}*%",
        f"%TF.SameCoordinates,{frame}*%",
        f"%TF.FileFunction,{function}*%",
        f"%TF.FilePolarity,{polarity}*%",
        f"G04 {comment}*",
        "%FSLAX46Y46*%",
        "%MOMM*%",
        "G75*",
        "G01*",
        "%LPD*%",
    ]
    return ("\n".join([*head, *body, "M02*"]) + "\n").encode("ascii")


def object_lines(objects: Iterable[GerberObject]) -> list[str]:
    """Apertures and their objects as lines of a body, aperture by aperture as they appear."""
    by_aperture: dict[Aperture, list[GerberObject]] = {}
    for item in objects:
        by_aperture.setdefault(item.aperture, []).append(item)
    lines = []
    for number, aperture in enumerate(by_aperture, start=10):
        lines += [
            f"%TA.AperFunction,{aperture.function}*%",
            f"%ADD{number}{aperture.template}*%",
            "%TD*%",
        ]
    for number, items in enumerate(by_aperture.values(), start=10):
        lines.append(f"D{number}*")
        for item in items:
            lines += [f"%TO{attribute}*%" for attribute in item.attributes]
            if len(item.points_mm) == 1:
                lines.append(f"{xy(item.points_mm[0])}D03*")
            else:
                lines += [f"{xy(item.points_mm[0])}D02*"]
                lines += [f"{xy(point)}D01*" for point in item.points_mm[1:]]
            if item.attributes:
                lines.append("%TD*%")
    return lines


def integer(value_mm: float) -> str:
    """A coordinate in the file's unit of 1 nm. Raises ValueError beyond the format's reach."""
    if not abs(value_mm) < GREATEST_MM:
        raise ValueError(
            f"Gerber coordinate {value_mm:g} mm is beyond the format's {GREATEST_MM:g} mm"
        )
    return str(round(float(value_mm) * 1e6))


def xy(point_mm: Point) -> str:
    """A point as the file writes it."""
    return f"X{integer(point_mm[0])}Y{integer(point_mm[1])}"
