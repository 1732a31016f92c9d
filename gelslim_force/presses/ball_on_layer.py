"""A rigid ball pressed on a wide elastic layer that is bonded to a rigid base.

The pressure p(r) under the ball has the transform p~(k) = ∫ p r J0(kr) dr = ∫ χ(t) cos(kt) dt over
0 ≤ t ≤ a, the radius of contact. The surface sinks by w and moves outwards by u,

    w(r) = 2 (1 - ν²)/E ∫ L(kh) p~ J0(kr) dk,    u(r) = 2 (1 - ν²)/E ∫ M(kh) p~ J1(kr) dk,
    L(x) = (2κ sinh 2x - 4x) / D,                M(x) = (8x² - 2κ (κ-1)(cosh 2x - 1)) / (κ+1) D,
    D(x) = 2κ cosh 2x + 1 + κ² + 4x²,            κ = 3 - 4ν

(L: Hannah 1951; Johnson, Contact Mechanics, 5.8; M follows from the same solution in plane waves).
Under the ball w = depth - profile, which is a Fredholm equation of the second kind for χ (Lebedev
and Ufliand 1958),

    χ(t) + 1/π ∫ χ(s) (H(t-s) + H(t+s)) ds = E/(π (1-ν²)) (depth - t/2 ln((R+t)/(R-t))),
    H(v) = ∫ (L(kh) - 1) cos(kv) dk,

and the pressure is zero at the rim where χ(a) = 0, which gives the depth. The force is 2π ∫ χ dt.

Friction adds a radial traction q(r) = p₀ (c₁ r/a + c₃ (r/a)³), positive outwards, with the pressure
p₀ of the contact without friction. With q~(k) = ∫ q r J1(kr) dr it moves the surface outwards by
2 (1 - ν²)/E ∫ N q~ J1(kr) dk, N(x) = (2κ sinh 2x + 4x) / D, and by reciprocity sinks it by
2 (1 - ν²)/E ∫ M q~ J0(kr) dk, so that -(2/π) ∫ M q~ cos(kt) dk joins the right-hand side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0, j1

Array = NDArray[np.float64]
_POINTS, _POINTS_PER_THICKNESS = 24, 8
"""Gauss points over the radius of contact, at least, and for each thickness that it holds."""
_WAVES, _WAVES_PER_THICKNESS = 160, 40
_LARGEST_WAVE = 18.0
"""Of kh: L - 1 and M less its limit are below 1e-14 beyond it."""
_HALF_CHORD_POINTS = 16
_FRICTION_WAVES, _LARGEST_FRICTION_WAVE = 120, 40.0
"""For the motion outwards by friction, whose transform falls slowly; the largest is of ka."""
_LEAST_SHARE = 1e-3
"""Distance from the middle, over the radius of contact, within which the motion is linear."""
_RINGS = 24
"""Gauss points over the radius for the radial traction."""


@dataclass(frozen=True, eq=False)
class BallOnLayer:
    """The contact of one ball at one radius of contact, for Young's modulus 1 MPa.

    Attributes:
        contact_mm: Radius of contact a.
        ball_mm: Radius of the ball.
        thickness_mm: Of the layer.
        poissons_ratio: Of the layer.
        depth_mm: Of the ball's lowest point below the rest surface.
        force_n_per_mpa: Force over Young's modulus.
    """

    contact_mm: float
    ball_mm: float
    thickness_mm: float
    poissons_ratio: float
    depth_mm: float
    force_n_per_mpa: float
    _density: Array
    _points: Array
    _weight: Array

    _spectrum: Array
    """Transform q~ (k,) of the radial traction at `_waves`."""
    _sliding: Array | None = None
    """Transform q~ (f,) at `_friction_waves`; None without friction."""

    @classmethod
    def at(
        cls,
        contact_mm: float,
        ball_mm: float,
        thickness_mm: float,
        poissons_ratio: float,
        friction: tuple[float, float] = (0.0, 0.0),
    ) -> BallOnLayer:
        """Solve for one radius of contact.

        Args:
            contact_mm: Radius of contact, > 0 and below that of the ball.
            ball_mm: Radius of the ball, > 0.
            thickness_mm: Of the layer, > 0.
            poissons_ratio: Of the layer, below 0.5.
            friction: Coefficients c₁ and c₃ of the radial traction.

        Raises:
            ValueError: An argument is out of its range.
        """
        if not (0 < contact_mm < ball_mm and thickness_mm > 0 and -1 < poissons_ratio < 0.5):
            raise ValueError(
                f"a contact of {contact_mm:g} mm under a ball of radius {ball_mm:g} mm on a layer "
                f"of {thickness_mm:g} mm with Poisson's ratio {poissons_ratio:g}: the contact must "
                "be narrower than the ball, lengths above 0, and the ratio in -1 ... 0.5"
            )
        count = _counted(_POINTS, _POINTS_PER_THICKNESS, contact_mm / thickness_mm)
        nodes, weight = _gauss(count)
        points, weight = contact_mm * (nodes + 1) / 2, contact_mm * weight / 2
        every = np.append(points, contact_mm)
        kernel = _kernel(every, points, thickness_mm, poissons_ratio) * weight / np.pi
        modulus = 1 / (np.pi * (1 - poissons_ratio**2))
        by_depth = np.full(count + 1, modulus)
        ratio = every / ball_mm
        by_profile = modulus * every * np.arctanh(ratio)
        system = np.eye(count) + kernel[:-1]
        flat, curved = np.linalg.solve(system, np.column_stack([by_depth, by_profile])[:-1]).T
        flat_rim = by_depth[-1] - kernel[-1] @ flat
        curved_rim = by_profile[-1] - kernel[-1] @ curved
        depth = float(curved_rim / flat_rim)
        density = depth * flat - curved
        smooth = cls(
            contact_mm,
            ball_mm,
            thickness_mm,
            poissons_ratio,
            depth,
            float(2 * np.pi * (weight @ density)),
            density,
            points,
            weight,
            np.zeros(len(_waves(thickness_mm, contact_mm)[0])),
        )
        if friction == (0.0, 0.0):
            return smooth
        side, spectrum, sliding = smooth._by_friction(friction, every)
        pushed = np.linalg.solve(system, side[:-1])
        pushed_rim = side[-1] - kernel[-1] @ pushed
        depth = float((curved_rim - pushed_rim) / flat_rim)
        density = depth * flat - curved + pushed
        force = float(2 * np.pi * (weight @ density))
        return replace(
            smooth,
            depth_mm=depth,
            force_n_per_mpa=force,
            _density=density,
            _spectrum=spectrum,
            _sliding=sliding,
        )

    def _by_friction(
        self, friction: tuple[float, float], every: Array
    ) -> tuple[Array, Array, Array]:
        """Right-hand side at t (n,) of a radial traction, and its transform at both waves."""
        nodes, rings = _gauss(_RINGS)
        r, ring = self.contact_mm * (nodes + 1) / 2, self.contact_mm * rings / 2

        def traction(radius: Array) -> Array:
            part = radius / self.contact_mm
            pressure = self.pressure(radius.ravel()).reshape(radius.shape)
            return np.asarray(pressure * (friction[0] * part + friction[1] * part**3))

        wave, weight = _waves(self.thickness_mm, self.contact_mm)
        spectrum = j1(np.outer(wave, r)) @ (ring * traction(r) * r)
        turn, turns = _gauss(_HALF_CHORD_POINTS)
        angle = np.pi / 4 * (turn + 1)
        inner = traction(np.outer(every, np.sin(angle))) @ (np.pi / 4 * turns)
        half_space = ring @ traction(r) - every * inner
        _, outward = _kernels(wave * self.thickness_mm, self.poissons_ratio)
        limit = _limit(self.poissons_ratio)
        layer = np.cos(np.outer(every, wave)) @ (weight * (outward - limit) * spectrum)
        fine, _ = _friction_waves(self.contact_mm)
        sliding = j1(np.outer(fine, r)) @ (ring * traction(r) * r)
        return -2 / np.pi * (limit * half_space + layer), spectrum, sliding

    def motion(self, r_mm: Array) -> tuple[Array, Array]:
        """Motion (n,) outwards and (n,) along z of the surface at distances (n,) from the middle.

        It does not depend on Young's modulus; z is negative where the surface sinks.
        """
        r = np.asarray(r_mm, dtype=float)
        wave, weight = _waves(self.thickness_mm, self.contact_mm)
        spectrum = np.cos(np.outer(wave, self._points)) @ (self._weight * self._density)
        sinking, outward = _kernels(wave * self.thickness_mm, self.poissons_ratio)
        scale = 2 * (1 - self.poissons_ratio**2)
        turn = np.outer(r, wave)
        lower = j0(turn) @ (weight * (sinking - 1) * spectrum)
        aside = j1(turn) @ (weight * (outward - _limit(self.poissons_ratio)) * spectrum)
        aside += _limit(self.poissons_ratio) * self._enclosed(r)
        if self._sliding is not None:
            fine, parts = _friction_waves(self.contact_mm)
            along = _tangential(fine * self.thickness_mm, self.poissons_ratio)
            aside += j1(np.outer(r, fine)) @ (parts * along * self._sliding)
        outside = np.maximum(r, self.contact_mm)[:, None]
        apart = np.sqrt(np.maximum(outside**2 - self._points**2, 1e-300))
        lower += (self._weight * self._density / apart).sum(axis=1)
        lower += j0(turn) @ (weight * (outward - _limit(self.poissons_ratio)) * self._spectrum)
        inside = r < self.contact_mm
        ball = np.minimum(r, self.contact_mm) ** 2
        profile = ball / (self.ball_mm + np.sqrt(self.ball_mm**2 - ball))
        return scale * aside, np.where(inside, profile - self.depth_mm, -scale * lower)

    def pressure(self, r_mm: Array) -> Array:
        """Pressure (n,) over Young's modulus at distances (n,) from the middle.

        From the force within a radius, p = (d/dr ∫ p r dr) / r.
        """
        r = np.clip(np.asarray(r_mm, dtype=float), 1e-6 * self.contact_mm, None)
        step = 1e-4 * self.contact_mm
        lower = np.maximum(r - step, 0.0)
        change = self._enclosed(r + step) * (r + step) - self._enclosed(lower) * lower
        return np.where(r < self.contact_mm, change / (r + step - lower) / r, 0.0)

    def _enclosed(self, r: Array) -> Array:
        """∫ p~ J1(kr) dk (n,): the force within r over 2π r, which is proportional to r near 0."""
        least = _LEAST_SHARE * self.contact_mm
        inside = np.clip(r, least, self.contact_mm)
        nodes, weight = _gauss(_HALF_CHORD_POINTS)
        chord = np.sqrt(np.maximum(self.contact_mm**2 - inside**2, 0.0))[:, None]
        along = chord * (nodes + 1) / 2
        beyond = self._at(np.sqrt(inside[:, None] ** 2 + along**2))
        outer = (beyond * weight * chord / 2).sum(axis=1)
        whole = float(self._weight @ self._density)
        return np.asarray((whole - outer) / np.maximum(r, least) * np.minimum(r / least, 1.0))

    @cached_property
    def _fit(self) -> Array:
        """χ as an even polynomial through the Gauss points: coefficients in Chebyshev's form."""
        place = 2 * (self._points / self.contact_mm) ** 2 - 1
        return np.asarray(np.polynomial.chebyshev.chebfit(place, self._density, 10))

    def _at(self, t: Array) -> Array:
        """χ at t."""
        place = 2 * (t / self.contact_mm) ** 2 - 1
        return np.asarray(np.polynomial.chebyshev.chebval(place, self._fit))


