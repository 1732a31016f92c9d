"""Derivative of the wrench by the poses of the bodies, at the contact set that was solved.

The laws of contact are differentiated as they stand (implicit differentiation; Alart and Curnier
1991 for the slipping node). Let a body move by a translation and a rotation φ about its origin. A
point x of the body moves by v, and the normal n at a node that is displaced by du changes by

    dn = φ × n + K (du - v),

with K from the curvature of the body. With the compliance C, du = C df. A node in contact stays on
the surface, n·(du - v) = 0. A node that sticks moves with its point of the body. A node that slips
with the slip s has the force f = -p (n + μ s/|s|), which is differentiated in the tangent plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import STICK
from gelslim_twin.contact.gel_state import AnchoredState, StickTargets
from gelslim_twin.contact.solver import Geometry
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.stepping.placement import Placement
from gelslim_twin.tools.tool_group import members_of
from ifem_export.operators.adjoint_fields import resultants

Array = NDArray[np.float64]
SHORTEST_SLIP_MM = 1e-12


@dataclass(frozen=True, eq=False)
class _Nodes:
    """The n nodes in contact, with their laws linearised.

    `by_motion` (n, 3, 3), `by_force` (n, 3, 3) and `by_pose` (n, 3, 6 k) are the coefficients of
    E du + B df = R dpose.
    """

    by_motion: Array
    by_force: Array
    by_pose: Array


def wrench_derivative(
    points_mm: Array,
    gel: AnchoredState,
    compliance: Array,
    placement: Placement,
    motions: Array,
    friction: float,
    geometry: Geometry = "displaced",
) -> Array:
    """Derivative of the wrench on the gel by the poses of the bodies.

    Args:
        points_mm: Surface nodes (c, 3) at rest.
        gel: A state of a linear gel with `touched`.
        compliance: C (3n, 3n) in mm/N among the touched nodes.
        placement: The bodies near the gel.
        motions: Rigid motions (k, 4, 4) of all bodies.
        friction: Coefficient of friction.
        geometry: Where the nodes meet the bodies.

    Returns:
        (6, 6 k): force in N and torque in N mm about the sensor's origin, by the translation of
        each body in mm and its rotation in rad about its own origin, both in the sensor frame.
    """
    touched = gel.touched
    assert touched is not None
    places = (points_mm + gel.displacement_mm)[touched.nodes]
    owners = placement.owners(places)
    laws = _laws(gel, points_mm, owners, placement, motions, friction, geometry)
    n, columns = len(places), laws.by_pose.shape[2]
    rows = laws.by_motion @ compliance.reshape(n, 3, 3 * n)
    grid = rows.reshape(n, 3, n, 3)
    grid[np.arange(n), :, np.arange(n), :] += laws.by_force
    solved = np.linalg.solve(rows.reshape(3 * n, 3 * n), laws.by_pose.reshape(3 * n, columns))
    change = solved.reshape(n, 3, columns)
    own = points_mm[touched.nodes]
    parts = [resultants(own, np.asarray(change[:, :, k])) for k in range(columns)]
    return np.stack(parts, axis=1)


def _laws(
    gel: AnchoredState,
    points_mm: Array,
    owners: NDArray[np.intp],
    placement: Placement,
    motions: Array,
    friction: float,
    geometry: Geometry,
) -> _Nodes:
    touched = gel.touched
    assert touched is not None
    rest = points_mm[touched.nodes]
    places = rest + gel.displacement_mm[touched.nodes]
    force, normal = gel.force_n[touched.nodes], touched.normal
    moved = gel.displacement_mm[touched.nodes] - touched.targets.target_mm
    carried = _carried(places, owners, motions)
    dragged = _dragged(places - moved, touched.targets, owners, placement, motions)
    if geometry == "rest":
        bend, turned = np.zeros((len(normal), 3, 3)), np.zeros_like(carried)
        lifted = _lifted(rest, owners, placement, motions)
    else:
        bend = _curvature(places, normal, owners, placement)
        turned = _turned(normal, owners, len(motions)) - bend @ carried
        lifted = normal[:, None, :] @ carried
    # Along the normal; along two tangents further down.
    across = _tangents(normal)
    lift = (moved * normal).sum(axis=1)[:, None, None]
    held_by_motion = across @ (np.eye(3) - lift * bend)
    held_by_pose = across @ (dragged + lift * turned)

    push = -(force * normal).sum(axis=1)[:, None, None]
    slip = moved - lift[:, 0] * normal
    length = np.maximum(np.linalg.norm(slip, axis=1), SHORTEST_SLIP_MM)[:, None]
    along = across @ (slip / length)[:, :, None]
    swing = friction * push / length[:, :, None] * (np.eye(2) - along @ along.transpose(0, 2, 1))
    pressed = friction * along @ force[:, None, :]
    slips_by_motion = (push * across - pressed) @ bend + swing @ held_by_motion
    slips_by_force = across - friction * along @ normal[:, None, :]
    slips_by_pose = (pressed - push * across) @ turned + swing @ held_by_pose

    sticks = (gel.touch[touched.nodes] == STICK)[:, None, None]
    return _Nodes(
        np.concatenate(
            [normal[:, None, :], np.where(sticks, held_by_motion, slips_by_motion)], axis=1
        ),
        np.concatenate(
            [np.zeros((len(places), 1, 3)), np.where(sticks, 0.0, slips_by_force)], axis=1
        ),
        np.concatenate([lifted, np.where(sticks, held_by_pose, slips_by_pose)], axis=1),
    )


def _lifted(rest: Array, owners: NDArray[np.intp], placement: Placement, motions: Array) -> Array:
    """Change (n, 1, 6 k) of the bodies' heights over points at rest (n, 3), by their poses."""
    met = placement.tool.above(placement.pose, rest)
    rise = met.normal[:, None, :] @ _carried(met.over(rest), owners, motions)
    return np.asarray(rise / met.normal[:, 2][:, None, None])


