"""A rigid ball pressed on a wide elastic layer that is bonded to a rigid base.

The pressure p(r) under the ball has the transform p~(k) = ∫ p r J0(kr) dr = ∫ χ(t) cos(kt) dt over
0 ≤ t ≤ a, the radius of contact. The surface sinks by w and moves outwards by u,

    w(r) = 2 (1 - ν²)/E ∫ L p~ J0(kr) dk,    u(r) = 2 (1 - ν²)/E ∫ M p~ J1(kr) dk,

with the responses L, M and N of `layer_response`, which contain the skin. Under the ball
w = depth - profile, which is a Fredholm equation of the second kind for χ (Lebedev and Ufliand
1958),

    λ χ(t) + 1/π ∫ χ(s) (H(t-s) + H(t+s)) ds = E/(π (1-ν²)) (depth - t/2 ln((R+t)/(R-t))),
    H(v) = ∫ (L - λ) cos(kv) dk,

and the pressure is zero at the rim where χ(a) = 0, which gives the depth. The force is 2π ∫ χ dt.
λ, the limit of L for short waves, is 1 for a bare gel. In a skin H has a logarithmic singularity,
which is integrated in closed form.

Friction adds a radial traction q(r) = p₀ (c₁ r/a + c₃ (r/a)³), positive outwards, with the pressure
p₀ of the contact without friction. With q~(k) = ∫ q r J1(kr) dr it moves the surface outwards by
2 (1 - ν²)/E ∫ N q~ J1(kr) dk, and by reciprocity sinks it by 2 (1 - ν²)/E ∫ M q~ J0(kr) dk, so that
-(2/π) ∫ M q~ cos(kt) dk joins the right-hand side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0, j1

from gelslim_force.layer.layer_response import LayerResponse

Array = NDArray[np.float64]
_POINTS, _POINTS_PER_THICKNESS = 24, 8
"""Gauss points over the radius of contact, at least, and for each thickness that it holds."""
_WAVES, _WAVES_PER_THICKNESS = 160, 40
_LARGEST_WAVE = 18.0
"""Of kh: L - 1 and M less its limit are below 1e-14 beyond it."""
_HALF_CHORD_POINTS = 16
_SHORT_WAVES, _WAVES_PER_TURN, _LARGEST_SHORT_WAVE = 120, 3.5, 40.0
"""For what friction and skin add, whose transforms fall slowly: points, at least and for each turn
of the Bessel function at the farthest place, and the largest of ka."""
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
        layer: The layer in its skin.
        depth_mm: Of the ball's lowest point below the rest surface.
        force_n_per_mpa: Force over Young's modulus.
    """

    contact_mm: float
    ball_mm: float
    layer: LayerResponse
    depth_mm: float
    force_n_per_mpa: float
    _density: Array
    _points: Array
    _weight: Array

    _spectrum: Array
    """Transform q~ (k,) of the radial traction at `_waves`."""
    _traction: tuple[Array, Array] | None = None
    """Distances (m,) from the middle and the radial traction there, times r dr; None without."""

    @classmethod
    def at(
        cls,
        contact_mm: float,
        ball_mm: float,
        thickness_mm: float,
        poissons_ratio: float,
        friction: tuple[float, float] = (0.0, 0.0),
        skin_mm: float = 0.0,
    ) -> BallOnLayer:
        """Solve for one radius of contact.

        Args:
            contact_mm: Radius of contact, > 0 and below that of the ball.
            ball_mm: Radius of the ball, > 0.
            thickness_mm: Of the layer, > 0.
            poissons_ratio: Of the layer, below 0.5.
            friction: Coefficients c₁ and c₃ of the radial traction.
            skin_mm: Plane stiffness of the skin over Young's modulus of the layer, >= 0.

        Raises:
            ValueError: An argument is out of its range.
        """
        sized = 0 < contact_mm < ball_mm and thickness_mm > 0 and 0 <= skin_mm < np.inf
        if not (sized and -1 < poissons_ratio < 0.5):
            raise ValueError(
                f"a contact of {contact_mm:g} mm under a ball of radius {ball_mm:g} mm on a layer "
                f"of {thickness_mm:g} mm with Poisson's ratio {poissons_ratio:g} and a skin of "
                f"{skin_mm:g} mm: the contact must be narrower than the ball, lengths above 0, the "
                "skin at least 0, and the ratio in -1 ... 0.5"
            )
        layer = LayerResponse(thickness_mm, poissons_ratio, skin_mm)
        count = _counted(_POINTS, _POINTS_PER_THICKNESS, contact_mm / thickness_mm)
        nodes, weight = _gauss(count)
        points, weight = contact_mm * (nodes + 1) / 2, contact_mm * weight / 2
        every = np.append(points, contact_mm)
        kernel, own = _kernel(every, points, weight, layer)
        modulus = 1 / (np.pi * (1 - poissons_ratio**2))
        by_depth = np.full(count + 1, modulus)
        ratio = every / ball_mm
        by_profile = modulus * every * np.arctanh(ratio)
        system = np.diag(own[:-1]) + kernel[:-1]
        flat, curved = np.linalg.solve(system, np.column_stack([by_depth, by_profile])[:-1]).T
        flat_rim = by_depth[-1] - kernel[-1] @ flat
        curved_rim = by_profile[-1] - kernel[-1] @ curved
        depth = float(curved_rim / flat_rim)
        density = depth * flat - curved
        smooth = cls(
            contact_mm,
            ball_mm,
            layer,
            depth,
            float(2 * np.pi * (weight @ density)),
            density,
            points,
            weight,
            np.zeros(len(_waves(thickness_mm, contact_mm)[0])),
        )
        if friction == (0.0, 0.0):
            return smooth
        side, spectrum, traction = smooth._by_friction(friction, every)
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
            _traction=traction,
        )

    def _by_friction(
        self, friction: tuple[float, float], every: Array
    ) -> tuple[Array, Array, tuple[Array, Array]]:
        """Right-hand side at t (n,) of a radial traction, its transform, and itself."""
        nodes, rings = _gauss(_RINGS)
        r, ring = self.contact_mm * (nodes + 1) / 2, self.contact_mm * rings / 2

        def traction(radius: Array) -> Array:
            part = radius / self.contact_mm
            pressure = self.pressure(radius.ravel()).reshape(radius.shape)
            return np.asarray(pressure * (friction[0] * part + friction[1] * part**3))

        pushed = ring * traction(r) * r
        wave, weight = _waves(self.layer.thickness_mm, self.contact_mm)
        spectrum = j1(np.outer(wave, r)) @ pushed
        base = np.cos(np.outer(every, wave)) @ (weight * self.layer.by_base(wave)[1] * spectrum)
        if self.layer.skin_mm:
            short, parts = _short_waves(self.contact_mm)
            spread = parts * self.layer.of_half_space(short) * (j1(np.outer(short, r)) @ pushed)
            base += np.cos(np.outer(every, short)) @ spread
            return -2 / np.pi * base, spectrum, (r, pushed)
        turn, turns = _gauss(_HALF_CHORD_POINTS)
        angle = np.pi / 4 * (turn + 1)
        inner = traction(np.outer(every, np.sin(angle))) @ (np.pi / 4 * turns)
        half_space = self.layer.rigid_limit * (ring @ traction(r) - every * inner)
        return -2 / np.pi * (half_space + base), spectrum, (r, pushed)

    def motion(self, r_mm: Array) -> tuple[Array, Array]:
        """Motion (n,) outwards and (n,) along z of the surface at distances (n,) from the middle.

        It does not depend on Young's modulus; z is negative where the surface sinks.
        """
        r = np.asarray(r_mm, dtype=float)
        wave, weight = _waves(self.layer.thickness_mm, self.contact_mm)
        spectrum = np.cos(np.outer(wave, self._points)) @ (self._weight * self._density)
        sinking, outward = self.layer.by_base(wave)
        scale = 2 * (1 - self.layer.poissons_ratio**2)
        turn = np.outer(r, wave)
        lower = j0(turn) @ (weight * (sinking * spectrum + outward * self._spectrum))
        aside = j1(turn) @ (weight * outward * spectrum)
        outside = np.maximum(r, self.contact_mm)[:, None]
        apart = np.sqrt(np.maximum(outside**2 - self._points**2, 1e-300))
        lower += self.layer.shallow * (self._weight * self._density / apart).sum(axis=1)
        if not self.layer.skin_mm:
            aside += self.layer.rigid_limit * self._enclosed(r)
        short_lower, short_aside = self._short_motion(r)
        lower, aside = lower + short_lower, aside + short_aside
        inside = r < self.contact_mm
        ball = np.minimum(r, self.contact_mm) ** 2
        profile = ball / (self.ball_mm + np.sqrt(self.ball_mm**2 - ball))
        return scale * aside, np.where(inside, profile - self.depth_mm, -scale * lower)

    def _short_motion(self, r: Array) -> tuple[Array, Array]:
        """What short waves add (n,) to the sinking and outwards: by friction, and by the skin."""
        if self._traction is None and not self.layer.skin_mm:
            return np.zeros(len(r)), np.zeros(len(r))
        reach = float(r.max(initial=0.0)) if self.layer.skin_mm else 0.0
        wave, weight = _short_waves(self.contact_mm, reach)
        outwards, downwards = np.zeros(len(wave)), np.zeros(len(wave))
        if self._traction is not None:
            at, amount = self._traction
            sliding = j1(np.outer(wave, at)) @ amount
            outwards += self.layer.along(wave) * sliding
        if self.layer.skin_mm:
            limit, spread = self.layer.rigid_limit, self.layer.of_half_space(wave)
            pressed = np.cos(np.outer(wave, self._points)) @ (self._weight * self._density)
            outwards += spread * pressed
            downwards += limit * spread * pressed
            if self._traction is not None:
                downwards += spread * sliding
        turn = np.outer(r, wave)
        return j0(turn) @ (weight * downwards), j1(turn) @ (weight * outwards)

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


