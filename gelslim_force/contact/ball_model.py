"""Normal motion of the whole surface under a ball, by the exact solution of an elastic layer.

A mesh makes a sharp contact too weak: its nodes carry the pressure, and none of them lies on the
rim. At a node spacing of a third of the radius that is a tenth of the force. Here the pressure is
that of a ball on an endless layer, and its forces on the nodes are those of bilinear functions, so
that the mesh only has to tell how the surface moves around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.contact.indenter import Indenter, Sphere
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.layer.ball_table import BallTable
from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
_TURNS = 32
"""Points on each ring of the contact."""
_SIZE_STEP, _PLACE_STEP = 0.02, 0.1
"""Steps of differences, over the radius of contact and over the node spacing."""
_FORCE_SIGMA = 0.01
"""Relative error of the force at a known radius, by friction that is not known: without slip the
force is 1 to 3 % larger, by axisymmetric elements."""
_EDGE_SIGMA = 0.3
"""Error of what the pad's edge changes, over this change."""
_EDGE_THICKNESSES = 1.0
"""Distance of the rim from the edge, in thicknesses, from which the edge changes nothing."""


@dataclass(frozen=True)
class PadLayer:
    """What the endless layer in the place of the pad is made of.

    Attributes:
        young_mpa: Young's modulus.
        poissons_ratio: Poisson's ratio.
        thickness_mm: Thickness.
        skin_mm: Plane stiffness of the skin over Young's modulus; 0 for none.
    """

    young_mpa: float
    poissons_ratio: float
    thickness_mm: float
    skin_mm: float = 0.0

    @classmethod
    def of(cls, bundle: Bundle) -> PadLayer:
        """The layer of a sensor; a crowned pad is as thick as in its middle."""
        young, mesh = bundle.material.youngs_modulus_mpa, bundle.mesh
        skin = 0.0 if bundle.skin is None else bundle.skin.plane_stiffness_n_per_mm / young
        thickness_mm = float(mesh.layers * mesh.cell_size_mm[2])
        return cls(young, bundle.material.poissons_ratio, thickness_mm, skin)


@dataclass(frozen=True, eq=False)
class BallModel:
    """Contact of one ball on a pad.

    Near the edge of the pad, force and depth change in the ratio in which the contact on the mesh
    changes from the middle of the pad. A contact that the layer cannot tell has the motion of the
    mesh: another indenter, a depth that is given, a patch that is nearly as wide as the ball or as
    the pad.

    Attributes:
        mesh: Contact on the mesh, and its compliance.
        layer: The gel.
        ball_mm: Radius of the ball.
    """

    mesh: NormalModel
    layer: PadLayer
    ball_mm: float

    @property
    def points_mm(self) -> Array:
        """(c, 2) surface nodes."""
        return self.mesh.points_mm

    def prepare(self) -> None:
        """Compute now what the first contact would wait for."""
        self.mesh.prepare()
        _ = self._table, self._edge

    def motion(
        self, patch: ContactPatch, indenter: Indenter, depth_mm: float | None = None
    ) -> NormalReading:
        """Motion for the patch seen; arguments and errors are those of `NormalModel.motion`."""
        own = isinstance(indenter, Sphere) and indenter.radius_mm == self.ball_mm
        if depth_mm is not None or not own or not self._holds(patch):
            return self.mesh.motion(patch, indenter, depth_mm)
        depth = self._table.depth_mm(patch.size_mm)
        patch = patch.at_height(float(indenter.profile(patch.size_mm, 0.0)) - depth)
        size, spread = self._table.at_rest(patch.size_mm)
        at_rest = replace(patch, size_mm=size)
        of_depth, of_force = self._by_edge(at_rest, indenter)
        nodes, push = self._pushes(at_rest)
        push *= of_force
        covariance = patch.covariance[:3, :3].copy()
        covariance[2, 2] += spread**2
        share = np.hypot(_FORCE_SIGMA, _EDGE_SIGMA * (of_force - 1))
        # Of place and size by a root of their covariance, and of the force at this size.
        root = np.linalg.svd(covariance)
        errors = np.column_stack([push[:, 1:] @ (root[0] * np.sqrt(root[1])), share * push[:, 0]])
        moved = -self.mesh.compliance.apply(nodes, np.column_stack([push[:, 0], errors])).T
        touched = at_rest.outside_mm(*self.points_mm.T) < 0
        if not touched.any():
            touched[nodes[np.argmax(push[:, 0])]] = True
        return NormalReading(
            moved[0],
            np.linalg.norm(moved[1:], axis=0),
            touched,
            depth_mm=of_depth * self._table.depth_mm(size),
            push_n=float(push[:, 0].sum()),
            push_sigma_n=float(np.linalg.norm(errors.sum(axis=0))),
            errors_mm=moved[1:],
        )

    @cached_property
    def _table(self) -> BallTable:
        layer = self.layer
        return BallTable.of(self.ball_mm, layer.thickness_mm, layer.poissons_ratio, layer.skin_mm)

    @cached_property
    def _lattice(self) -> _Lattice:
        return _Lattice.of(self.points_mm)

    @cached_property
    def _edge(self) -> cKDTree:
        return cKDTree(self.points_mm[self._lattice.on_edge])

    def _holds(self, patch: ContactPatch) -> bool:
        reach = 1.1 * patch.size_mm + _EDGE_THICKNESSES * self.layer.thickness_mm
        return self._table.holds(1.1 * patch.size_mm) and reach < self._room_mm

    @cached_property
    def _room_mm(self) -> float:
        """Distance of the middle node from the edge."""
        return float(self._edge.query(self._lattice.middle_mm)[0])

    def _pushes(self, patch: ContactPatch) -> tuple[NDArray[np.intp], Array]:
        """Nodes (n,), their forces, and the derivatives of these by x, y and size, (n, 4)."""
        step, grown = _PLACE_STEP * self.mesh.pitch_mm, _SIZE_STEP * patch.size_mm
        steps = np.diag([step, step, grown])
        at = np.append(patch.centre_mm, patch.size_mm) + np.vstack([np.zeros(3), steps, -steps])
        loads = self._loads(at)
        nodes = np.flatnonzero(loads.any(axis=0))
        used = loads[:, nodes]
        slopes = (used[1:4] - used[4:]) / (2 * np.diag(steps)[:, None])
        return nodes, np.vstack([used[:1], slopes]).T

    def _loads(self, contacts: Array) -> Array:
        """Forces (s, c) of the pressure of contacts (s, 3) by x, y and size.

        What is beyond the edge of the pad goes to the nodes that bear the rest.
        """
        x, y, size = contacts.T[:, :, None, None]
        forces = self.layer.young_mpa * self._table.forces_per_mpa(contacts[:, 2])
        turn = 2 * np.pi / _TURNS * np.arange(_TURNS)
        ring = size * self._table.rings[:, None]
        each = np.broadcast_to(forces[..., None] / _TURNS, (*forces.shape, _TURNS))
        loads = self._lattice.loads(x + ring * np.cos(turn), y + ring * np.sin(turn), each)
        on_pad = loads.sum(axis=1, keepdims=True)
        whole = forces.sum(axis=1, keepdims=True)
        return loads * np.divide(whole, on_pad, out=np.zeros_like(whole), where=on_pad > 0)

    def _by_edge(self, patch: ContactPatch, ball: Indenter) -> tuple[float, float]:
        """Depth and force over those of the same contact in the middle of the pad."""
        reach = patch.size_mm + _EDGE_THICKNESSES * self.layer.thickness_mm
        if self._edge.query(patch.centre_mm)[0] > reach:
            return 1.0, 1.0
        # Both contacts lie in the same way between the nodes.
        cells = self._lattice.whole_cells(self._lattice.middle_mm - patch.centre_mm)
        here = self.mesh.motion(patch, ball)
        middle = self.mesh.motion(replace(patch, centre_mm=patch.centre_mm + cells), ball)
        if not (here.known and middle.known):
            return 1.0, 1.0
        return here.depth_mm / middle.depth_mm, here.push_n / middle.push_n


