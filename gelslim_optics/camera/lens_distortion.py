"""Lens distortion by Brown-Conrady or Kannala-Brandt, with its domain and its inverse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.radial_scale import radial_scale

Array = NDArray[np.float64]

MAX_NEWTON_STEPS = 80
MAX_HALVINGS = 40
SMALL_STEP = 1e-15
SMALL_RESIDUAL = 4e-16
# Below this number compiled code does not pay; BLOCK points fit into the processor's cache.
COMPILED_FROM = 64
BLOCK = 4096
BROWN, KANNALA_BRANDT = "brown", "kannala_brandt"
COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4")
SCANNED, ZOOMS = 4001, 5
"""Angles among which the rim of a wide lens's domain is looked for, each time nearer to it."""


@dataclass(frozen=True)
class LensDistortion:
    """Radial and tangential distortion of image coordinates in focal lengths.

    With ρ² = x² + y² and f = 1 + k1 ρ² + k2 ρ⁴ + k3 ρ⁶ (Brown 1966, Conrady 1919; the convention
    is that of OpenCV)

        x' = x f + 2 p1 x y + p2 (ρ² + 2 x²),  y' = y f + p1 (ρ² + 2 y²) + 2 p2 x y.

    A wide lens has f = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) / ρ with ρ = tan θ instead (Kannala
    and Brandt 2006). A focal length is here the image distance, as in a calibration.

    Attributes:
        k1: Radial coefficient of ρ², or θ².
        k2: Radial coefficient of ρ⁴, or θ⁴.
        p1: First tangential coefficient.
        p2: Second tangential coefficient.
        k3: Radial coefficient of ρ⁶, or θ⁶.
        k4: Radial coefficient of θ⁸.
        model: `brown` or `kannala_brandt`.

    Raises:
        ValueError: A coefficient is not finite, or the model does not have it.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    model: Literal["brown", "kannala_brandt"] = "brown"

    def __post_init__(self) -> None:
        for name in COEFFICIENTS:
            value = getattr(self, name)
            if not np.isfinite(value):
                raise ValueError(f"lens distortion coefficient {name} = {value} is not finite")
        if self.model not in (BROWN, KANNALA_BRANDT):
            raise ValueError(
                f"lens distortion model {self.model!r}: give {BROWN} or {KANNALA_BRANDT}"
            )
        if self.k4 and not self.fisheye:
            raise ValueError(
                f"k4 = {self.k4} of the lens distortion belongs to the model {KANNALA_BRANDT}"
            )

    @property
    def fisheye(self) -> bool:
        """Whether the model is that of Kannala and Brandt."""
        return self.model == KANNALA_BRANDT

    @property
    def distorts(self) -> bool:
        """Whether any point is moved."""
        return self.fisheye or any(getattr(self, name) for name in COEFFICIENTS)

    @cached_property
    def monotone_radius(self) -> float:
        """Radius ρ of the disc of undistorted coordinates on which the map is one-to-one.

        The map is the gradient of a potential, so that its Jacobian is symmetric. The radial part
        has the eigenvalues f and (ρ f)'; those of the tangential part are at least -6 |p| ρ. Up to
        the first ρ at which min(f, (ρ f)') = 6 |p| ρ the potential is strictly convex and its
        gradient one-to-one. Without p1 and p2 this is where ρ f stops growing; inf if it never
        does.
        """
        slope = -6 * float(np.hypot(self.p1, self.p2))
        if self.fisheye:
            return self._scanned_radius(slope)
        if not (self.k1 or self.k2 or self.k3 or slope):
            return float(np.inf)
        outward = [7 * self.k3, 0.0, 5 * self.k2, 0.0, 3 * self.k1, slope, 1.0]
        around = [self.k3, 0.0, self.k2, 0.0, self.k1, slope, 1.0]
        roots = np.concatenate([np.roots(outward), np.roots(around)])
        # The eigenvalue solver returns a double root as a pair that is nearly real.
        real = roots[np.abs(roots.imag) <= 1e-7 * np.abs(roots)].real
        return float(min(real[real > 0], default=np.inf))

    def _scanned_radius(self, slope: float) -> float:
        """The first ρ at which min(f, (ρ f)') + `slope` ρ is zero, looked for in equal angles."""

        def room(angle: ArrayLike) -> Array:
            rho = np.tan(angle)
            f, change = self._radial(rho * rho)
            # Over 1/cos² of the angle, which has no limit.
            return np.asarray(
                (np.minimum(f, f + 2 * rho * rho * change) + slope * rho) * np.cos(angle) ** 2
            )

        low, high = 0.0, np.pi / 2
        for _ in range(ZOOMS):
            angles = np.linspace(low, high, SCANNED)
            lost = room(angles[:-1]) <= 0
            if not lost.any():
                return float(np.inf) if high == np.pi / 2 else float(np.tan(high))
            low, high = angles[np.argmax(lost) - 1], angles[np.argmax(lost)]
        return float(np.tan(low))

    def distort(self, undistorted: ArrayLike) -> Array:
        """Distorted coordinates (n, 2) of undistorted ones (n, 2); NaN stays NaN.

        Raises ValueError for points outside the monotone radius, where the polynomial folds the
        image over itself.
        """
        xy = np.asarray(undistorted, dtype=float)
        radius = np.hypot(xy[..., 0], xy[..., 1])
        beyond = radius >= self.monotone_radius
        if beyond.any():
            raise ValueError(
                f"{int(beyond.sum())} of {radius.size} points lie outside the monotone radius of "
                f"{self.monotone_radius:.6g} focal lengths of the lens distortion (farthest: "
                f"{np.nanmax(radius):.6g}), where its coefficients are not valid"
            )
        return self._map(xy)

    def undistort(self, distorted: ArrayLike) -> Array:
        """Undistorted coordinates (n, 2) of distorted ones (n, 2); NaN stays NaN.

        Newton's method; a step is halved that leaves the monotone disc or increases the residual.
        Raises ValueError for points that are the image of no point within the monotone radius.
        """
        target = np.atleast_2d(np.asarray(distorted, dtype=float))
        undistorted, left = self._newton_undamped(target)
        lost = np.zeros(len(target), dtype=bool)
        for k in range(0, len(left), BLOCK):
            part = left[k : k + BLOCK]
            undistorted[part], lost[part] = self._inverted(target[part])
        if lost.any():
            worst = target[lost][np.argmax(np.hypot(*target[lost].T))]
            raise ValueError(
                f"{int(lost.sum())} of {len(target)} points, such as ({worst[0]:.6g}, "
                f"{worst[1]:.6g}) focal lengths from the axis, are the image of no point within "
                f"the monotone radius of {self.monotone_radius:.6g} of the lens distortion: its "
                "coefficients are not valid there"
            )
        return undistorted.reshape(np.shape(distorted))

    def _newton_undamped(self, target: Array) -> tuple[Array, NDArray[np.intp]]:
        """Points (n, 2) where compiled, undamped Newton converges, and indices of the others."""
        xy = np.array(target)
        if len(target) < COMPILED_FROM:
            return xy, np.arange(len(target))
        from gelslim_optics.camera.undistort_kernel import undistort

        converged = np.zeros(len(target), dtype=bool)
        coefficients = np.array([self.k1, self.k2, self.k3, self.k4, self.p1, self.p2])
        points = np.ascontiguousarray(target)
        undistort(points, coefficients, self.fisheye, self.monotone_radius, xy, converged)
        return xy, np.flatnonzero(~converged)

    def jacobian(self, undistorted: ArrayLike) -> Array:
        """Derivative (n, 2, 2) of the distorted by the undistorted coordinates (n, 2)."""
        xx, cross, yy = self._stretch(np.asarray(undistorted, dtype=float))
        return np.stack([np.stack([xx, cross], -1), np.stack([cross, yy], -1)], -2)

    def _stretch(self, xy: Array) -> tuple[Array, Array, Array]:
        """The elements xx, xy = yx and yy of the Jacobian."""
        x, y = xy[..., 0], xy[..., 1]
        s = x * x + y * y
        f, change = self._radial(s)
        g = 2 * change
        cross = g * x * y + 2 * self.p1 * x + 2 * self.p2 * y
        xx = f + g * x * x + 2 * self.p1 * y + 6 * self.p2 * x
        yy = f + g * y * y + 6 * self.p1 * y + 2 * self.p2 * x
        return xx, cross, yy

    def to_record(self) -> dict[str, float | str]:
        """The coefficients by name, and the model where it is not Brown's."""
        record = asdict(self)
        if not self.fisheye:
            del record["k4"], record["model"]
        return record

    @classmethod
    def from_record(cls, record: Mapping[str, object]) -> LensDistortion:
        """The distortion of a record made by `to_record`; missing coefficients are zero.

        Raises ValueError for an unknown name or a value that is not a number.
        """
        values: dict[str, Any] = {}
        for name, value in record.items():
            if name == "model":
                values[name] = value
                continue
            if (
                name not in COEFFICIENTS
                or isinstance(value, bool)
                or not isinstance(value, int | float)
            ):
                raise ValueError(
                    f"{name} = {value!r} of the lens distortion: give a model, and numbers for "
                    f"{', '.join(COEFFICIENTS)}"
                )
            values[name] = float(value)
        return cls(**values)

    def scale(self, radius: float) -> float:
        """The radial scale f at a distance ρ from the axis, in focal lengths."""
        return float(self._radial(np.asarray(radius**2))[0])

    def _radial(self, squared: Array) -> tuple[Array, Array]:
        """The scale f at ρ² and its derivative by ρ²."""
        return radial_scale(squared, self.fisheye, self.k1, self.k2, self.k3, self.k4)

    def _map(self, xy: Array) -> Array:
        x, y = xy[..., 0], xy[..., 1]
        s = x * x + y * y
        f, _ = self._radial(s)
        return np.stack(
            [
                x * f + 2 * self.p1 * x * y + self.p2 * (s + 2 * x * x),
                y * f + self.p1 * (s + 2 * y * y) + 2 * self.p2 * x * y,
            ],
            axis=-1,
        )

    def _inverted(self, target: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Points (n, 2) that are distorted to `target`, and where there is none."""
        xy = target.copy()
        radius = np.hypot(xy[:, 0], xy[:, 1])
        outside = radius >= self.monotone_radius
        xy[outside] *= (0.9 * self.monotone_radius / radius[outside])[:, None]
        finite = np.isfinite(target).all(axis=1)
        xy[~finite] = np.nan
        open_ = np.flatnonzero(finite)
        lost = np.zeros(len(xy), dtype=bool)
        for _ in range(MAX_NEWTON_STEPS):
            if not len(open_):
                break
            xy[open_], converged, stuck = self._newton_step(xy[open_], target[open_])
            lost[open_[stuck]] = True
            open_ = open_[~(converged | stuck)]
        lost[open_] = True
        return xy, lost

    def _newton_step(
        self, xy: Array, target: Array
    ) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
        """One damped step from `xy` (n, 2); which points have converged, and which cannot go on."""
        residual = target - self._map(xy)
        off = np.hypot(residual[:, 0], residual[:, 1])
        xx, cross, yy = self._stretch(xy)
        u, v = residual.T
        step = np.stack([yy * u - cross * v, xx * v - cross * u], -1)
        step /= (xx * yy - cross * cross)[:, None]
        size = 1 + np.hypot(target[:, 0], target[:, 1])
        # Near the fold a step is long even where the residual is at rounding level.
        done = (np.hypot(step[:, 0], step[:, 1]) <= SMALL_STEP * size) | (
            off <= SMALL_RESIDUAL * size
        )
        fraction = np.where(done, 0.0, 1.0)
        for _ in range(MAX_HALVINGS):
            tried = xy + fraction[:, None] * step
            left = target - self._map(tried)
            worse = np.hypot(left[:, 0], left[:, 1]) >= off
            worse |= np.hypot(tried[:, 0], tried[:, 1]) >= self.monotone_radius
            worse &= ~done
            if not worse.any():
                break
            fraction = np.where(worse, fraction / 2, fraction)
        return np.where(worse[:, None], xy, tried), done, worse
