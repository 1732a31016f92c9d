"""Normal motion of the whole surface from the contact patch of a known indenter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from gelslim_force.contact.indenter import Flat, Indenter
from gelslim_force.contact.normal_compliance import Compliant, NormalCompliance
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch, rotated
from gelslim_force.layer.beyond_mesh import NearMotion
from ifem_export.compliance.contact_columns import ContactCompliance

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LOCAL_SHARE = 0.5
"""Part of a node's own compliance that increases where only a share of its area is loaded."""
_LEAST_SHARE = 0.02
_SHIFTS = ((0.25, 0.25), (0.25, -0.25), (-0.25, 0.25), (-0.25, -0.25))
_MOST_STEPS = 40
_DISCRETE = 0.1
"""Relative error of the depth for a patch as large as the node spacing; it falls with the square
of the size."""
_MESH = 0.004
"""Relative error of the depth by the mesh of the pad, for patches of any size: 1 % at most of balls
on an elastic layer, at Poisson's ratios up to 0.48."""


class NormalModel:
    """Frictionless contact of a rigid indenter on a pad's surface operator.

    Inside the patch the surface follows the indenter, w = profile - depth. Outside it the surface
    is free and bulges according to the elasticity of the pad. The depth is the one at which the
    pressure falls to zero at the rim seen: of all contact areas the true one has the largest force
    (Barber, J. Elasticity 4, 1974), so that dF/da = depth k'(a) - Φ'(a) = 0, where k is the
    stiffness of a flat punch with the outline of the patch and Φ is the reduction of its force by
    the profile. This needs no modulus.

    `points_mm` (c, 3) are the surface nodes in the operator's order, on a lattice of `pitch_mm`;
    `edge` takes the operator's place near the edge of the pad, and `beyond` adds what the mesh
    leaves out near a force.
    Not safe for use from two threads at once.
    """

    def __init__(
        self,
        operator: Compliant,
        points_mm: ArrayLike,
        edge: ContactCompliance | None = None,
        beyond: NearMotion | None = None,
    ) -> None:
        points = np.array(points_mm, dtype=float)
        if points.ndim != 2 or points.shape[1] < 2 or not np.isfinite(points).all():
            raise ValueError(f"surface nodes of shape {points.shape}: give (c, 3) finite, in mm")
        self.points_mm = points[:, :2]
        self.pitch_mm = _pitch(self.points_mm)
        near = None if beyond is None else (beyond, self.points_mm)
        self.compliance = NormalCompliance(operator, len(points), edge, near)

    def prepare(self) -> None:
        """Compute the full compliance now, so that no frame waits for a part of it."""
        self.compliance.prepare()

    def motion(
        self,
        patch: ContactPatch,
        indenter: Indenter,
        depth_mm: float | None = None,
    ) -> NormalReading:
        """Motion under `indenter` for the patch seen.

        `depth_mm` is given where the depth is known from elsewhere. The depth of a flat punch does
        not follow from its patch: without `depth_mm` the motion is unknown.
        Raises ValueError for a depth that is not positive and finite.
        """
        if depth_mm is None:
            if isinstance(indenter, Flat):
                return self._unknown(
                    "the depth of a flat punch does not follow from its patch: give the depth"
                )
            patch, depth, spread = self._settled(patch, indenter)
            if not np.isfinite(depth):
                return self._unknown(_why_no_depth(patch, indenter))
            # To first order the depth is proportional to the square of the patch's size.
            growth = 2 * depth / patch.size_mm
        else:
            if not (np.isfinite(depth_mm) and depth_mm > 0):
                raise ValueError(f"depth_mm = {depth_mm:g}: must be finite and above 0")
            depth, spread, growth = depth_mm, 0.0, 0.0
            patch = patch.at_height(self._rim_height(patch, indenter, depth))
        gap = depth - self._profile(patch, indenter)
        touched, push, factor = self._contact(gap, patch)
        if not len(touched):
            return self._unknown("the patch contains no surface node of the pad")
        by_place = cho_solve(factor, self._sensitivity(patch, indenter, touched))
        moved = self.compliance.apply(touched, np.column_stack([push, by_place]))

        def deviation(by: Array) -> Array:
            """Of what has the derivatives (n, 4) by depth, x, y and angle."""
            of_patch = by[:, [1, 2, 0, 3]] * [1.0, 1.0, growth, 1.0]
            variance = np.einsum("ci,ij,cj->c", of_patch, patch.covariance, of_patch)
            return np.asarray(np.sqrt(np.maximum(variance + (by[:, 0] * spread) ** 2, 0)))

        w, sigma = -moved[:, 0], deviation(moved[:, 1:])
        w[touched] = -gap[touched]
        mask = np.zeros(len(w), dtype=bool)
        mask[touched] = True
        total, total_sigma = float(push.sum()), float(deviation(by_place.sum(axis=0)[None])[0])
        return NormalReading(w, sigma, mask, depth_mm=depth, push_n=total, push_sigma_n=total_sigma)

    def cap_only(self, patch: ContactPatch, indenter: Indenter) -> NormalReading:
        """The paper's model: the indenter's cap below the rim of the patch, and no motion outside.

        The depth is the height of the cap, profile(size): the rim is assumed to be at rest.
        """
        if isinstance(indenter, Flat):
            return self._unknown("a flat punch has no cap")
        depth = self._rim_profile(patch, indenter)
        if not np.isfinite(depth):
            return self._unknown(_why_no_depth(patch, indenter))
        gap = depth - self._profile(patch, indenter)
        inside = gap > 0
        spread = 2 * depth / patch.size_mm * patch.sigma_mm
        w, sigma = np.where(inside, -gap, 0.0), np.where(inside, spread, 0.0)
        return NormalReading(w, sigma, inside, depth_mm=depth)

    def depth_mm(self, patch: ContactPatch, indenter: Indenter) -> float:
        """Depth at which the pressure falls to zero at the patch's rim; NaN where there is none.

        It is the mean over shifts of the patch by a quarter of the node spacing in four
        directions, which reduces the effect of where the rim passes between the nodes.
        """
        if not np.isfinite(self._rim_profile(patch, indenter)):
            return np.nan
        from gelslim_force.contact.punch_kernel import punches

        half = self.pitch_mm / 2
        near = np.flatnonzero(patch.outside_mm(*self.points_mm.T) < 2 * self.pitch_mm)
        x, y = self.points_mm[near].T
        shares, profiles = [], []
        for shift in _SHIFTS:
            moved = replace(patch, centre_mm=patch.centre_mm + self.pitch_mm * np.array(shift))
            outside = moved.outside_mm(x, y)
            shares += [0.5 - (outside - sign * half) / self.pitch_mm for sign in (1, -1)]
            profiles += 2 * [np.asarray(indenter.profile(*moved.local(x, y)), dtype=float)]
        block = self.compliance.block(near)
        # The compliance under a partly loaded area is proportional to 1/side of the loaded square.
        own = _LOCAL_SHARE * float(np.median(np.diag(block))) if len(near) else 0.0
        found = np.empty((len(shares), 2))
        shares_of = np.clip(shares, 0.0, 1.0)
        punches(block, own, shares_of, np.array(profiles), _LEAST_SHARE, found)
        stiffness, reduction = found[0::2].sum(axis=0) - found[1::2].sum(axis=0)
        return float(reduction / stiffness) if stiffness > 0 else np.nan

    def _unknown(self, problem: str) -> NormalReading:
        return NormalReading.unknown(len(self.points_mm), problem)

    def _settled(
        self, patch: ContactPatch, indenter: Indenter
    ) -> tuple[ContactPatch, float, float]:
        """The patch at the height that follows from its depth, the depth, and the mesh's error."""
        depth = self.depth_mm(patch, indenter)
        if not np.isfinite(depth):
            return patch, np.nan, np.nan
        seen = patch.size_mm
        patch = patch.at_height(self._rim_height(patch, indenter, depth))
        # The patch moves by less than a node: the depth changes with its size only.
        depth *= (patch.size_mm / seen) ** 2
        share = np.hypot(_DISCRETE * (self.pitch_mm / patch.size_mm) ** 2, _MESH)
        return patch, depth, float(share) * depth

    def _rim_profile(self, patch: ContactPatch, indenter: Indenter) -> float:
        if isinstance(indenter, Flat):
            return 0.0
        return float(
            indenter.profile(*((patch.size_mm, 0.0)[:: 1 if patch.kind == "disc" else -1]))
        )

    def _rim_height(self, patch: ContactPatch, indenter: Indenter, depth: float) -> float:
        rim = self._rim_profile(patch, indenter)
        return -depth + (rim if np.isfinite(rim) else 0.0)

    def _profile(self, patch: ContactPatch, indenter: Indenter) -> Array:
        return np.asarray(indenter.profile(*patch.local(*self.points_mm.T)), dtype=float)

    def _contact(
        self, gap: Array, patch: ContactPatch
    ) -> tuple[NDArray[np.intp], Array, tuple[Array, bool]]:
        """Nodes in contact, their forces, and the Cholesky factor of their compliance."""
        active = (patch.outside_mm(*self.points_mm.T) < 0) & np.isfinite(gap)
        active |= (gap > 0) & ~active.any()
        slack = 1e-6 * max(float(gap.max()), 1e-9)
        nodes, push, factor = np.flatnonzero(active), np.zeros(0), None
        for step in range(_MOST_STEPS):
            if not len(nodes):
                break
            try:
                factor = cho_factor(self.compliance.block(nodes))
            except LinAlgError as error:
                raise ValueError("the pad's compliance is not positive definite") from error
            push = cho_solve(factor, gap[nodes])
            pulled = push < 0
            if pulled.any():
                active[nodes[pulled]] = False
                nodes = np.flatnonzero(active)
                continue
            within = gap - self.compliance.apply(nodes, push) > slack
            within[nodes] = False
            # Nodes at the limit could alternate for ever: in the last steps none is added.
            if not within.any() or step > _MOST_STEPS - 10:
                break
            active |= within
            nodes = np.flatnonzero(active)
        return nodes, push, factor  # type: ignore[return-value]

    def _sensitivity(
        self, patch: ContactPatch, indenter: Indenter, nodes: NDArray[np.intp]
    ) -> Array:
        """Derivative (n, 4) of the gap at the nodes by depth, x, y and angle."""
        x, y = self.points_mm[nodes].T
        turn, small = np.deg2rad(patch.angle_deg), 1e-5

        def profile(dx: float, dy: float, dt: float) -> Array:
            centre = patch.centre_mm + np.array([dx, dy])
            return np.asarray(indenter.profile(*rotated(x, y, centre, turn + dt)), dtype=float)

        columns = [np.ones(len(nodes))]
        for move in ((small, 0.0, 0.0), (0.0, small, 0.0), (0.0, 0.0, small)):
            back = (-move[0], -move[1], -move[2])
            with np.errstate(invalid="ignore"):
                change = (profile(*back) - profile(*move)) / (2 * small)
            columns.append(np.where(np.isfinite(change), change, 0.0))
        return np.column_stack(columns)


def _pitch(points_mm: Array) -> float:
    """Node spacing: the geometric mean of the smallest steps along x and y."""
    steps = []
    for values in points_mm.T:
        gaps = np.diff(np.unique(np.round(values, 9)))
        if not len(gaps):
            raise ValueError("the surface nodes lie on one line: they must cover an area")
        steps.append(float(gaps.min()))
    return float(np.sqrt(steps[0] * steps[1]))


def _why_no_depth(patch: ContactPatch, indenter: Indenter) -> str:
    radius = getattr(indenter, "radius_mm", None)
    if radius is not None and patch.size_mm > radius:
        return (
            f"the patch of {patch.size_mm:.2f} mm is wider than the indenter of {radius:g} mm "
            "radius: something else than this indenter touches the gel"
        )
    return "the patch holds too few surface nodes"
