"""How fine a mesh has to be: a ladder from coarse to fine, and the first rung that will do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.export.error import ExportError
from gelslim_cad.export.mesh import TriangleMesh, area_mm2, bad_edges, tessellate, volume_mm3

RUNGS = (
    (0.20, 30.0),
    (0.10, 20.0),
    (0.05, 15.0),
    (0.03, 10.0),
    (0.02, 7.5),
    (0.01, 5.0),
    (0.007, 4.0),
    (0.005, 3.0),
    (0.002, 1.5),
)
"""Linear (mm) and angular (deg) tolerance, coarse to fine. A linear tolerance alone does not
tame small curved faces, so both fall together."""
FIRST = 2
"""The first rung for files to print: 10 µm off at most on the parts of a finger, under a printer's
resolution, in the time of the coarser ones, which keep the volume too but show their facets."""


@dataclass(frozen=True)
class Tessellation:
    """The rung taken and what it costs.

    Errors are relative to the exact solid (B-rep mass properties); the mesh is closed.
    """

    linear_mm: float
    angular_deg: float
    volume_error: float
    area_error: float
    triangles: int


def tessellation_for(shape: Any, volume_tolerance: float = 1e-3) -> Tessellation:
    """Find the coarsest rung from `FIRST` on, closed and within `volume_tolerance`, relative.

    Raises:
        ExportError: see `mesh_for`.
    """
    return mesh_for(shape, volume_tolerance)[1]


def mesh_for(shape: Any, volume_tolerance: float = 1e-3) -> tuple[TriangleMesh, Tessellation]:
    """Mesh a solid on the coarsest rung from `FIRST` on that is closed and keeps its volume.

    Raises:
        ExportError: the solid has no positive volume, or no rung qualifies; the message says
            whether the mesh leaked or was too coarse.
    """
    exact, area = float(shape.Volume()), float(shape.Area())
    if not exact > 0:
        raise ExportError(f"tessellation: volume is {exact:g} mm3, must be > 0; solid inside out?")
    reason = ""
    for linear, angular in RUNGS[FIRST:]:
        mesh = tessellate(shape, linear, angular)
        error = abs(volume_mm3(mesh) / exact - 1.0)
        bad = bad_edges(mesh)
        if len(bad):
            middle = np.round(mesh.vertices_mm[bad[0]].mean(axis=0), 3)
            reason = f"{len(bad)} edges are not shared by 2 faces, one at {middle.tolist()} mm"
        elif error > volume_tolerance:
            reason = f"volume is off by {error:.2e} at {linear} mm / {angular} deg"
        else:
            area_error = abs(area_mm2(mesh) / area - 1.0)
            return mesh, Tessellation(linear, angular, error, area_error, len(mesh.faces))
    raise ExportError(
        f"tessellation: no rung keeps the volume within {volume_tolerance:g}: {reason}; "
        "move features that only touch along an edge apart or into each other, keep a sphere's "
        "pole off other faces, or allow a larger tolerance"
    )
