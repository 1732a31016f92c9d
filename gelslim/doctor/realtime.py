"""How fast this machine computes forces: times of the operators of a small pad."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

CELLS, CELL_MM, LAYERS = 32, 0.6, 4
PASSES = 4
"""Calls of the operator per frame, about as many as the pipeline makes with a contact model."""
FRAME_RATE_HZ = 90.0
"""Frame rate of the Raspberry Pi spy camera at 640 × 480."""


@dataclass(frozen=True)
class Timed:
    """Time of a call of an operator in ms, on one BLAS thread and on the default number."""

    operator: str
    one_thread_ms: float
    all_threads_ms: float

    @property
    def best_ms(self) -> float:
        """The smaller of the two times in ms."""
        return min(self.one_thread_ms, self.all_threads_ms)


@dataclass(frozen=True)
class RealTime:
    """Times of operators on a pad of 32 × 32 cells in four layers."""

    operators: tuple[Timed, ...]

    @property
    def quickest(self) -> Timed:
        """The quickest operator."""
        return min(self.operators, key=lambda t: t.best_ms)

    @property
    def ready(self) -> bool:
        """Whether `PASSES` calls of the quickest operator fit into a frame."""
        return self.quickest.best_ms * PASSES < 1000 / FRAME_RATE_HZ

    @property
    def advice(self) -> str:
        """What to set if more threads are slower; empty if they are not."""
        worse = [t for t in self.operators if t.all_threads_ms > 1.5 * t.one_thread_ms]
        if not worse:
            return ""
        names = ", ".join(t.operator for t in worse)
        return (
            f"more BLAS threads slow down {names}: set OMP_NUM_THREADS=1 and "
            "OPENBLAS_NUM_THREADS=1 for the force pipeline"
        )


def time_operators() -> RealTime:
    """Measure the FFT, iterative and factored operators, which takes a second or two."""
    from threadpoolctl import threadpool_limits

    from ifem_export.elements.material import Material
    from ifem_export.mesh.pad_mesh import PadMesh
    from ifem_export.operators.ladder import bumps, timed_ms
    from ifem_export.operators.surface_operator import surface_operator

    side, thickness = CELLS * CELL_MM, 2.0
    mesh = PadMesh.from_occupancy(
        np.ones((CELLS, CELLS, LAYERS), bool),
        (CELL_MM, CELL_MM, thickness / LAYERS),
        (-side / 2, -side / 2, -thickness),
    )
    gel = Material(0.147, 0.3223, 1000.0)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    fields = [field(points) for field in bumps(mesh)]
    choices: tuple[tuple[Any, dict[str, Any]], ...] = (
        ("fft", {}),
        ("pcg", {"rtol": 1e-2}),
        ("factor", {}),
    )
    timed = []
    for rung, parameters in choices:
        operator = surface_operator(mesh, gel, "bbar", rung, **parameters)
        with threadpool_limits(1):
            alone = timed_ms(operator, fields)
        timed.append(Timed(rung, alone, timed_ms(operator, fields)))
    return RealTime(tuple(timed))