def _tangents(normal: Array) -> Array:
    """Two tangents (n, 2, 3) of unit normals (n, 3) that are not along y."""
    first = np.stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]], axis=1)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)


def _carried(places: Array, owners: NDArray[np.intp], motions: Array) -> Array:
    """Motion (n, 3, 6 k) of points that are fixed to their bodies, by the bodies' poses."""
    found = np.zeros((len(places), 3, 6 * len(motions)))
    for body in np.unique(owners):
        own = owners == body
        arm = places[own] - motions[body, :3, 3]
        found[own, :, 6 * body : 6 * body + 3] = np.eye(3)
        found[own, :, 6 * body + 3 : 6 * body + 6] = _crossed(arm)
    return found


def _dragged(
    stuck_at: Array,
    targets: StickTargets,
    owners: NDArray[np.intp],
    placement: Placement,
    motions: Array,
) -> Array:
    """Motion (n, 3, 6 k) of the places where nodes would stick, by the bodies' poses.

    A node that the body reached during the step sticks from then on, and so for a longer part of
    the step where the body goes deeper.
    """
    whole = stuck_at + (1 - targets.share)[:, None] * targets.dragged_mm
    found = targets.share[:, None, None] * _carried(whole, owners, motions)
    late = np.flatnonzero(targets.share_rate)
    if len(late) == 0:
        return found
    start = whole[late] - targets.dragged_mm[late]
    met = placement.tool.surface(placement.pose, start)
    axes = {
        body: rotation(pose)[:, 2]
        for body, pose in zip(placement.bodies, members_of(placement.pose), strict=True)
    }
    axis = np.stack([axes[body] for body in owners[late].tolist()])
    # The height over the node is taken along the axis of the tool, which turns with it.
    slant = (met.normal * axis).sum(axis=1)
    lifted = met.normal[:, None, :] @ _carried(start, owners[late], motions)
    height = lifted / slant[:, None, None]
    rate = targets.share_rate[late, None] * targets.dragged_mm[late]
    found[late] += rate[:, :, None] * height
    return found


def _turned(normal: Array, owners: NDArray[np.intp], bodies: int) -> Array:
    """Change (n, 3, 6 k) of normals that are fixed to their bodies, by the bodies' poses."""
    found = np.zeros((len(normal), 3, 6 * bodies))
    for body in np.unique(owners):
        own = owners == body
        found[own, :, 6 * body + 3 : 6 * body + 6] = _crossed(normal[own])
    return found


def _crossed(arm: Array) -> Array:
    """Matrices (n, 3, 3) of φ × arm by φ."""
    x, y, z = arm.T
    o = np.zeros_like(x)
    return np.stack([np.stack(row, axis=1) for row in ((o, z, -y), (-z, o, x), (y, -x, o))], axis=1)


def _curvature(
    places: Array, normal: Array, owners: NDArray[np.intp], placement: Placement
) -> Array:
    """K (n, 3, 3) in 1/mm: change of the normal by motion over the body.

    The height of a body is differentiated twice by central differences over its `smooth_mm`. Next
    to a rim, where these leave the body, it counts as flat.
    """
    found = np.zeros((len(places), 3, 3))
    for body, side, pose in zip(
        placement.bodies, placement.sides, members_of(placement.pose), strict=True
    ):
        own = owners == body
        turn, h = rotation(pose), side.smooth_mm
        x, y = ((places[own] - [pose.x_mm, pose.y_mm, -pose.depth_mm]) @ turn)[:, :2].T
        around = {
            (i, j): side.tool.local(x + i * h, y + j * h) for i in (-1, 0, 1) for j in (-1, 0, 1)
        }
        with np.errstate(invalid="ignore"):
            xx = around[1, 0] + around[-1, 0] - 2 * around[0, 0]
            yy = around[0, 1] + around[0, -1] - 2 * around[0, 0]
            xy = (around[1, 1] + around[-1, -1] - around[1, -1] - around[-1, 1]) / 4
        hessian = np.zeros((int(own.sum()), 3, 3))
        hessian[:, 0, 0], hessian[:, 1, 1] = xx, yy
        hessian[:, 0, 1] = hessian[:, 1, 0] = xy
        hessian[~np.isfinite(hessian).all(axis=(1, 2))] = 0.0
        local = normal[own] @ turn
        flat = np.eye(3) - local[:, :, None] * local[:, None, :]
        # The unit normal is (-slope, 1) over its length, which is 1 over its part along z.
        bend = -local[:, 2, None, None] * flat @ hessian / h**2
        found[own] = turn @ bend @ turn.T
    return found
