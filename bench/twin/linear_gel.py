"""Error of a linear gel by Poisson's ratio, shape, depth, and where its nodes meet the tool.

    python -m bench.twin.linear_gel            # writes docs/data/linear_gel.json
    python -m bench.twin.linear_gel --quick    # one shape, printed only

A pad of 14 x 14 x 2 mm is pressed without friction. The judge of forces is the neo-Hookean gel on
a finer mesh, that of the surface the neo-Hookean gel on the same one; CalculiX agrees with it
within 2 % in force (`tests/calculix`).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver, Geometry, geometry_of
from gelslim_twin.scene.indenter import Cylinder, FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
POISSON = (0.32, 0.40, 0.45, 0.49)
SHAPES: Mapping[str, Indenter] = {
    "ball, radius 4 mm": Sphere(shape="sphere", radius_mm=4.0),
    "ball, radius 10 mm": Sphere(shape="sphere", radius_mm=10.0),
    "rod, radius 3 mm": Cylinder(shape="cylinder", radius_mm=3.0, length_mm=6.0),
    "flat punch, radius 2 mm": FlatPunch(shape="flat_punch", radius_mm=2.0),
}
SHARES = (0.05, 0.1, 0.2, 0.3)
SIZE_MM, THICK_MM, YOUNGS_MPA = 14.0, 2.0, 0.147
CELLS, FINER, LAYERS, FINER_LAYERS = 24, 32, 4, 5
GEOMETRIES: tuple[Geometry, ...] = ("displaced", "rest")
TIGHT = 1e-4


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one shape, printed only")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    asked = parser.parse_args()
    shapes = dict(list(SHAPES.items())[:1]) if asked.quick else SHAPES
    rows = []
    with threadpool_limits(limits=1):
        for poisson in POISSON:
            mean, fine = (
                SurfaceCompliance(pad(poisson, *size))
                for size in ((CELLS, LAYERS), (FINER, FINER_LAYERS))
            )
            rows += [row(mean, fine, poisson, *shape) for shape in shapes.items()]
    data = {**machine(), "rows": rows}
    print(table(data))
    if not asked.quick or asked.docs:
        write_data("linear_gel", data, asked.docs or DOCS)


def pad(poisson: float, cells: int, layers: int) -> Bundle:
    """A square pad of even cells."""
    pitch = (SIZE_MM / cells, SIZE_MM / cells, THICK_MM / layers)
    corner = (-SIZE_MM / 2, -SIZE_MM / 2, -THICK_MM)
    mesh = PadMesh.from_occupancy(np.ones((cells, cells, layers), dtype=bool), pitch, corner)
    return build_bundle(mesh, Material(YOUNGS_MPA, poisson, 1000.0), "bbar", with_stiffness=False)


def row(
    mean: SurfaceCompliance, fine: SurfaceCompliance, poisson: float, name: str, shape: Indenter
) -> dict[str, Any]:
    """Errors of both geometries at each depth, and what a state takes."""
    known, surface = strained(fine, shape), strained(mean, shape)
    found: dict[str, Any] = {
        "poisson": poisson,
        "shape": name,
        "known_n": [normal(s) for s in known],
    }
    # The judge of forces has a finer mesh, so that of the linear gel has it, too.
    for geometry in GEOMETRIES:
        finer, _ = linear(fine, shape, geometry)
        same, seconds = linear(mean, shape, geometry)
        found[geometry] = {
            "error": [normal(a) / normal(b) - 1 for a, b in zip(finer, known, strict=True)],
            "surface_um": [rms_um(a, b) for a, b in zip(same, surface, strict=True)],
            "ms": 1e3 * seconds,
        }
    return found


def strained(compliance: SurfaceCompliance, shape: Indenter) -> list[GelState]:
    """The neo-Hookean gel at each depth."""
    solver = ContactSolver(compliance, Tool.of([shape], Path()), ContactSettings(TIGHT))
    poses = (Pose(), *(Pose(k + 1.0, depth_mm=s * THICK_MM) for k, s in enumerate(SHARES)))
    return list(NonlinearContact(solver, 1e-3).states(poses))[1:]


def linear(
    compliance: SurfaceCompliance, shape: Indenter, geometry: Geometry
) -> tuple[list[GelState], float]:
    """The linear gel at each depth, and the median of seconds per state."""
    settings = ContactSettings(TIGHT, geometry=geometry)
    solver = ContactSolver(compliance, Tool.of([shape], Path()), settings)
    rest, states, seconds = GelState.at_rest(len(solver.points_mm)), [], []
    for share in SHARES:
        for _ in range(2):
            begun = time.process_time()
            state = solver.advanced(rest, None, Pose(depth_mm=share * THICK_MM))
            last = time.process_time() - begun
        states.append(state)
        seconds.append(last)
    return states, float(np.median(seconds))


def normal(state: GelState) -> float:
    """Normal force in N."""
    return -float(state.force_n[:, 2].sum())


def rms_um(one: GelState, other: GelState) -> float:
    """Root mean square over the nodes in contact of the distance between two surfaces."""
    on = other.touch > 0
    away = (one.displacement_mm - other.displacement_mm)[on]
    return 1e3 * float(np.sqrt((away**2).sum(axis=1).mean()))


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/physics.md: errors of the force by depth, in both geometries."""
    depths = " | ".join(f"{100 * share:g} %" for share in SHARES)
    lines = [
        f"| ν | shape | meets at | {depths} | surface, µm |",
        "|---:|---|---|" + "---:|" * (len(SHARES) + 1),
    ]
    for found in data["rows"]:
        for geometry in GEOMETRIES:
            own = found[geometry]
            errors = [f"{100 * e:+.1f} %" for e in own["error"]]
            if geometry == geometry_of(found["poisson"]):
                errors = [f"**{e}**" for e in errors]
            lines.append(
                f"| {found['poisson']:.2f} | {found['shape']} | {geometry} | {' | '.join(errors)} "
                f"| {own['surface_um'][1]:.0f}, {own['surface_um'][3]:.0f} |"
            )
    times = {g: np.median([r[g]["ms"] for r in data["rows"]]) for g in GEOMETRIES}
    lines += [
        "",
        "Errors of the normal force at depths of 5 to 30 % of the thickness; bold is what steps "
        "of the twin take. The last column is the distance of the surfaces in contact at 10 and "
        f"30 %. A state takes {times['displaced']:.1f} and {times['rest']:.1f} ms.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
