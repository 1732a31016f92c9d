"""What each surface operator costs in error and time, measured for one sensor.

The reference is the same pad at half the pitch with eight B-bar layers, its inner nodes solved for
to 1e-8; its forces are lumped to the coarse nodes by the bilinear functions. Fields are smooth
bumps about a pad thickness wide, sideways and down: narrower ones no marker grid resolves. Those
that reach the pad's edge err more and are told apart.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.operator_ladder import MeasuredRung, OperatorLadder, operator_label
from ifem_export.operators.single_thread import single_threaded
from ifem_export.operators.surface_operator import (
    CROWNED_RUNGS,
    Rung,
    SurfaceOperator,
    surface_operator,
)

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
SurfaceMotion = Callable[[Array], Array]
REFERENCE_LAYERS = 8
REFERENCE_ELEMENT: Formulation = "bbar"
REFERENCE_RTOL = 1e-8
FIELD_SEED = 7
TIMED_S, TIMED_ROUNDS = 0.12, 3
NOISE_SEED, NOISE_DRAWS = 11, 6
_MARGIN = 4
"""Nodes by which the boxes of a mesh and its reference may differ, and one more."""
Choice = tuple[Rung, dict[str, Any]]
CHOICES: tuple[Choice, ...] = (
    ("paper", {}),
    ("truncated", {"radius": 3}),
    ("truncated", {"radius": 6}),
    ("fft", {}),
    ("fft", {"lumped": 1}),
    ("pcg", {"rtol": 1e-2}),
    ("pcg", {"rtol": 1e-4}),
    ("factor", {}),
)
DENSE: tuple[Choice, ...] = (("dense32", {}),)


@single_threaded
def measure_ladder(
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    *,
    dense: bool = False,
    progress: Progress | None = None,
    reference: PadMesh | None = None,
) -> OperatorLadder:
    """Measure every operator of a pad; `dense` adds the dense rung, which takes much longer.

    `reference` is a finer mesh of the same gel on a lattice of half the pitch that has the nodes of
    this one; by default `refined(mesh)`, which a crowned pad does not have.
    Raises MeshError for a pad whose layers differ unless it is crowned.
    """
    tell = progress or (lambda text, done, total: None)
    choices = operator_choices(mesh, dense)
    fine = refined(mesh) if reference is None else reference
    steps = len(choices) + 1
    tell("reference", 0, steps)
    fields = bumps(mesh)
    at_edge = edge_bumps(mesh)
    expected, expected_at_edge = (
        [reference_force(mesh, material, field, fine) for field in some]
        for some in (fields, at_edge)
    )
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    moved = [field(points) for field in fields]
    moved_at_edge = [field(points) for field in at_edge]
    exact = surface_operator(mesh, material, formulation, "pcg", rtol=REFERENCE_RTOL)
    condensed = [exact.force(u) for u in moved]
    rungs = []
    for done, (rung, parameters) in enumerate(choices):
        tell(rung, done + 1, steps)
        operator = surface_operator(mesh, material, formulation, rung, **parameters)
        found = [operator.force(u) for u in moved]
        found_at_edge = [operator.force(u) for u in moved_at_edge]
        rungs.append(
            MeasuredRung(
                rung=rung,
                parameters=parameters,
                error_field=max(map(_off, found, expected)),
                error_operator=max(map(_off, found, condensed)),
                error_resultant=max(map(_resultant_off, found, expected)),
                noise_node_n_per_mm=float(np.std(noise := noisy(operator, len(points)))),
                noise_resultant_n_per_mm=float(np.sqrt(np.mean(noise.sum(axis=1) ** 2))),
                milliseconds=_one_thread_ms(operator, moved),
                n_bytes=operator.n_bytes,
                error_edge=max(map(_off, found_at_edge, expected_at_edge)),
            )
        )
    told = (
        f"{fine.layers} {REFERENCE_ELEMENT} layers at half the pitch, inner solve to "
        f"{REFERENCE_RTOL:g}"
    )
    return OperatorLadder(tuple(rungs), told, mesh.layers, formulation, material.poissons_ratio)


def operator_choices(mesh: PadMesh, dense: bool = False) -> tuple[Choice, ...]:
    """The operators that a pad has, with their parameters."""
    choices = CHOICES + (DENSE if dense else ())
    if mesh.surface_shift is not None:
        return tuple(c for c in choices if c[0] in CROWNED_RUNGS)
    return choices


def time_operators(
    choices: Sequence[Choice],
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    progress: Progress | None = None,
) -> dict[str, float]:
    """Times in ms of operators on this machine now, by label; errors need no measuring anew."""
    tell = progress or (lambda text, done, total: None)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    moved = [field(points) for field in bumps(mesh)]
    times: dict[str, float] = {}
    for done, (rung, parameters) in enumerate(choices):
        label = operator_label(rung, parameters)
        tell(label, done, len(choices))
        operator = surface_operator(mesh, material, formulation, rung, **parameters)
        # The least of several medians: another program can only make one of them longer.
        times[label] = min(_one_thread_ms(operator, moved) for _ in range(TIMED_ROUNDS))
    return times


def bumps(mesh: PadMesh) -> list[SurfaceMotion]:
    """Smooth surface motions (n, 3) mm of points (n, 3), one per direction and one off the middle.

    They fade before they reach the pad's edge.
    """
    rng = np.random.default_rng(FIELD_SEED)
    places = [*rng.uniform(-0.4, 0.4, (3, 2)), (0.75, 0.0)]
    ways = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.3, 0.1, -0.7)]
    return _bumps(mesh, places, ways)


def edge_bumps(mesh: PadMesh) -> list[SurfaceMotion]:
    """Motions as those of `bumps`, but across an edge and at a corner: what errs most."""
    return _bumps(mesh, [(0.95, 0.0), (-0.85, 0.85)], [(1.0, 0.0, 0.0), (0.8, 0.5, -0.3)])


def _bumps(
    mesh: PadMesh, places: Sequence[ArrayLike], ways: Sequence[ArrayLike]
) -> list[SurfaceMotion]:
    """Bumps at places in shares of the pad's half extent."""
    points = np.asarray(mesh.nodes_mm)[mesh.surface][:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    thickness = mesh.layers * mesh.cell_size_mm[2]
    width = max(thickness, 2.5 * max(mesh.cell_size_mm[:2]))
    middle, span = (low + high) / 2, (high - low) / 2
    return [
        _bump(middle + np.asarray(place) * span, width, np.asarray(way, dtype=float))
        for place, way in zip(places, ways, strict=True)
    ]


def reference_force(
    mesh: PadMesh,
    material: Material,
    field: SurfaceMotion,
    fine: PadMesh | None = None,
) -> Array:
    """Forces (c, 3) on the coarse surface nodes, from the pad at half pitch and eight layers."""
    fine = refined(mesh) if fine is None else fine
    operator = surface_operator(fine, material, REFERENCE_ELEMENT, "pcg", rtol=REFERENCE_RTOL)
    force = operator.force(field(np.asarray(fine.nodes_mm)[fine.surface]))
    return lumped(force, fine, mesh)


def refined(mesh: PadMesh) -> PadMesh:
    """The same pad, cut cells quartered as they are, at half the lateral pitch with eight layers.

    Raises MeshError for a crowned pad: its cells do not say how the crown goes on between them.
    """
    if mesh.surface_shift is not None:
        raise MeshError("a crowned pad has to be meshed anew for a reference: give one")
    hx, hy, hz = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy)[:, :, 0].repeat(2, axis=0).repeat(2, axis=1)
    cells = np.repeat(plan[:, :, None], REFERENCE_LAYERS, axis=2)
    size = (hx / 2, hy / 2, hz * mesh.layers / REFERENCE_LAYERS)
    if mesh.fill is None:
        return PadMesh.from_occupancy(cells, size, mesh.origin_mm)
    fill = np.asarray(mesh.fill)[:, :, 0].repeat(2, axis=0).repeat(2, axis=1)
    return PadMesh.from_occupancy(
        cells, size, mesh.origin_mm, np.repeat(fill[:, :, None], REFERENCE_LAYERS, axis=2)
    )


