"""Small studies of the stiffness page: cut cells, noise, iterations of the solver.

python -m bench.stiffness.stiffness_cases    # some minutes; writes docs/data/stiffness_cases.json
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.inverse.contact_inverse import masked_force, smoothing
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, Weighting, build_pad_mesh
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import pad_solver
from ifem_export.operators.surface_operator import surface_operator

DRAWS = 12
CELLS = (8, 11, 15, 19, 23)
NUS = (0.3, 0.45, 0.49, 0.499, 0.4999)
WEIGHTINGS: tuple[Weighting, ...] = ("cell_centre", "volume_fraction")


def gel(nu: float = 0.3223) -> Material:
    """Return the paper's gel with another Poisson's ratio."""
    return Material(0.147, nu, 1020.0)


def pad() -> PadMesh:
    """Return the pad of gelslim2."""
    return build_pad_mesh(RoundedRectangle(28.0, 28.0, 1.0), 2.0, cells=(42, 42, 4))[0]


def iterations(nu: float) -> int:
    """Return the iterations of conjugate gradients to a residual of 1e-8."""
    mesh = pad()
    system = PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, gel(nu), "bbar"))
    load = np.random.default_rng(3).normal(size=system.stiffness.shape[0])
    return int(pad_solver(system, "pcg").solve(load, 1e-8).iterations)


def resultants(cells: int, weighting: Weighting) -> NDArray[np.float64]:
    """Return normal and tangential force in N of a disc that is moved by 0.1 mm."""
    outline = RoundedRectangle(8.0, 8.0, 4.0)
    mesh, _ = build_pad_mesh(outline, 2.0, cells=(cells, cells, 3), weighting=weighting)
    operator = surface_operator(mesh, gel(), "bbar", "pcg", rtol=1e-7)
    moves = np.array([[0.0, 0.0, -0.1], [0.1, 0.0, 0.0]])
    totals = [operator.force(np.tile(m, (len(mesh.surface), 1))).sum(axis=0) for m in moves]
    return np.array([totals[0][2], totals[1][0]])


def cut_cells(cells: tuple[int, ...] = CELLS) -> dict[str, Any]:
    """Return the larger relative error of both resultants by weighting, against 96 cells."""
    exact = resultants(96, "volume_fraction")
    errors = {
        weighting: [float(np.abs(resultants(n, weighting) / exact - 1).max()) for n in cells]
        for weighting in WEIGHTINGS
    }
    return {"cells": list(cells), "error": errors}


def noise(nu: float, noise_um: float, draws: int = DRAWS) -> dict[str, Any]:
    """Return the mean field error and the scatter of F_z of a press of 2 N with shear."""
    mesh = pad()
    exact, quick = (surface_operator(mesh, gel(nu), "bbar", r) for r in ("factor", "fft"))
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    square = (points[:, :2] ** 2).sum(axis=1)
    shape = np.sqrt(np.maximum(1 - square / 9.0, 0.0))
    force = np.outer(shape / shape.sum(), [0.8, 0.0, -2.0])
    motion, mask = exact.displacement(force), square < 3.3**2
    smooth, start, seen = smoothing(points, 0.7), None, []
    for seed in range(draws):
        draw = np.random.default_rng(seed).normal(size=motion.shape)
        noisy = motion + 1e-3 * noise_um * draw
        direct = exact.force(noisy)
        start = masked_force(quick, noisy, mask, friction=1.0, start_n=start).force_n
        seen.append(
            [
                (np.linalg.norm(f - force) / np.linalg.norm(force), f[:, 2].sum() / -2.0 - 1)
                for f in (direct, smooth @ direct, start)
            ]
        )
    fields, pushes = np.moveaxis(np.array(seen), 2, 0)
    found = {
        way: {
            "field": float(fields[:, k].mean()),
            "normal": float(pushes[:, k].std()),
            "normal_mean": float(pushes[:, k].mean()),
        }
        for k, way in enumerate(("direct", "smoothed", "masked"))
    }
    return {"poissons_ratio": nu, "noise_um": noise_um, "draws": draws, **found}


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder with data/")
    docs = parser.parse_args().docs
    record = {
        **machine(),
        "seed": 3,
        "iterations": [{"poissons_ratio": nu, "iterations": iterations(nu)} for nu in NUS],
        "cut_cells": cut_cells(),
        "noise": [noise(nu, um) for nu in (0.3223, 0.49) for um in (5, 20)],
    }
    print(write_data("stiffness_cases", record, docs))


if __name__ == "__main__":
    main()
