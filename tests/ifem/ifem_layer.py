"""A layer bonded to rigid plates on both faces and pressed: ours, and two independent truths."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh


def solve_held(K, held: np.ndarray, u: np.ndarray, load: np.ndarray | None = None) -> np.ndarray:
    """Displacement (n, 3) with the `held` (n, 3) components of `u` kept, `load` on the others."""
    flat = u.ravel().copy()
    free = np.flatnonzero(~held.ravel())
    right = -(K @ np.where(held.ravel(), flat, 0.0))[free]
    if load is not None:
        right += load.ravel()[free]
    if len(free):
        flat[free] = spsolve(K[free][:, free].tocsc(), right)
    return flat.reshape(-1, 3)


def press_force(
    formulation: str,
    material: Material,
    half_mm: tuple[float, float],
    thickness_mm: float,
    cells: tuple[int, int, int],
    strain: float = 0.01,
    plane_strain: bool = False,
) -> float:
    """Force (N) on a quarter of the layer compressed by `strain`, both faces bonded."""
    size = (half_mm[0] / cells[0], half_mm[1] / cells[1], thickness_mm / cells[2])
    mesh = PadMesh.from_occupancy(np.ones(cells, dtype=bool), size, (0.0, 0.0, -thickness_mm))
    K = assemble_csr(mesh.occupancy, hex8_stiffness(size, material, formulation))
    held = np.zeros((mesh.n_nodes, 3), dtype=bool)
    held[mesh.bonded] = held[mesh.surface] = True
    held[np.isclose(mesh.nodes_mm[:, 0], 0.0), 0] = True
    held[np.isclose(mesh.nodes_mm[:, 1], 0.0), 1] = True
    if plane_strain:
        held[:, 1] = True
    u = np.zeros((mesh.n_nodes, 3))
    u[mesh.surface, 2] = -strain * thickness_mm
    u = solve_held(K, held, u)
    return float(-(K @ u.ravel()).reshape(-1, 3)[mesh.surface, 2].sum())


def strip_force_closed_form(
    material: Material, half_mm: float, thickness_mm: float, strain: float = 0.01
) -> float:
    """Force per length (N/mm) on half of a long bonded strip, for half width >> thickness.

    Lubrication theory of a compressible layer: flow in parabolas between the plates gives
    p'' = 12 G/(κ t²) (p - κ ε), so p = κ ε (1 - cosh βx / cosh βa), β² = 12 G/(κ t²).
    """
    g, bulk = material.shear_modulus_mpa, material.bulk_modulus_mpa
    beta = np.sqrt(12.0 * g / bulk) / thickness_mm
    return bulk * strain * (half_mm - np.tanh(beta * half_mm) / beta)


@lru_cache(maxsize=32)
def mixed_force(nu: float, half_mm: float, thickness_mm: float, n: int) -> float:
    """The same force by scikit-fem's triquadratic displacement and trilinear pressure (E = 1).

    Taylor-Hood elements satisfy the inf-sup condition: no locking at any ν. One eighth of the
    layer (square, half width `half_mm`), n cells each way, graded towards the free sides and
    the plate, where the stress is singular. strain = 0.01.
    """
    import skfem
    from skfem.helpers import ddot, div, sym_grad

    material = Material(1.0, nu, 1.0)
    g, lam = material.shear_modulus_mpa, material.lame_lambda_mpa
    graded = 1.0 - (1.0 - np.linspace(0.0, 1.0, n + 1)) ** 2.0
    x, z = graded * half_mm, graded * thickness_mm / 2.0
    mesh = skfem.MeshHex.init_tensor(x, x, z)
    ub = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    pb = ub.with_element(skfem.ElementHex1())

    @skfem.BilinearForm
    def shear(u, v, _):
        return 2.0 * g * ddot(sym_grad(u), sym_grad(v))

    @skfem.BilinearForm
    def coupling(u, q, _):
        return -div(u) * q

    @skfem.BilinearForm
    def compliance(p, q, _):
        return p * q / lam

    A, B = shear.assemble(ub), coupling.assemble(ub, pb)
    K = sparse.bmat([[A, B.T], [B, -compliance.assemble(pb)]]).tocsr()
    plate = ub.get_dofs(lambda at: np.isclose(at[2], thickness_mm / 2.0))
    held = [plate.all()]
    for axis, name in enumerate(("u^1", "u^2", "u^3")):
        on = ub.get_dofs(lambda at, axis=axis: np.isclose(at[axis], 0.0))
        held.append(on.all(name))
    fixed = np.unique(np.concatenate(held))
    total = np.zeros(K.shape[0])
    pressed = plate.all("u^3")
    total[pressed] = -0.01 * thickness_mm / 2.0
    free = np.setdiff1d(np.arange(K.shape[0]), fixed)
    total[free] = spsolve(K[free][:, free].tocsc(), -(K @ total)[free])
    return float(-(K @ total)[pressed].sum())
