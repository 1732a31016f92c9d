"""Deep contacts of rigid shapes with a neo-Hookean gel, solved on a finer mesh than the bundle's.

The pad has half the pitch of the bundle's and five layers instead of four. Contact with Coulomb's
friction is the twin's, by Newton's method on the whole gel; `tests/calculix` compares contacts of
this kind with CalculiX. Solving one takes about 20 s, so that the motion of the surface and the
forces are stored: `python -m bench.force.solved_contacts` solves them again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sensor_samples import sensor_bundle

from gelslim_twin.contact.gel_body import GelBody
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.contact.newton_contact import NewtonContact, SolidState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh

Array = NDArray[np.float64]
Profile = Callable[[Array, Array], Array]
STORED = Path(__file__).with_name("deep_contacts.npz")
KINDS = ("ball", "rod", "ring", "punch", "two balls", "cone", "tilted plane")
COUNT, SEEN = 63, 42
"""Contacts that are stored, and those that were looked at when the estimate was made: the others
are held out."""
SOFT, NEARLY_INCOMPRESSIBLE = 0.3223, 0.45
"""Poisson's ratios of the two sensors, which take turns after each round of kinds."""
STEP_MM, QUANTUM_MM = 0.2, 1e-4
"""Largest step of the depth, and the resolution at which motions are stored."""
THICKNESS_MM = 2.0
_CELLS, _LAYERS = (58, 48), 5
_TOLERANCE = 1e-3
_HALVINGS = 5


@dataclass(frozen=True)
class DeepCase:
    """What is pressed, and how.

    Attributes:
        kind: One of `KINDS`.
        designed_ratio: Poisson's ratio of the sensor as designed.
        poissons_ratio: That of the gel.
        thickness: Of the gel, relative to the design.
        depth: Of the deepest point over the designed thickness.
        friction: Coulomb's coefficient.
        sizes: Parameters of the shape between 0 and 1.
        place_mm: Of its origin.
        turn_deg: Of the shape about z.
        tilt_deg: About x and y.
        drag_mm: Motion along x and y after the push.
        twist_deg: Torsion after the push.
    """

    kind: str
    designed_ratio: float
    poissons_ratio: float
    thickness: float
    depth: float
    friction: float
    sizes: tuple[float, float]
    place_mm: tuple[float, float]
    turn_deg: float
    tilt_deg: tuple[float, float]
    drag_mm: tuple[float, float]
    twist_deg: float


