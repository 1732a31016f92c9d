"""Boundary representations (B-rep): copies, bounds, bytes for other processes, digests.

A shape is a `cadquery.Shape` with lengths in mm.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError

DIGEST_DECIMALS = 9
"""Reals are rounded to 1e-9 mm before hashing: Boolean operations sum in the order of memory
addresses, so the last bits of a coordinate differ from one process to the next."""

_BINARY_MARK = b"\nOpen CASCADE Topology V"

_REAL = re.compile(rb"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e[+-]?\d+|-0\b")
_HISTORY_FLAGS = re.compile(rb"^[01]{3}([01]{4})$", re.MULTILINE)
"""The flags free, modified and checked record what was done to a shape, not what it is."""


def bare_copy(shape: Any) -> Any:
    """Copy a shape without triangulation, with its placement worked into the geometry.

    OCCT keeps a mesh with the shape and reuses it, so the first mesh of the original would decide
    every later export. The copy shares nothing with the original.
    """
    import cadquery as cq
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy, BRepBuilderAPI_Transform
    from OCP.TopLoc import TopLoc_Location

    placement = shape.wrapped.Location()
    if placement.IsIdentity():
        return cq.Shape.cast(BRepBuilderAPI_Copy(shape.wrapped, True, False).Shape())
    unplaced = shape.wrapped.Located(TopLoc_Location())
    moved = BRepBuilderAPI_Transform(unplaced, placement.Transformation(), True, False)
    return cq.Shape.cast(moved.Shape())


def only_solid(shape: Any, name: str = "shape") -> Any:
    """Return the one `cadquery.Solid` in a shape.

    Raises:
        ExportError: the shape holds no solid or several.
    """
    solids = shape.Solids()
    if len(solids) != 1:
        raise ExportError(
            f"{name}: holds {len(solids)} solids, a part is exactly 1; "
            "union touching bodies or make each its own part"
        )
    return solids[0]


def bounds_mm(shape: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Low and high corner `(3,)` of the tight bounding box, independent of any cached mesh.

    The kernel searches the extremes of a torus by trial, in 15 ms; they have a closed form.
    """
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    corners = []
    faces = shape.Faces()
    for face in faces:
        torus = _torus_bounds_mm(face)
        if torus is None:
            BRepBndLib.AddOptimal_s(face.wrapped, box, False, False)
        else:
            corners.append(torus)
    if not faces:
        BRepBndLib.AddOptimal_s(shape.wrapped, box, False, False)
    if not box.IsVoid():
        box.SetGap(0.0)
        ends = (box.CornerMin(), box.CornerMax())
        corners.append(np.array([end.Coord() for end in ends]))
    low, high = np.min([c[0] for c in corners], axis=0), np.max([c[1] for c in corners], axis=0)
    return low, high


def _torus_bounds_mm(face: Any) -> NDArray[np.float64] | None:
    """Low and high corner (2, 3) of a face of a torus; None unless two pairs of circles bound it.

    A point of the torus is O + (R + r cos v)(cos u X + sin u Y) + r sin v Z. Along any direction
    the extreme over u is that of a sinusoid, and so is then the extreme over v, as R > r.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepTools import BRepTools
    from OCP.GeomAbs import GeomAbs_SurfaceType

    surface = BRepAdaptor_Surface(face.wrapped, True)
    if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Torus:
        return None
    torus = surface.Torus()
    large, small = torus.MajorRadius(), torus.MinorRadius()
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face.wrapped)
    area = small * (u1 - u0) * (large * (v1 - v0) + small * (math.sin(v1) - math.sin(v0)))
    if large <= small or not math.isclose(face.Area(), area, rel_tol=1e-9):
        return None
    place = torus.Position()
    axes = np.array([d.Coord() for d in (place.XDirection(), place.YDirection())])
    along = np.array(place.Axis().Direction().Coord())
    found = np.empty((2, 3))
    for k, sign in itertools.product(range(3), (-1.0, 1.0)):
        across = _greatest(sign * axes[0, k], sign * axes[1, k], (u0, u1))
        reach = large * across + small * _greatest(across, sign * along[k], (v0, v1))
        found[int(sign > 0), k] = place.Location().Coord()[k] + sign * reach
    return found


def _greatest(a: float, b: float, interval: tuple[float, float]) -> float:
    """Greatest value of a cos t + b sin t for t in an interval."""
    low, high = interval
    peak = math.atan2(b, a)
    peak += math.tau * math.ceil((low - peak) / math.tau)
    ends = (a * math.cos(t) + b * math.sin(t) for t in interval)
    return math.hypot(a, b) if peak <= high else max(ends)


def shape_to_bytes(shape: Any) -> bytes:
    """Serialise a shape exactly (OCCT binary, no triangulation), e.g. for a worker process."""
    from OCP.BinTools import BinTools, BinTools_FormatVersion

    stream = io.BytesIO()
    version = BinTools_FormatVersion.BinTools_FormatVersion_CURRENT
    BinTools.Write_s(shape.wrapped, stream, False, False, version)
    return stream.getvalue()


def shape_from_bytes(data: bytes) -> Any:
    """Rebuild the shape written by `shape_to_bytes`.

    Raises:
        ExportError: the bytes hold no shape.
    """
    import cadquery as cq
    from OCP.BinTools import BinTools
    from OCP.Standard import Standard_Failure
    from OCP.TopoDS import TopoDS_Shape

    read = TopoDS_Shape()
    if data.startswith(_BINARY_MARK):
        with contextlib.suppress(Standard_Failure):
            BinTools.Read_s(read, io.BytesIO(data))
    if read.IsNull():
        raise ExportError(f"{len(data)} bytes hold no shape; write them with shape_to_bytes")
    return cq.Shape.cast(read)


def shape_digest(shape: Any) -> str:
    """SHA-256 of a shape's topology and geometry, the same in every process.

    Reals are rounded (`DIGEST_DECIMALS`) and triangulation is left out, so neither the last
    bits of a Boolean nor an earlier export changes it.
    """
    from OCP.BRepTools import BRepTools
    from OCP.TopTools import TopTools_FormatVersion

    stream = io.BytesIO()
    version = TopTools_FormatVersion.TopTools_FormatVersion_VERSION_1
    BRepTools.Write_s(shape.wrapped, stream, False, False, version)
    text = _HISTORY_FLAGS.sub(rb"\1", stream.getvalue())
    return hashlib.sha256(_REAL.sub(_rounded, text)).hexdigest()


def _rounded(match: re.Match[bytes]) -> bytes:
    value = round(float(match[0]), DIGEST_DECIMALS) + 0.0
    return b"%d" % int(value) if value == int(value) else repr(value).encode()
