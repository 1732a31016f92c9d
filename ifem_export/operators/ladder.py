"""Measurement of the error and the time of each surface operator of one sensor.

The reference is the same pad at half the pitch with eight B-bar layers, whose inner nodes are
solved for to 1e-8. Its forces are lumped to the coarse nodes by the bilinear shape functions. Some
test motions are prescribed: smooth bumps about as wide as the pad is thick, tangential and normal,
in the middle and at the edge. The others are the motions of the reference under the contacts of
`ladder_contacts`: a small ball, a sharp punch, a contact at the edge and two contacts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.elements.hex8 import Formulation, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.crowned_system import pad_system
from ifem_export.operators.ladder_contacts import (
    contact_motions,
    nodal_forces,
    standard_contacts,
    surface_positions,
)
from ifem_export.operators.matrix_free import MatrixFreeOperator
from ifem_export.operators.operator_ladder import (
    ContactError,
    MeasuredRung,
    OperatorLadder,
    operator_label,
)
from ifem_export.operators.single_thread import single_threaded
from ifem_export.operators.surface_operator import (
    CROWNED_RUNGS,
    Rung,
    SurfaceOperator,
    surface_operator,
    system_operator,
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


@dataclass(frozen=True, eq=False)
class _Test:
    """A motion (c, 3) in mm of the surface nodes and the forces (c, 3) in N that belong to it."""

    motion_mm: Array
    force_n: Array

    def errors(self, operator: SurfaceOperator) -> ContactError:
        return self.errors_of(operator.force(self.motion_mm))

    def errors_of(self, found_n: Array) -> ContactError:
        """Errors of forces (c, 3) in N for the motion."""
        expected = self.force_n
        return ContactError(_relative_error(found_n, expected), _resultant_error(found_n, expected))


@single_threaded
def measure_ladder(
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    *,
    dense: bool = False,
    progress: Progress | None = None,
    reference: PadMesh | None = None,
    timed: bool = True,
) -> OperatorLadder:
    """Measure error, noise gain and time of every surface operator of a pad.

    Args:
        mesh: The pad.
        material: The gel.
        formulation: Hex-8 formulation of the elements.
        dense: Whether the dense operator is measured too, which takes much longer.
        progress: Called with what is measured, the steps done and the steps in total.
        reference: Finer mesh of the same gel, on a lattice of half the pitch that contains the
            nodes of `mesh`. By default it is `refined(mesh)`; a crowned pad needs one.
        timed: Whether times are measured. Without them the ladder is the same on every machine.

    Returns:
        The ladder, with the operators in the order in which they were measured.

    Raises:
        MeshError: The pad is neither flat nor crowned, or it is crowned without a reference.
    """
    report = progress or (lambda text, done, total: None)
    choices = operator_choices(mesh, dense)
    fine = refined(mesh) if reference is None else reference
    report("reference", 0, len(choices) + 1)
    reference_operator = reference_of(fine, material)
    smooth = _prescribed(mesh, bumps(mesh), reference_operator, fine)
    at_edge = _prescribed(mesh, edge_bumps(mesh), reference_operator, fine)
    contacts = _contacts(mesh, reference_operator, fine)
    fields = [test.motion_mm for test in smooth]
    system = pad_system(mesh, hex8_stiffness(mesh.cell_size_mm, material, formulation))
    exact = system_operator(system, "pcg", rtol=REFERENCE_RTOL)
    condensed = [exact.force(u) for u in fields]
    rungs = []
    for done, (rung, parameters) in enumerate(choices):
        report(rung, done + 1, len(choices) + 1)
        if rung == "paper":
            operator = surface_operator(mesh, material, formulation, rung)
        else:
            operator = system_operator(system, rung, **parameters)
        noise = noise_forces(operator, system.columns)
        forces = [operator.force(u) for u in fields]
        errors = [test.errors_of(found) for test, found in zip(smooth, forces, strict=True)]
        rungs.append(
            MeasuredRung(
                rung=rung,
                parameters=parameters,
                error_field=max(error.field for error in errors),
                error_operator=max(map(_relative_error, forces, condensed)),
                error_resultant=max(error.resultant for error in errors),
                noise_node_n_per_mm=float(np.std(noise)),
                noise_resultant_n_per_mm=float(np.sqrt(np.mean(noise.sum(axis=1) ** 2))),
                milliseconds=_one_thread_ms(operator, fields) if timed else None,
                n_bytes=operator.n_bytes,
                error_edge=max(test.errors(operator).field for test in at_edge),
                contacts={name: test.errors(operator) for name, test in contacts.items()},
            )
        )
    description = (
        f"{fine.layers} {REFERENCE_ELEMENT} layers at half the pitch, inner solve to "
        f"{REFERENCE_RTOL:g}"
    )
    ratio = material.poissons_ratio
    ladder = OperatorLadder(tuple(rungs), description, mesh.layers, formulation, ratio)
    return ladder.rounded() if timed else ladder.untimed()


def reference_of(fine: PadMesh, material: Material) -> SurfaceOperator:
    """Exact operator of the reference mesh; the matrix is assembled only for a cut or crowned one.

    Raises MeshError for a pad that is neither flat nor crowned.
    """
    system = pad_system(fine, hex8_stiffness(fine.cell_size_mm, material, REFERENCE_ELEMENT))
    if system.is_cut:
        return system_operator(system, "pcg", rtol=REFERENCE_RTOL)
    return MatrixFreeOperator(system, REFERENCE_RTOL)


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
    """Times in ms of operators on this machine, by label. Their errors do not depend on it."""
    report = progress or (lambda text, done, total: None)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    fields = [motion(points) for motion in bumps(mesh)]
    times: dict[str, float] = {}
    for done, (rung, parameters) in enumerate(choices):
        label = operator_label(rung, parameters)
        report(label, done, len(choices))
        operator = surface_operator(mesh, material, formulation, rung, **parameters)
        # The smallest of several medians, because another program can only make one longer.
        times[label] = min(_one_thread_ms(operator, fields) for _ in range(TIMED_ROUNDS))
    return times


def bumps(mesh: PadMesh) -> list[SurfaceMotion]:
    """Smooth motions (n, 3) in mm of surface points (n, 3): one per axis and an oblique one.

    They decay before they reach the pad's edge.
    """
    rng = np.random.default_rng(FIELD_SEED)
    centres = [*rng.uniform(-0.4, 0.4, (3, 2)), (0.75, 0.0)]
    directions = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.3, 0.1, -0.7)]
    return _bumps(mesh, centres, directions)


def edge_bumps(mesh: PadMesh) -> list[SurfaceMotion]:
    """Motions as those of `bumps`, but at an edge and at a corner, where errors are largest."""
    return _bumps(mesh, [(0.95, 0.0), (-0.85, 0.85)], [(1.0, 0.0, 0.0), (0.8, 0.5, -0.3)])


def _bumps(
    mesh: PadMesh, centres: Sequence[ArrayLike], directions: Sequence[ArrayLike]
) -> list[SurfaceMotion]:
    """Bumps whose centres are given in half extents of the pad."""
    points = np.asarray(mesh.nodes_mm)[mesh.surface][:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    thickness = mesh.layers * mesh.cell_size_mm[2]
    width = max(thickness, 2.5 * max(mesh.cell_size_mm[:2]))
    middle, span = (low + high) / 2, (high - low) / 2
    return [
        _bump(middle + np.asarray(centre) * span, width, np.asarray(direction, dtype=float))
        for centre, direction in zip(centres, directions, strict=True)
    ]


def reference_forces(
    mesh: PadMesh,
    material: Material,
    motions: Sequence[SurfaceMotion],
    fine: PadMesh | None = None,
) -> list[Array]:
    """Forces (c, 3) in N on the surface nodes of `mesh`, computed on the finer mesh `fine`.

    One for each motion of the surface.
    """
    fine = refined(mesh) if fine is None else fine
    operator = reference_of(fine, material)
    return [test.force_n for test in _prescribed(mesh, motions, operator, fine)]


def _prescribed(
    mesh: PadMesh, motions: Sequence[SurfaceMotion], operator: SurfaceOperator, fine: PadMesh
) -> list[_Test]:
    """Tests whose motion is given; their forces are those of the reference."""
    coarse_mm, fine_mm = np.asarray(mesh.surface_mm), np.asarray(fine.surface_mm)
    return [
        _Test(motion(coarse_mm), lumped(operator.force(motion(fine_mm)), fine, mesh))
        for motion in motions
    ]


def _contacts(mesh: PadMesh, operator: SurfaceOperator, fine: PadMesh) -> dict[str, _Test]:
    """Tests whose forces are given; their motions are those of the reference."""
    contacts = standard_contacts(mesh)
    forces = [nodal_forces(fine, discs) for discs in contacts.values()]
    moved = contact_motions(operator, fine, mesh, forces)
    tests = [_Test(u, lumped(f, fine, mesh)) for u, f in zip(moved, forces, strict=True)]
    return dict(zip(contacts, tests, strict=True))


def refined(mesh: PadMesh) -> PadMesh:
    """The same pad at half the lateral pitch with eight layers; cut cells keep their fraction.

    Raises MeshError for a crowned pad, because its cells do not determine the crown between them.
    """
    if mesh.surface_shift is not None:
        raise MeshError(
            "a crowned pad cannot be refined from its cells: give a reference mesh",
            field="reference",
        )
    hx, hy, hz = mesh.cell_size_mm
    size = (hx / 2, hy / 2, hz * mesh.layers / REFERENCE_LAYERS)
    split = np.ones((2, 2, REFERENCE_LAYERS))
    cells = np.kron(mesh.occupancy[:, :, :1], split).astype(bool)
    fill = None if mesh.fill is None else np.kron(mesh.fill[:, :, :1], split).astype(np.float64)
    return PadMesh.from_occupancy(cells, size, mesh.origin_mm, fill)


def lumped(force: Array, fine: PadMesh, coarse: PadMesh) -> Array:
    """Forces of the fine surface nodes, lumped to the coarse ones by their bilinear functions."""
    offset = (np.array(coarse.origin_mm) - fine.origin_mm) / fine.cell_size_mm
    right, up = (int(n) for n in np.rint(offset[:2]))
    (fine_rows, fine_columns), (rows, columns) = (
        fine.numbering.shape[1:],
        coarse.numbering.shape[1:],
    )
    lattice = np.zeros((fine_rows, fine_columns, 3))
    lattice[surface_positions(fine)] = force
    along_y, along_x = _hats(rows, fine_rows, up), _hats(columns, fine_columns, right)
    total = np.einsum("rj,jic,si->rsc", along_y, lattice, along_x, optimize=True)
    return np.asarray(total[surface_positions(coarse)])


def _hats(coarse: int, fine: int, offset: int) -> Array:
    """Linear functions (coarse, fine) of nodes along an axis, at the nodes of half the pitch."""
    distance = 2 * np.arange(coarse)[:, None] + offset - np.arange(fine)
    return np.maximum(1.0 - np.abs(distance) / 2.0, 0.0)


def noise_forces(operator: SurfaceOperator, count: int) -> Array:
    """Forces (draws, c, 3) in N for independent noise of 1 mm on every surface displacement."""
    rng = np.random.default_rng(NOISE_SEED)
    return np.stack([operator.force(rng.normal(size=(count, 3))) for _ in range(NOISE_DRAWS)])


def timed_ms(operator: SurfaceOperator, fields: list[Array]) -> float:
    """Median time of a call in ms, after a first call that is not timed."""
    operator.force(fields[0])
    times: list[float] = []
    while sum(times) < TIMED_S or len(times) < 3:
        started = time.perf_counter()
        operator.force(fields[len(times) % len(fields)])
        times.append(time.perf_counter() - started)
    return float(np.median(times)) * 1000


def _one_thread_ms(operator: SurfaceOperator, fields: list[Array]) -> float:
    """`timed_ms` with one BLAS thread, as the force pipeline processes its frames.

    On a busy machine several threads wait for each other, which takes up to forty times longer.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        return timed_ms(operator, fields)


def _bump(centre: Array, width: float, direction: Array) -> SurfaceMotion:
    def field(points: Array) -> Array:
        square = ((points[:, :2] - centre) ** 2).sum(axis=1)
        return np.asarray(0.1 * np.exp(-square / (2 * width**2))[:, None] * direction)

    return field


def _relative_error(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def _resultant_error(found: Array, expected: Array) -> float:
    miss = np.linalg.norm(found.sum(axis=0) - expected.sum(axis=0))
    return float(miss / np.linalg.norm(expected.sum(axis=0)))
