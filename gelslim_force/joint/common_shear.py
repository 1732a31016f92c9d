"""The prior of tractions along the surface: a common share of the pressure, and what deviates.

An object that is drawn along the surface puts tangential tractions on all of its contact, about in
proportion to the pressure. A prior that keeps each of them small makes their sum too small. Where
the camera looks at a slant, a marker that is drawn along the line of sight looks like one that is
pressed in, so that the normal force takes up what the shear lacks. The prior is therefore that of

    t = s p + d,

with the pressure p, a ratio s of each contact and direction whose standard deviation is wide, and a
narrow prior of the deviations d. With the inverse covariance Q of the latter, s is eliminated
exactly (Woodbury's formula):

    Q - Q p pᵀ Q / (pᵀ Q p + 1 / σ_s²).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.normal_equations import NormalEquations
from gelslim_force.joint.region import parts_of

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TangentialPrior:
    """That of the deviations on p nodes, as it is in the normal equations.

    Attributes:
        numbers: (2, p) of the unknown forces along x and along y.
        neighbours: (p, p) with 1 where nodes are neighbours.
        area_mm2: (p,) on which the forces of a node act.
        roughness_mpa: Standard deviation of the difference of the traction of neighbours.
        size_mpa: Standard deviation of the traction.
    """

    numbers: Nodes
    neighbours: Array
    area_mm2: Array
    roughness_mpa: float
    size_mpa: float

    def with_common_shear(
        self,
        equations: NormalEquations,
        start_n: Array,
        push_n: Array,
        ratio_sigma: float,
        at: tuple[Nodes, NodeLattice],
    ) -> NormalEquations:
        """The equations with a ratio of each contact that is free within its deviation.

        Args:
            equations: With this prior.
            start_n: (k,) all unknown forces at the start.
            push_n: (p,) normal forces in the estimate. Those that are not positive do not count,
                and part contacts.
            ratio_sigma: Standard deviation of the ratio along each direction; 0 for no ratio.
            at: The nodes (p,), and their lattice.
        """
        from gelslim_force.joint.kernels.fit_kernel import free_common_shear

        nodes, lattice = at
        pressing = np.zeros(len(lattice.place), dtype=bool)
        pressing[nodes[push_n > 0]] = True
        if not ratio_sigma or not pressing.any():
            return equations
        hessian, slope = equations.hessian.copy(), equations.slope.copy()
        sizes = self.roughness_mpa, self.size_mpa, ratio_sigma
        push, part = np.maximum(push_n, 0.0), parts_of(pressing, lattice)[nodes]
        own = self.neighbours, self.area_mm2, push, part
        free_common_shear(self.numbers, *own, sizes, start_n, hessian, slope)
        return NormalEquations(hessian, slope)