def contact_model(mesh: NormalModel, bundle: Bundle, indenter: Indenter) -> NormalModel | BallModel:
    """The most exact model of an indenter's contact with a sensor, whose contact on the mesh is
    `mesh`.
    """
    if not isinstance(indenter, Sphere) or bundle.mesh.surface_shift is not None:
        return mesh
    return BallModel(mesh, PadLayer.of(bundle), indenter.radius_mm)


@dataclass(frozen=True, eq=False)
class _Lattice:
    """The surface nodes (c,) on a regular lattice, of which some places may be empty."""

    origin_mm: Array
    step_mm: Array
    number: NDArray[np.intp]
    """(nx + 2, ny + 2) number of the node at each place, with a margin; c where there is none."""

    @classmethod
    def of(cls, points_mm: Array) -> _Lattice:
        steps = [np.diff(np.unique(np.round(values, 6))).min() for values in points_mm.T]
        step, origin = np.array(steps), points_mm.min(axis=0)
        place = np.rint((points_mm - origin) / step).astype(np.intp)
        number = np.full(place.max(axis=0) + 3, len(points_mm))
        number[tuple(place.T + 1)] = np.arange(len(points_mm))
        return cls(origin, step, number)

    @property
    def on_edge(self) -> NDArray[np.intp]:
        """Nodes that have an empty place beside them."""
        filled = self.number < self.number.max()
        inner = filled[1:-1, 1:-1]
        within = filled[2:, 1:-1] & filled[:-2, 1:-1] & filled[1:-1, 2:] & filled[1:-1, :-2]
        return self.number[1:-1, 1:-1][inner & ~within]

    @property
    def middle_mm(self) -> Array:
        """(2,) place in the middle of the lattice."""
        return self.origin_mm + self.step_mm * ((np.array(self.number.shape) - 3) // 2)

    def whole_cells(self, move_mm: Array) -> Array:
        """A move (2,) rounded to whole cells."""
        return np.rint(move_mm / self.step_mm) * self.step_mm

    def loads(self, x: Array, y: Array, force: Array) -> Array:
        """Forces (s, c) on the nodes of forces (s, ...) at points, by bilinear functions."""
        sets, count = len(x), int(self.number.max())
        step, (rows, columns) = self.step_mm, self.number.shape
        along, across = (x - self.origin_mm[0]) / step[0], (y - self.origin_mm[1]) / step[1]
        i, j = np.floor(along), np.floor(across)
        p, q = along - i, across - j
        # The margin of the lattice bears what is farther out.
        low = [np.clip(k, -1, n - 3).astype(np.intp) + 1 for k, n in ((i, rows), (j, columns))]
        number, own = self.number, (count + 1) * np.arange(sets).reshape(-1, *[1] * (x.ndim - 1))
        found = np.zeros(sets * (count + 1))
        for u, v in np.ndindex(2, 2):
            weight = np.abs(1 - u - p) * np.abs(1 - v - q) * force
            entry = number[low[0] + u, low[1] + v] + own
            found += np.bincount(entry.ravel(), weight.ravel(), len(found))
        return found.reshape(sets, -1)[:, :-1]
