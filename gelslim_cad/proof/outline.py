"""DXF outlines read back with ezdxf: unit, closed contours, area."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.proof.result import ProofResult, at_most, equal

AREA_LIMIT = 1e-3
_FLATTENING_MM = 1e-3
_MILLIMETRES = 4


def prove_dxf(path: Path, area_mm2: float, *, layer: str = "CUT") -> list[ProofResult]:
    """Reread a DXF: no faults, unit mm, every outline on `layer` closed, area within 0.1 %.

    The area is that inside an odd number of outlines, so holes count as holes.
    """
    import ezdxf

    file = path.name
    try:
        document = ezdxf.readfile(path)
    except (OSError, ezdxf.DXFError, UnicodeDecodeError) as error:
        return [equal(file, "readable", False, True, f"{type(error).__name__}: {error}")]
    faults = len(document.audit().errors)
    entities = [e for e in document.modelspace() if e.dxf.layer == layer]
    open_ones = [e for e in entities if not _is_closed(e)]
    results = [
        equal(file, "faults", faults, 0),
        equal(file, "unit is mm", document.units, _MILLIMETRES, "$INSUNITS"),
        equal(file, "open outlines", len(open_ones), 0, f"{len(entities)} on layer {layer}"),
    ]
    area = _area([_points(e) for e in entities if _is_closed(e)])
    off = abs(area / area_mm2 - 1.0) if area_mm2 > 0 else float("inf")
    detail = f"{area:.6g} mm2 read, {area_mm2:.6g} mm2 built"
    return [*results, at_most(file, "area", off, AREA_LIMIT, detail)]


def _is_closed(entity: Any) -> bool:
    kind = entity.dxftype()
    return kind == "CIRCLE" or (kind == "LWPOLYLINE" and bool(entity.closed))


def _points(entity: Any) -> NDArray[np.float64]:
    from ezdxf.path import make_path

    run = [(p.x, p.y) for p in make_path(entity).flattening(_FLATTENING_MM)]
    return np.array(run[:-1] if run[0] == run[-1] else run)


def _area(outlines: list[NDArray[np.float64]]) -> float:
    total = 0.0
    for number, outline in enumerate(outlines):
        around = (o for k, o in enumerate(outlines) if k != number)
        depth = sum(_contains(o, outline[0]) for o in around)
        total += abs(_enclosed(outline)) * (-1 if depth % 2 else 1)
    return total


def _enclosed(points: NDArray[np.float64]) -> float:
    x, y = points.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def _contains(points: NDArray[np.float64], point: NDArray[np.float64]) -> bool:
    """Even-odd rule for a ray along +x."""
    (x0, y0), (x1, y1) = points.T, np.roll(points, -1, axis=0).T
    crosses = (y0 > point[1]) != (y1 > point[1])
    rise = np.where(crosses, y1 - y0, 1.0)
    at = x0 + (point[1] - y0) * (x1 - x0) / rise
    return bool(np.count_nonzero(crosses & (at > point[0])) % 2)
