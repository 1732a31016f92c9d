"""The motion of a bonded layer under waves of traction, by elements through its thickness only.

Along the plane the motion is a wave: U(z) sin kx and W(z) cos kx for tractions in the plane of the
wave, V(z) sin kx across it. What is left is a problem in z alone, solved by quadratic elements that
are finer towards the surface. It shares nothing with closed forms, nor with a mesh of cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
_ELEMENTS, _GROWTH = 48, 1.25
_WAVES = np.geomspace(1e-2, 300.0, 64)
"""Wave numbers times thickness."""
_FINER = 6
"""Points of the transform for one place along each axis."""


@dataclass(frozen=True, eq=False)
class WaveMotion:
    """Motion at the surface over traction, for waves k: thickness over modulus times a factor.

    Attributes:
        sinking: Of W by a traction along z.
        outward: Of U by a traction along z, and of W by one along x.
        along: Of U by a traction along x.
        across: Of V by a traction along y.
    """

    sinking: CubicSpline
    outward: CubicSpline
    along: CubicSpline
    across: CubicSpline


@cache
def wave_motion(poissons_ratio: float) -> WaveMotion:
    """By waves of all lengths; the splines are over ln kh and give the motion times kh."""
    rows = np.array([_compliance(float(wave), poissons_ratio) for wave in _WAVES])
    rows *= _WAVES[:, None]
    return WaveMotion(*(CubicSpline(np.log(_WAVES), column) for column in rows.T))


def _compliance(wave: float, poissons_ratio: float) -> tuple[float, float, float, float]:
    """W by z, U by z, U by x and V by y of a layer of thickness and modulus 1."""
    plane, across = _stiffness(wave, poissons_ratio)
    nodes = len(across)
    free = np.setdiff1d(np.arange(2 * nodes), [0, nodes])
    load = np.zeros((2 * nodes, 2))
    load[nodes - 1, 0] = load[-1, 1] = 1.0
    found = np.zeros((2 * nodes, 2))
    found[free] = np.linalg.solve(plane[np.ix_(free, free)], load[free])
    sideways = np.linalg.solve(across[1:, 1:], np.eye(nodes)[1:, -1])[-1]
    return found[-1, 1], found[nodes - 1, 1], found[nodes - 1, 0], float(sideways)


def _stiffness(wave: float, poissons_ratio: float) -> tuple[Array, Array]:
    """Of the n nodes from the base to the surface: (2n, 2n) of U, then W, and (n, n) of V."""
    shear = 0.5 / (1 + poissons_ratio)
    lame = poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))
    law = np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])
    size = np.minimum(_GROWTH ** np.arange(_ELEMENTS)[::-1] * 0.05 / wave, 0.5)
    depth = np.concatenate([[0.0], np.cumsum(size / size.sum())])
    nodes = 2 * _ELEMENTS + 1
    plane, across = np.zeros((2 * nodes, 2 * nodes)), np.zeros((nodes, nodes))
    at, weight = np.polynomial.legendre.leggauss(4)
    for e, length in enumerate(np.diff(depth)):
        own = 2 * e + np.arange(3)
        both = np.concatenate([own, nodes + own])
        for x, w in zip(at, weight * length / 2, strict=True):
            value = np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2])
            steep = np.array([x - 0.5, -2 * x, x + 0.5]) * 2 / length
            strain = np.zeros((3, 6))
            strain[0, :3], strain[1, 3:] = wave * value, steep
            strain[2, :3], strain[2, 3:] = steep, -wave * value
            plane[np.ix_(both, both)] += w * strain.T @ law @ strain
            stiff = shear * (np.outer(steep, steep) + wave**2 * np.outer(value, value))
            across[np.ix_(own, own)] += w * stiff
    return plane, across


def hat_response(
    count: int, step_mm: tuple[float, float], thickness_mm: float, gel: tuple[float, float]
) -> Array:
    """Motion (count, count, 3, 3) of places (row, column) by a force on the first one, in mm/N.

    The places are apart by `step_mm` along x and y, and the layer repeats after `count` of them.
    The force acts as a traction that falls to zero at the neighbouring places.

    Args:
        count: Even.
        step_mm: Along x and y.
        thickness_mm: Of the layer.
        gel: Young's modulus in MPa, and Poisson's ratio.
    """
    young, ratio = gel
    motion = wave_motion(ratio)
    points, (dx, dy) = count * _FINER, (step / _FINER for step in step_mm)
    kx = 2 * np.pi * fft.fftfreq(points, dx)[None, :]
    ky = 2 * np.pi * fft.fftfreq(points, dy)[:, None]
    wave = np.maximum(np.hypot(kx, ky), _WAVES[0] / thickness_mm)
    x, y = kx / wave, ky / wave
    log = np.log(np.minimum(wave * thickness_mm, _WAVES[-1]))
    sinking, outward, along, across = (
        spline(log) / (young * wave)
        for spline in (motion.sinking, motion.outward, motion.along, motion.across)
    )
    load = (np.sinc(kx * step_mm[0] / (2 * np.pi)) * np.sinc(ky * step_mm[1] / (2 * np.pi))) ** 2
    load /= dx * dy
    mixed = (along - across) * x * y
    in_x, in_y = along * x * x + across * y * y, along * y * y + across * x * x
    in_x[0, 0] = in_y[0, 0] = across[0, 0]
    by_wave = [
        [in_x, mixed, -1j * x * outward],
        [mixed, in_y, -1j * y * outward],
        [1j * x * outward, 1j * y * outward, sinking],
    ]
    found = np.empty((count, count, 3, 3))
    for i, j in np.ndindex(3, 3):
        found[..., i, j] = fft.ifft2(by_wave[i][j] * load).real[::_FINER, ::_FINER]
    return found