def _short_waves(contact_mm: float, reach_mm: float = 0.0) -> tuple[Array, Array]:
    """Waves that show friction and skin up to a distance from the middle."""
    largest = _LARGEST_SHORT_WAVE / contact_mm
    count = max(_SHORT_WAVES, int(_WAVES_PER_TURN * largest * reach_mm / (2 * np.pi)))
    nodes, weight = _gauss(count)
    return largest / 2 * (nodes + 1), largest / 2 * weight


def _kernel(t: Array, s: Array, weight: Array, layer: LayerResponse) -> tuple[Array, Array]:
    """Factors (n + 1, n) of χ(s) in the equation at t (n + 1,), and those (n + 1,) of χ(t) itself.

    The last t is the rim, the others are the points s.
    """
    wave, parts = _waves(layer.thickness_mm, float(t[-1]))
    sinking, _ = layer.by_base(wave)
    # cos(k(t-s)) + cos(k(t+s)) = 2 cos(kt) cos(ks)
    rows = np.cos(np.outer(t, wave)) * (2 * parts * sinking)
    found = rows @ np.cos(np.outer(wave, s)) * weight / np.pi
    own = np.full(len(t), layer.shallow)
    if layer.skin_mm:
        apart = np.abs(t[:, None] - s)
        apart[: len(s)][np.diag_indices(len(s))] = np.inf
        near = layer.skin_kernel(np.where(np.isinf(apart), 1.0, apart))
        near = np.where(np.isinf(apart), 0.0, near)
        # χ(s) - χ(t) removes the singularity at s = t.
        singular = (near + layer.skin_kernel(t[:, None] + s)) * weight / np.pi
        whole = layer.skin_integral(t[-1] - t) + layer.skin_integral(t[-1] + t)
        own += whole / np.pi - singular.sum(axis=1)
        found += singular
    return found, own