@cache
def _gauss(count: int) -> tuple[Array, Array]:
    """Points and weights (count,) of Gauss's rule from -1 to 1, read-only."""
    nodes, weight = np.polynomial.legendre.leggauss(count)
    nodes.setflags(write=False)
    weight.setflags(write=False)
    return nodes, weight


def _counted(least: int, each: int, thicknesses: float) -> int:
    return max(least, int(np.ceil(each * thicknesses)))


def _waves(thickness_mm: float, contact_mm: float) -> tuple[Array, Array]:
    count = _counted(_WAVES, _WAVES_PER_THICKNESS, contact_mm / thickness_mm)
    nodes, weight = _gauss(count)
    half = _LARGEST_WAVE / thickness_mm / 2
    return half * (nodes + 1), half * weight


def _friction_waves(contact_mm: float) -> tuple[Array, Array]:
    nodes, weight = _gauss(_FRICTION_WAVES)
    half = _LARGEST_FRICTION_WAVE / contact_mm / 2
    return half * (nodes + 1), half * weight


def _kernel(t: Array, s: Array, thickness_mm: float, poissons_ratio: float) -> Array:
    """H(t - s) + H(t + s) for t (n,) and s (m,)."""
    wave, weight = _waves(thickness_mm, float(t[-1]))
    sinking, _ = _kernels(wave * thickness_mm, poissons_ratio)
    # cos(k(t-s)) + cos(k(t+s)) = 2 cos(kt) cos(ks)
    rows = np.cos(np.outer(t, wave)) * (2 * weight * (sinking - 1))
    return np.asarray(rows @ np.cos(np.outer(wave, s)))


def _kernels(x: Array, poissons_ratio: float) -> tuple[Array, Array]:
    """L and M (n,) of the layer."""
    kappa = 3 - 4 * poissons_ratio
    e = np.exp(-2 * x)
    bottom = kappa * (1 + e * e) + (1 + kappa**2 + 4 * x * x) * e
    sinking = (kappa * (1 - e * e) - 4 * x * e) / bottom
    waving = (1 - e) ** 2 * kappa * (kappa - 1)
    return sinking, (8 * x * x * e - waving) / (kappa + 1) / bottom


def _tangential(x: Array, poissons_ratio: float) -> Array:
    """N (n,) of the layer."""
    kappa = 3 - 4 * poissons_ratio
    e = np.exp(-2 * x)
    bottom = kappa * (1 + e * e) + (1 + kappa**2 + 4 * x * x) * e
    return np.asarray((kappa * (1 - e * e) + 4 * x * e) / bottom)


def _limit(poissons_ratio: float) -> float:
    """M of a half-space."""
    return -(1 - 2 * poissons_ratio) / (2 * (1 - poissons_ratio))
