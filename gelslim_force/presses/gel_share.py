"""The share of a wrench's covariance that comes from what is not known of the gel.

The wrench is W = G S u. It is proportional to Young's modulus, so that its derivative by the
logarithm of the modulus is W. The derivatives of G S by thickness and by Poisson's ratio are
differences of the adjoint fields of two pads, computed once; where the normal motion follows from
the size of a patch, it depends on the gel too, and its derivative adds G S du/dh. A skin has no
part in G S, because its forces are in balance, but the normal motion depends on its stiffness over
the modulus. The motion of an object of unknown shape is not given, but follows from its forces with
the gel: there the source gives the derivatives of these (`joint.off_design`). A linear law leaves
out a part of the force that grows with the depth (docs/physics.md, "Modulus"). No gel is exactly
neo-Hookean either: a part of the difference between both laws is left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import Wrench
from gelslim_force.presses.gel_calibration import GelCalibration, designed_thickness_mm

if TYPE_CHECKING:
    from gelslim_force.contact.normal_source import NormalReading
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
LN_THICKNESS_STEP, RATIO_STEP = 0.02, 0.002
"""Changes for differences."""
_SKIN_STEP, _LEAST_SKIN_STEP = 0.03, 0.005
"""The same for the skin: a share of its stiffness, and of modulus times thickness."""
_DEPTHS, _LEFT_OUT = (0.0, 0.1, 0.2, 0.3, 0.5), (0.0, 0.03, 0.11, 0.20, 0.47)
"""Depth of a ball over the thickness, and the share of its force that a linear law leaves out."""
_LAW_SIGMA = 0.15
"""Standard deviation of the force of a real gel from that of a neo-Hookean one, over what a linear
law leaves out. It is assumed: no press of a real gel was measured for it."""


def varied_bundles(bundle: Bundle, gel: GelCalibration) -> list[tuple[Bundle, Bundle, float]]:
    """Sensors with a thicker and a thinner gel, of another Poisson's ratio and in another skin.

    The latter two only if they vary.

    Returns:
        For each parameter the sensor with less and with more of it, and the size of this step; none
        for a crowned gel, whose mesh is not stretched.
    """
    if bundle.mesh.surface_shift is not None:
        return []
    step = LN_THICKNESS_STEP
    found = [(gel.varied(bundle, -step), gel.varied(bundle, step), step)]
    if gel.covariance[2, 2] > 0:
        step = min(RATIO_STEP, (0.5 - gel.poissons_ratio) / 2)
        found.append((gel.varied(bundle, 0.0, -step), gel.varied(bundle, 0.0, step), step))
    if gel.skin_n_per_mm is not None:
        least = _LEAST_SKIN_STEP * gel.youngs_modulus_mpa * gel.thickness_mm
        step = _SKIN_STEP * gel.skin_n_per_mm + least
        found.append((gel.varied(bundle), gel.varied(bundle, 0.0, 0.0, step), step))
    return found


def varied_covariance(gel: GelCalibration, count: int) -> Array:
    """Covariance (1 + count, 1 + count) of ln modulus and the parameters of `varied_bundles`.

    The modulus changes at a constant ratio of skin and modulus, so that motions do not change.
    """
    size = len(gel.parameters)
    by_ratio = np.eye(size)
    if gel.skin_n_per_mm is not None:
        by_ratio[3, 0] = -gel.skin_n_per_mm
    covariance = by_ratio @ gel.covariance @ by_ratio.T
    free = [0, 1, *([2] if gel.covariance[2, 2] > 0 else []), *([3] if size == 4 else [])]
    used = free[: 1 + count]
    return np.asarray(covariance[np.ix_(used, used)])


@dataclass(frozen=True, eq=False)
class GelShare:
    """What an uncertain gel adds to the covariance of a wrench.

    Attributes:
        covariance: (1 + p, 1 + p) of ln modulus and of what `varied_bundles` varies.
        by_normal: (6, c) product G S for the normal motion.
        derivative: (p, 6, c, 3) of G S by thickness, ratio and skin.
        thickness_mm: Of the gel.
        linear: Whether its law is taken to be linear at every depth.
    """

    covariance: Array
    by_normal: Array
    derivative: Array
    thickness_mm: float
    linear: bool

    @classmethod
    def of(cls, bundle: Bundle, gel: GelCalibration, law: str = "linear") -> GelShare:
        """Make it for one sensor.

        Args:
            bundle: The sensor as designed.
            gel: Its gel as built, or as specified.
            law: Of the gel, as in `PipelineSettings`.
        """
        pairs = varied_bundles(bundle, gel)
        shape = (len(pairs), 6, len(bundle.mesh.surface), 3)
        derivative = [
            (more.adjoint.forces - less.adjoint.forces) / (2 * step) for less, more, step in pairs
        ]
        by_normal = gel.varied(bundle).adjoint.forces[:, :, 2] if pairs else np.zeros(shape[1:3])
        covariance = varied_covariance(gel, len(pairs))
        whole = np.reshape(derivative, shape)
        return cls(covariance, by_normal, whole, designed_thickness_mm(bundle), law == "linear")

    @classmethod
    def of_law(cls, bundle: Bundle, law: str) -> GelShare:
        """The share of the law alone, for a gel whose modulus, thickness and ratio are known."""
        nodes = len(bundle.mesh.surface)
        nothing = np.zeros((1, 1)), np.zeros((6, nodes)), np.zeros((0, 6, nodes, 3))
        return cls(*nothing, designed_thickness_mm(bundle), law == "linear")

    def added(
        self,
        wrench: Wrench,
        displacement_mm: Array,
        reading: NormalReading | None = None,
        by_linear_law: bool = False,
    ) -> Wrench:
        """The wrench with the share of the gel in its covariance.

        Args:
            wrench: With the covariance of everything else.
            displacement_mm: (c, 3) motion of the surface nodes; z is NaN where it is unknown.
            reading: The normal motion, with its derivatives by thickness, ratio and skin where it
                depends on the gel, or that of its forces.
            by_linear_law: Whether these forces are those of a linear gel although its law is
                another one.
        """
        parts = self._by_gel(displacement_mm, reading)
        by_gel = np.vstack([np.nan_to_num(wrench.vector), parts])
        share = by_gel.T @ self.covariance @ by_gel
        left_out = self._left_out(displacement_mm) * by_gel[0]
        left_out *= 1.0 if self.linear or by_linear_law else _LAW_SIGMA
        total = wrench.covariance + share + np.outer(left_out, left_out)
        return replace(wrench, covariance=total)

    def _by_gel(self, displacement_mm: Array, reading: NormalReading | None) -> Array:
        """(p, 6) change of the wrench by thickness, ratio and skin."""
        if reading is not None and reading.forces is not None and reading.forces.by_gel is not None:
            return reading.forces.by_gel
        motion = np.nan_to_num(displacement_mm)
        parts = np.einsum("pwci,ci->pw", self.derivative, motion)
        if reading is not None and reading.by_gel_mm is not None:
            parts = parts + reading.by_gel_mm @ self.by_normal.T
        return np.asarray(parts)

    def _left_out(self, displacement_mm: Array) -> float:
        """Share of the force that the linear law leaves out; 0 where the depth is unknown."""
        depth = -float(np.nan_to_num(displacement_mm[:, 2]).min(initial=0.0))
        return float(np.interp(depth / self.thickness_mm, _DEPTHS, _LEFT_OUT))