def lumped(force: Array, fine: PadMesh, coarse: PadMesh) -> Array:
    """Forces of fine surface nodes on coarse ones, by the coarse bilinear functions."""
    offset = (np.array(coarse.origin_mm) - fine.origin_mm) / fine.cell_size_mm
    right, up = (int(n) + _MARGIN for n in np.rint(offset[:2]))
    j, i = _places(fine)
    rows, columns = _places(coarse)
    extent = (max(j.max(), 2 * rows.max() + up), max(i.max(), 2 * columns.max() + right))
    lattice = np.zeros((extent[0] + 2 * _MARGIN, extent[1] + 2 * _MARGIN, 3))
    lattice[j + _MARGIN, i + _MARGIN] = force
    total = np.zeros((len(rows), 3))
    for dy, wy in ((-1, 0.5), (0, 1.0), (1, 0.5)):
        for dx, wx in ((-1, 0.5), (0, 1.0), (1, 0.5)):
            total += wy * wx * lattice[2 * rows + up + dy, 2 * columns + right + dx]
    return total


def noisy(operator: SurfaceOperator, count: int) -> Array:
    """Forces (draws, c, 3) in N for unit noise on every surface displacement, mm."""
    rng = np.random.default_rng(NOISE_SEED)
    return np.stack([operator.force(rng.normal(size=(count, 3))) for _ in range(NOISE_DRAWS)])


def timed_ms(operator: SurfaceOperator, fields: list[Array]) -> float:
    """Median time of a call in ms, after a first one."""
    operator.force(fields[0])
    times: list[float] = []
    while sum(times) < TIMED_S or len(times) < 3:
        started = time.perf_counter()
        operator.force(fields[len(times) % len(fields)])
        times.append(time.perf_counter() - started)
    return float(np.median(times)) * 1000


def _one_thread_ms(operator: SurfaceOperator, fields: list[Array]) -> float:
    """`timed_ms` with one BLAS thread, as the force pipeline runs its frames.

    More of them wait for each other: on a busy machine up to forty times longer (pcg).
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        return timed_ms(operator, fields)


def _bump(place: Array, width: float, way: Array) -> SurfaceMotion:
    def field(points: Array) -> Array:
        square = ((points[:, :2] - place) ** 2).sum(axis=1)
        return np.asarray(0.1 * np.exp(-square / (2 * width**2))[:, None] * way)

    return field


def _places(mesh: PadMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Lattice rows and columns of the surface nodes."""
    numbering = mesh.numbering
    _, j, i = np.unravel_index(numbering.positions[mesh.surface], numbering.shape)
    return j, i


def _off(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def _resultant_off(found: Array, expected: Array) -> float:
    miss = np.linalg.norm(found.sum(axis=0) - expected.sum(axis=0))
    return float(miss / np.linalg.norm(expected.sum(axis=0)))
