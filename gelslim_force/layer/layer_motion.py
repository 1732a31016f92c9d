"""Motion of the surface of an endless bonded layer under the force of one node, by its waves.

For a wave vector k the motion under a traction t is, with e = k/|k| and the functions L, M, N of
`LayerResponse` (s = C L/k and so on, C = 2 (1 - ν²)/E),

    u_z = s t_z - i m e·t,    u = i m e t_z + n e (e·t) + q (t - e (e·t)),    q = tanh(kh) / G k;

the last term is shear across the wave: q solves V'' = k² V with V(0) = 0 and G V'(h) = t.

The force of a node is that of a traction, by bilinear functions N_j of the nodes: f_j = ∫ N_j t.
The one traction that is bilinear between the nodes and has the force 1 on one node, and 0 on all
others, has the transform 3 sinc²(k a/2π) / (2 + cos k a) along an axis with the pitch a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import j1

from gelslim_force.layer.layer_response import LayerResponse

Array = NDArray[np.float64]
_PER_PITCH = 16
"""Points of the transform from one node to the next, at least."""
_FLAT = 1e-4
"""Smallest kh: that of the wave without end, whose limit is taken so."""


@dataclass(frozen=True)
class Places:
    """Points where the motion is asked for; they repeat without end along x and y.

    Attributes:
        rows: Along y, even.
        columns: Along x, even.
        step_mm: Between them, along x and y.
    """

    rows: int
    columns: int
    step_mm: tuple[float, float]


def surface_motion(
    layer: LayerResponse,
    youngs_modulus_mpa: float,
    places: Places,
    pitch_mm: tuple[float, float],
    disc_mm: float = 0.0,
) -> Array:
    """Motion (rows, columns, 3, 3) in mm of each place under 1 N along each axis on the first one.

    Args:
        layer: The layer.
        youngs_modulus_mpa: Of it.
        places: Where the motion is given.
        pitch_mm: Of the nodes that bear forces, along x and y.
        disc_mm: Radius of the disc about each place over which the mean is taken; 0 for none.
    """
    x, y, load = _waves(places, pitch_mm)
    wave = np.hypot(x, y)
    size = np.maximum(wave, _FLAT / layer.thickness_mm)
    x, y = x / size, y / size
    if disc_mm > 0:
        reach = size * disc_mm
        load = load * 2 * j1(reach) / reach
    by_plane = 2 * (1 - layer.poissons_ratio**2) / youngs_modulus_mpa / size
    sinking, outward, along = (by_plane * part for part in layer.by_wave(size))
    across = np.tanh(size * layer.thickness_mm) / size
    across *= 2 * (1 + layer.poissons_ratio) / youngs_modulus_mpa
    # Without a wave there is no direction, and the layer shears along both axes.
    along[0, 0] = across[0, 0]
    mixed = (along - across) * x * y
    motion = (
        (along * x * x + across * (1 - x * x), mixed, 1j * x * outward),
        (mixed, along * y * y + across * (1 - y * y), 1j * y * outward),
        (-1j * x * outward, -1j * y * outward, sinking),
    )
    found, finer = np.empty((places.rows, places.columns, 3, 3)), _finer(places, pitch_mm)
    shape = finer[1] * places.rows, finer[0] * places.columns
    for i, j in np.ndindex(3, 3):
        wide = fft.irfft2(motion[i][j] * load, s=shape, workers=1)
        found[..., i, j] = wide[:: finer[1], :: finer[0]]
    return found


def _finer(places: Places, pitch_mm: tuple[float, float]) -> list[int]:
    """Points of the transform for one place, along x and y."""
    return [
        math.ceil(_PER_PITCH * step / pitch - 1e-9)
        for step, pitch in zip(places.step_mm, pitch_mm, strict=True)
    ]


def _waves(places: Places, pitch_mm: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Wave numbers along x and y, and the traction of the force 1, of the transform."""
    along, traction = [], []
    counts, finer = (places.columns, places.rows), _finer(places, pitch_mm)
    axes = zip(counts, finer, places.step_mm, pitch_mm, strict=True)
    for count, points, step, pitch in axes:
        spacing = step / points
        wave = 2 * math.pi * fft.fftfreq(points * count, spacing)
        hat = np.sinc(wave * pitch / (2 * math.pi)) ** 2
        along.append(wave)
        traction.append(3 * hat / (2 + np.cos(wave * pitch)) / spacing)
    half = len(along[0]) // 2 + 1
    x, y = along[0][None, :half], along[1][:, None]
    return x, y, np.outer(traction[1], traction[0][:half])
