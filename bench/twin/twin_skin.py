"""How much a coat and a fabric add to the force: presses and slides with membranes on the gel.

    python -m bench.twin.twin_skin            # writes docs/data/twin_skin.json
    python -m bench.twin.twin_skin --quick    # one gel and two membranes, printed only

Each tool is pressed on a gel of 14 x 14 x 2 mm, E = 0.147 MPa, in 24 x 24 x 4 cells and, with
friction 0.6, moved sideways by 0.2 mm. The share is that of the resultant force with the membrane
minus that without, over the latter.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Indenter, Sphere, TexturedPlane
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.elements.skin import Membrane
from ifem_export.mesh.pad_mesh import PadMesh

SIDE_MM, THICK_MM, CELLS, LAYERS, YOUNGS_MPA = 14.0, 2.0, 24, 4, 0.147
MEMBRANES = (
    (0.01, "thin silicone paint, 10 µm of 1 MPa"),
    (0.05, "usual silicone paint, 50 µm of 1 MPa"),
    (0.3, "stretch knit"),
    (3.0, "tight knit"),
    (30.0, "woven cloth"),
)
POISSONS = (0.3223, 0.45, 0.49)
FRICTION, SLIDE_MM = 0.6, 0.2
TOOLS: tuple[tuple[str, Indenter, float], ...] = (
    ("ball of 10 mm", Sphere(shape="sphere", radius_mm=10), 0.4),
    ("ball of 2 mm", Sphere(shape="sphere", radius_mm=2), 0.4),
    (
        "ridges",
        TexturedPlane(
            shape="textured_plane", length_mm=8.7, width_mm=8.7, texture="ridges", pitch_mm=3,
            relief_mm=0.3,
        ),
        0.3,
    ),
)  # fmt: skip


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="a part of it, printed only")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    asked = parser.parse_args()
    part = (POISSONS[1:2], MEMBRANES[:2]) if asked.quick else (POISSONS, MEMBRANES)
    with threadpool_limits(limits=1):
        data = {**machine(), "rows": rows(*part)}
    print(table(data))
    if not asked.quick or asked.docs:
        write_data("twin_skin", data, asked.docs or DOCS)


def rows(poissons: Sequence[float], membranes: Sequence[tuple[float, str]]) -> list[dict[str, Any]]:
    """Shares of the press without friction and of the whole path with it."""
    found = []
    for poisson in poissons:
        bare = {key: forces(poisson, 0.0, *key) for key in range_of_cases()}
        for stiffness, name in membranes:
            for tool in range(len(TOOLS)):
                pressed, slid = (forces(poisson, stiffness, tool, mu) for mu in (0.0, FRICTION))
                found.append(
                    {
                        "poissons_ratio": poisson,
                        "stiffness_n_per_mm": stiffness,
                        "membrane": name,
                        "tool": TOOLS[tool][0],
                        "press": share(pressed[-1], bare[tool, 0.0][-1]),
                        "slide": share(slid[-1], bare[tool, FRICTION][-1]),
                    }
                )
    return found


def range_of_cases() -> list[tuple[int, float]]:
    """Number of the tool and friction."""
    return [(tool, mu) for tool in range(len(TOOLS)) for mu in (0.0, FRICTION)]


def share(worn: np.ndarray, bare: np.ndarray) -> float:
    """Size of the difference of two resultants (3,) over that of the second."""
    return float(np.linalg.norm(worn - bare) / np.linalg.norm(bare))


def forces(poisson: float, stiffness: float, tool: int, friction: float) -> list[np.ndarray]:
    """Resultants (3,) on the path."""
    pitch = SIDE_MM / CELLS
    mesh = PadMesh.from_occupancy(
        np.ones((CELLS, CELLS, LAYERS), dtype=bool),
        (pitch, pitch, THICK_MM / LAYERS),
        (-SIDE_MM / 2, -SIDE_MM / 2, -THICK_MM),
    )
    gel = Material(YOUNGS_MPA, poisson, 1000.0)
    bundle = build_bundle(mesh, gel, "bbar", with_stiffness=False)
    skin = (Membrane(stiffness),) if stiffness else ()
    _, shape, depth = TOOLS[tool]
    solver = ContactSolver(
        SurfaceCompliance(bundle, None, skin), Tool.of([shape], Path()),
        ContactSettings(1e-3, friction),
    )  # fmt: skip
    path = [Pose(depth_mm=depth / 2), Pose(time_s=1.0, depth_mm=depth)]
    if friction:
        path.append(Pose(time_s=2.0, x_mm=SLIDE_MM, depth_mm=depth))
    return [s.force_n.sum(axis=0) for s in solver.states(tuple(path))]


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/digital_twin.md: smallest and largest share of the tools."""
    rows = data["rows"]
    poissons = sorted({row["poissons_ratio"] for row in rows})
    heads = [f"{what}, ν {nu:g}" for what in ("press", "slide") for nu in poissons]
    lines = [
        f"| N, N/mm | such as | {' | '.join(heads)} |",
        f"|---:|---|{'---:|' * len(heads)}",
    ]
    for stiffness in sorted({row["stiffness_n_per_mm"] for row in rows}):
        own = [row for row in rows if row["stiffness_n_per_mm"] == stiffness]
        cells = []
        for what in ("press", "slide"):
            for nu in poissons:
                shares = [100 * row[what] for row in own if row["poissons_ratio"] == nu]
                cells.append(f"{min(shares):.2g} to {max(shares):.2g} %")
        lines.append(f"| {stiffness:g} | {own[0]['membrane']} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
