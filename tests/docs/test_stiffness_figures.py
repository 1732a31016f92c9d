"""Tables of docs/stiffness.md that no bench keeps: cut cells, noise, iterations."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from page_text import DOCS, text_of

from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.inverse.contact_inverse import masked_force, smoothing
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, Weighting, build_pad_mesh
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import pad_solver
from ifem_export.operators.surface_operator import surface_operator

PAGE = text_of(DOCS / "stiffness.md")
DRAWS = 12


def gel(nu: float = 0.3223) -> Material:
    return Material(0.147, nu, 1020.0)


def pad() -> PadMesh:
    return build_pad_mesh(RoundedRectangle(28.0, 28.0, 1.0), 2.0, cells=(42, 42, 4))[0]


def told(row: str) -> list[float]:
    """Numbers of a table's row."""
    found = re.search(rf"^\| {re.escape(row)} \|(.*)\|$", PAGE, re.MULTILINE)
    assert found is not None, row
    return [float(n) for n in re.findall(r"[\d.]+", found.group(1))]


def test_iterations_of_the_solver() -> None:
    """Within one: the last digits of a processor may decide."""
    found = re.search(r"4 pad: ([\d, ]+) at ν = ([\d., ]+\d)\.", PAGE)
    assert found is not None
    counts, ratios = (part.split(", ") for part in found.groups())
    mesh = pad()
    for count, nu in zip(counts, ratios, strict=True):
        element = hex8_stiffness(mesh.cell_size_mm, gel(float(nu)), "bbar")
        system = PadSystem(mesh, element)
        b = np.random.default_rng(3).normal(size=system.stiffness.shape[0])
        iterations = pad_solver(system, "pcg").solve(b, 1e-8).iterations
        assert iterations == pytest.approx(int(count), abs=1), nu


def resultants(cells: int, weighting: Weighting) -> NDArray[np.float64]:
    """Normal and tangential force of a disc moved by 0.1 mm."""
    mesh, _ = build_pad_mesh(
        RoundedRectangle(8.0, 8.0, 4.0), 2.0, cells=(cells, cells, 3), weighting=weighting
    )
    operator = surface_operator(mesh, gel(), "bbar", "pcg", rtol=1e-7)
    moves = np.array([[0.0, 0.0, -0.1], [0.1, 0.0, 0.0]])
    totals = [operator.force(np.tile(m, (len(mesh.surface), 1))).sum(axis=0) for m in moves]
    return np.array([totals[0][2], totals[1][0]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("row", "weighting"),
    [("cell centres", "cell_centre"), ("volume fractions", "volume_fraction")],
)
def test_cut_cells(row: str, weighting: Weighting) -> None:
    exact = resultants(96, "volume_fraction")
    sizes = [int(n) for n in told("cells across")]
    found = [100 * np.abs(resultants(n, weighting) / exact - 1).max() for n in sizes]
    assert found == pytest.approx(told(row), abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.3223, 0.49])
def test_noise(nu: float) -> None:
    """A press of 2 N: field and spread of F_z, raw, smoothed, and with the contact known."""
    mesh = pad()
    exact, quick = (surface_operator(mesh, gel(nu), "bbar", r) for r in ("factor", "fft"))
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    square = (points[:, :2] ** 2).sum(axis=1)
    shape = np.sqrt(np.maximum(1 - square / 9.0, 0.0))
    force = np.outer(shape / shape.sum(), [0.8, 0.0, -2.0])
    motion, mask = exact.displacement(force), square < 3.3**2
    smooth = smoothing(points, 0.7)
    assert np.abs(motion).max() == pytest.approx(1.07, abs=0.03)
    for noise_um in (5, 20):
        seen = []
        start = None
        for seed in range(DRAWS):
            draw = np.random.default_rng(seed).normal(size=motion.shape)
            noisy = motion + 1e-3 * noise_um * draw
            masked = masked_force(quick, noisy, mask, friction=1.0, start_n=start).force_n
            start = masked
            found = (exact.force(noisy), smooth @ exact.force(noisy), masked)
            seen.append([
                (np.linalg.norm(f - force) / np.linalg.norm(force), f[:, 2].sum() / -2.0 - 1)
                for f in found
            ])  # fmt: skip
        fields, pushes = 100 * np.moveaxis(np.array(seen), 2, 0)
        table = np.reshape(told(f"{noise_um} µm, {nu:g}"), (3, 2))
        np.testing.assert_allclose(fields.mean(axis=0), table[:, 0], atol=0.06)
        np.testing.assert_allclose(pushes.std(axis=0), table[:, 1], atol=0.06)
        # Right in the mean: three standard errors.
        assert (np.abs(pushes.mean(axis=0)) < 3 * pushes.std(axis=0) / DRAWS**0.5).all()