def deep_case(seed: int) -> DeepCase:
    """The case of a seed below `COUNT`: kinds take turns, all else is drawn."""
    rng = np.random.default_rng([41, seed])
    kind = KINDS[seed % len(KINDS)]
    designed = (SOFT, NEARLY_INCOMPRESSIBLE)[seed // len(KINDS) % 2]
    drag, way = 0.25 * rng.random(), 2 * np.pi * rng.random()
    tilt = rng.uniform(3, 8) * np.exp(2j * np.pi * rng.random()) if kind == "tilted plane" else 0j
    return DeepCase(
        kind=kind,
        designed_ratio=designed,
        poissons_ratio=float(designed + 0.004 * rng.uniform(-1.5, 1.5)),
        thickness=float(np.exp(0.015 * rng.uniform(-1.5, 1.5))),
        depth=float(rng.uniform(0.1, 0.3)),
        friction=float(rng.uniform(0.3, 0.8)),
        sizes=(float(rng.random()), float(rng.random())),
        place_mm=(float(rng.uniform(-4.5, 4.5)), float(rng.uniform(-4.5, 4.5))),
        turn_deg=float(rng.uniform(0, 180)),
        tilt_deg=(float(tilt.real), float(tilt.imag)),
        drag_mm=(float(drag * np.cos(way)), float(drag * np.sin(way))),
        twist_deg=float(rng.uniform(-6, 6)),
    )


def shape_of(case: DeepCase) -> Profile:
    """Height of the lower surface over the shape's lowest point; infinite beside it."""
    first, second = case.sizes
    c, s = np.cos(np.radians(case.turn_deg)), np.sin(np.radians(case.turn_deg))

    def turned(shape: Profile) -> Profile:
        return lambda x, y: shape(c * x + s * y, c * y - s * x)

    if case.kind == "ball":
        return lambda x, y: _arc(3 + 5 * first, np.hypot(x, y))
    if case.kind == "rod":  # with ends that are half balls
        radius, half = 1.5 + 2.5 * first, 1.5 + 2.5 * second
        return turned(lambda x, y: _arc(radius, np.hypot(np.maximum(np.abs(x) - half, 0), y)))
    if case.kind == "ring":  # a torus
        radius, middle = 0.8 + 0.8 * first, 2.0 + second
        return lambda x, y: _arc(radius, np.abs(np.hypot(x, y) - middle))
    if case.kind == "two balls":
        radius, half = 2 + 2 * first, 1.8 + 1.2 * second
        return turned(lambda x, y: _arc(radius, np.hypot(np.abs(x) - half, y)))
    if case.kind == "cone":
        lean, tip = np.radians(50 + 20 * first), 0.6 + 0.8 * second
        return lambda x, y: _cone(lean, tip, np.hypot(x, y))
    flat, rim = (1 + 1.5 * first, 0.5 + 0.5 * second)
    if case.kind == "tilted plane":
        flat, rim = 2 + first, 1 + second
    return lambda x, y: _arc(rim, np.maximum(np.hypot(x, y) - flat, 0))


def _arc(radius_mm: float, away: Array) -> Array:
    """Height of a ball over its lowest point; infinite beyond its radius."""
    inside = np.minimum(away, radius_mm)
    height = radius_mm - np.sqrt(np.maximum(radius_mm**2 - inside**2, 0))
    return np.asarray(np.where(away < radius_mm, height, np.inf))


def _cone(lean_rad: float, tip_mm: float, away: Array) -> Array:
    """Flanks at `lean_rad` from the axis behind a round tip that they touch."""
    edge, start = tip_mm * np.cos(lean_rad), tip_mm * (1 - np.sin(lean_rad))
    flank = start + (away - edge) / np.tan(lean_rad)
    return np.asarray(np.where(away <= edge, _arc(tip_mm, np.minimum(away, edge)), flank))


def finer_pad(thickness: float = 1.0) -> PadMesh:
    """Half the pitch of the bundle's pad, and five layers."""
    outline = RoundedRectangle(length_mm=22.0, width_mm=20.5, corner_radius_mm=1.0)
    mesh, _ = build_pad_mesh(outline, THICKNESS_MM, cells=(*_CELLS, _LAYERS))
    return mesh.stretched(thickness)


@dataclass(frozen=True, eq=False)
class DeepContact:
    """A solved contact for the modulus of the design.

    Attributes:
        case: What was pressed.
        moved_mm: (n, 3) motion of the surface nodes of `finer_pad`.
        force_n: (n, 3) on them.
    """

    case: DeepCase
    moved_mm: Array
    force_n: Array


def solve(case: DeepCase) -> DeepContact:
    """Press, then drag and twist. Raises ContactError where a step does not converge."""
    material = replace(sensor_bundle().material, poissons_ratio=case.poissons_ratio)
    pad = build_bundle(finer_pad(case.thickness), material, "bbar", with_stiffness=False)
    tool = Tool(((shape_of(case), (0.0, 0.0), 0.0),))
    settings = ContactSettings(_TOLERANCE, case.friction)
    solver = ContactSolver(SurfaceCompliance(pad), tool, settings)
    contact = NewtonContact(solver, GelBody(pad), _TOLERANCE)
    state, before = contact.released(), _untouched(case)
    for pose in _poses(case, tool, solver.points_mm):
        state, before = _stepped(contact, state, before, pose, _HALVINGS), pose
    return DeepContact(case, np.asarray(state.displacement_mm), np.asarray(state.force_n))


def _stepped(
    contact: NewtonContact, state: SolidState, before: Pose, pose: Pose, halvings: int
) -> SolidState:
    try:
        return contact.step(state, before, pose)
    except (ContactError, FiniteStrainError):
        if halvings == 0:
            raise
    middle = before.blended(pose, 0.5)
    half = _stepped(contact, state, before, middle, halvings - 1)
    return _stepped(contact, half, middle, pose, halvings - 1)


def _untouched(case: DeepCase) -> Pose:
    x, y = case.place_mm
    return Pose(x_mm=x, y_mm=y, tilt_x_deg=case.tilt_deg[0], tilt_y_deg=case.tilt_deg[1])


def _poses(case: DeepCase, tool: Tool, points_mm: Array) -> Iterator[Pose]:
    start = _untouched(case)
    above = float(tool.clearance_mm(start, points_mm).min())
    deepest = case.depth * THICKNESS_MM
    steps = int(np.ceil(deepest / STEP_MM))
    for share in np.arange(1, steps + 1) / steps:
        pressed = replace(start, time_s=share, depth_mm=above + share * deepest)
        yield pressed
    yield replace(
        pressed,
        time_s=2.0,
        x_mm=start.x_mm + case.drag_mm[0],
        y_mm=start.y_mm + case.drag_mm[1],
        twist_deg=case.twist_deg,
    )


def pack(contacts: list[DeepContact]) -> dict[str, NDArray[np.generic]]:
    """Arrays of a file of `COUNT` contacts: motions in steps of `QUANTUM_MM`, forces that act."""
    moved = [np.rint(c.moved_mm / QUANTUM_MM).astype(np.int16) for c in contacts]
    nodes = [np.flatnonzero(c.force_n.any(axis=1)) for c in contacts]
    force = [c.force_n[on].astype(np.float32) for c, on in zip(contacts, nodes, strict=True)]
    return {
        "moved": np.stack(moved).transpose(2, 0, 1),
        "count": np.array([len(on) for on in nodes]),
        "node": np.concatenate(nodes).astype(np.uint16),
        "force_n": np.concatenate(force),
    }


@cache
def _stored() -> dict[str, NDArray[np.generic]]:
    with np.load(STORED) as kept:
        return dict(kept)


def deep_contact(seed: int) -> DeepContact:
    """The stored contact of a seed below `COUNT`."""
    kept = _stored()
    moved = kept["moved"][:, seed].T * QUANTUM_MM
    end = np.cumsum(kept["count"])
    some = slice(end[seed] - kept["count"][seed], end[seed])
    force = np.zeros(moved.shape)
    force[kept["node"][some]] = kept["force_n"][some]
    return DeepContact(deep_case(seed), moved, force)
