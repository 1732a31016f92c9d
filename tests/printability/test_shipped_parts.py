"""The printed parts of the shipped designs: they can be printed by every process."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest
from shipped_fingers import DESIGNS
from shipped_fingers import parts as shipped_parts

pytest.importorskip("cadquery", reason="parts need the [cad] extra")

from gelslim_cad.build.manifest import json_bytes
from gelslim_cad.build.stages import Stages
from gelslim_cad.export.mesh import mesh_for, print_mesh
from gelslim_cad.printability.limits import LIMITS
from gelslim_cad.printability.measures import measure
from gelslim_cad.printability.rules import PrintedPart, print_checks
from gelslim_cad.solids.finger import tooling_parts
from gelslim_cad.tolerance.asked import read_spec


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [p if p.stem == "mini20" else pytest.param(p, marks=pytest.mark.slow) for p in DESIGNS],
    ids=lambda p: p.stem,
)
def test_printed_parts_break_no_limit(path: Path) -> None:
    stages = Stages.prepare(read_spec(path))
    d = stages.dimensions
    made = (p.as_made() for p in (*shipped_parts(path.stem), *tooling_parts(d, stages.grid)))
    parts = [p for p in made if p.process == "print"]
    meshes = {p.name: print_mesh(mesh_for(p.solid, 2e-4)[0], p.print_rotation_deg) for p in parts}
    for limits in LIMITS.values():
        found = tuple(
            PrintedPart(
                p.name,
                measure(meshes[p.name], p.solid, limits.overhang_deg, limits.bridge_mm),
                limits,
            )
            for p in parts
        )
        assert [c.id for c in print_checks(found) if c.status == "fail"] == []
        by_name = {p.name: p.measures for p in found}
        assert all(m.floating == 0 for m in by_name.values())
        assert all(m.plate_mm2 > 20 for m in by_name.values())
        # Only the body needs supports, and they stand on the plate.
        steep = {name for name, m in by_name.items() if m.overhang_mm2 > 0}
        assert steep <= {"body"}
        assert by_name["fit_coupon"].wall_mm == pytest.approx(0.4, abs=1e-3)
        assert json_bytes(asdict(by_name["body"]))
