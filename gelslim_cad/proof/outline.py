"""DXF outlines read back with ezdxf: unit, closed contours, area."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.proof import ProofResult, at_most, equal, unreadable

AREA_LIMIT = 1e-3
_FLATTENING_MM = 1e-3
_MILLIMETRES = 4


def prove_dxf(path: Path, area_mm2: float, *, layer: str = "CUT") -> list[ProofResult]:
    """Reread a DXF: no faults, unit mm, every outline on `layer` closed, area within 0.1 %.

    The area is that inside an odd number of outlines, so holes count as holes.
    """
    import ezdxf
    import manifold3d

    file = path.name
    try:
        document = ezdxf.readfile(path)
    except (OSError, ezdxf.DXFError, UnicodeDecodeError) as error:
        return unreadable(path, error)
    faults = len(document.audit().errors)
    entities = [e for e in document.modelspace() if e.dxf.layer == layer]
    open_ones = [e for e in entities if not _is_closed(e)]
    results = [
        equal(file, "faults", faults, 0),
        equal(file, "unit is mm", document.units, _MILLIMETRES, "$INSUNITS"),
        equal(file, "open outlines", len(open_ones), 0, f"{len(entities)} on layer {layer}"),
    ]
    outlines = [_points(e) for e in entities if _is_closed(e)]
    area = manifold3d.CrossSection(outlines, manifold3d.FillRule.EvenOdd).area()
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
