"""Errors of the surface operators by kind of contact, and of fits of a contact near the edge.

    python -m bench.stiffness.operator_contacts            # writes docs/data, in a minute
    python -m bench.stiffness.operator_contacts --quick    # fewer cases, printed only

The pad is that of gelslim2. The motions come from the same pad at half the pitch with eight B-bar
layers (see ifem_export.operators.ladder). No times are measured: `stiffness_ladder.py` has them.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from bench.stiffness.stiffness_cases import gel
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.contact_columns import ContactCompliance
from ifem_export.inverse.contact_inverse import masked_force, smoothing
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import (
    FIELD_SEED,
    REFERENCE_RTOL,
    lumped,
    measure_ladder,
    refined,
)
from ifem_export.operators.ladder_contacts import Disc, contact_motions, nodal_forces
from ifem_export.operators.surface_operator import surface_operator

Array = NDArray[np.float64]
RATIOS = (0.3223, 0.45, 0.49)
SIDE_MM, THICKNESS_MM, CELLS, LAYERS = 28.0, 2.0, 42, 4
RADIUS_MM = 1.5
GAPS_MM = (6.0, 1.0, 0.0, -1.0)
"""Distances of the rim of the contact from the edge; a negative one reaches beyond the pad."""
NOISE_MM, LOW_PASS_MM = 0.005, 0.7


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--docs", type=Path, help="folder with data/")
    asked = parser.parse_args()
    ratios, cells = (RATIOS[:1], CELLS // 2) if asked.quick else (RATIOS, CELLS)
    record: dict[str, Any] = {
        **machine(FIELD_SEED),
        "pad": f"{SIDE_MM:g} x {SIDE_MM:g} mm, {THICKNESS_MM:g} mm thick",
        "cells": cells,
        "noise_mm": NOISE_MM,
        "low_pass_mm": LOW_PASS_MM,
        "ladders": [ladder(pad(cells), ratio) for ratio in ratios],
        "fits": [row for ratio in ratios for row in fits(pad(cells), ratio)],
    }
    for found in record["ladders"]:
        for row in found["rows"]:
            errors = ", ".join(f"{kind} {error:.1%}" for kind, error in row["errors"].items())
            print(f"nu {found['poissons_ratio']:g}  {row['label']:22s} {errors}")
    for row in record["fits"]:
        print(row)
    if not asked.quick or asked.docs:
        print(write_data("operator_contacts", record, asked.docs or DOCS))


def pad(cells: int) -> PadMesh:
    """Return the pad."""
    outline = RoundedRectangle(SIDE_MM, SIDE_MM, 1.0)
    return build_pad_mesh(outline, THICKNESS_MM, cells=(cells, cells, LAYERS))[0]


def ladder(mesh: PadMesh, ratio: float) -> dict[str, Any]:
    """Return the errors of every operator by kind of contact, and the default one."""
    found = measure_ladder(mesh, gel(ratio), "bbar", timed=False)
    rows = [
        {
            "label": rung.label,
            "error": rung.error,
            "errors": rung.errors,
            "resultant": rung.worst_resultant,
            "n_bytes": rung.n_bytes,
        }
        for rung in found.rungs
    ]
    return {"poissons_ratio": ratio, "default": found.balanced().label, "rows": rows}


def fits(mesh: PadMesh, ratio: float) -> list[dict[str, Any]]:
    """Return the error of the field of a small ball, by its distance from the edge and the way."""
    fine, bundle = refined(mesh), build_bundle(mesh, gel(ratio), "bbar", with_stiffness=False)
    exact = surface_operator(fine, gel(ratio), "bbar", "pcg", rtol=REFERENCE_RTOL)
    direct, quick = bundle.surface_operator("factor"), bundle.surface_operator("fft", lumped=1)
    smooth, columns = smoothing(mesh.surface_mm, LOW_PASS_MM), ContactCompliance(bundle)
    discs = [
        Disc(np.array([SIDE_MM / 2 - gap - RADIUS_MM, 1.2]), RADIUS_MM, np.array([0.3, 0.1, -1.0]))
        for gap in GAPS_MM
    ]
    forces = [nodal_forces(fine, (disc,)) for disc in discs]
    draw = np.random.default_rng(FIELD_SEED).normal(size=(len(mesh.surface), 3))
    rows = []
    for gap, force, moved in zip(
        GAPS_MM, forces, contact_motions(exact, fine, mesh, forces), strict=True
    ):
        expected, noisy = lumped(force, fine, mesh), moved + NOISE_MM * draw
        touched = np.abs(expected).sum(axis=1) > 0
        ways: Mapping[str, Array] = {
            "infinite pad": masked_force(quick, noisy, touched).force_n,
            "low-pass": smooth @ direct.force(noisy),
            "columns": masked_force(columns, noisy, touched).force_n,
        }
        rows.append(
            {
                "poissons_ratio": ratio,
                "gap_mm": gap,
                "field": {k: _field(f, expected) for k, f in ways.items()},
                "normal": {k: _normal(f, expected) for k, f in ways.items()},
            }
        )
    return rows


def _field(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def _normal(found: Array, expected: Array) -> float:
    return float(found[:, 2].sum() / expected[:, 2].sum() - 1)


if __name__ == "__main__":
    main()
