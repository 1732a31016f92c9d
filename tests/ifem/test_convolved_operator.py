"""Surface operators of the infinite pad: exact resultants, and what the correction buys."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import Polygon, disc

from ifem_export.bundle.bundle import build_bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import Outline, RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import measure_ladder
from ifem_export.operators.surface_operator import surface_operator

OUTLINES: dict[str, Outline] = {
    "rectangle": RoundedRectangle(12.0, 10.0, 2.0),
    "disc": disc(6.0),
    "polygon": Polygon([(-6, -5), (6, -5), (6, 1), (1, 1), (1, 5), (-6, 5)]),
    "long": RoundedRectangle(22.0, 4.2, 0.5),
}
RUNGS = [
    ("truncated", {"radius": 3}),
    ("truncated", {"radius": 6}),
    ("fft", {}),
    ("fft", {"lumped": True}),
]


def gel(nu: float) -> Material:
    return Material(0.147, nu, 1020.0)


def pad(outline: Outline) -> PadMesh:
    return build_pad_mesh(outline, 2.0, pitch_mm=(0.8, 0.7), layers=4)[0]


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("nu", [0.3223, 0.49])
@pytest.mark.parametrize(("rung", "options"), RUNGS)
def test_the_resultant_of_any_motion_is_exact(name, nu, rung, options) -> None:
    mesh = pad(OUTLINES[name])
    u = np.random.default_rng(1).normal(size=(len(mesh.surface), 3))
    exact = surface_operator(mesh, gel(nu), "bbar", "factor").force(u).sum(axis=0)
    found = surface_operator(mesh, gel(nu), "bbar", rung, **options).force(u).sum(axis=0)
    assert np.linalg.norm(found - exact) < 1e-7 * np.linalg.norm(exact)


def test_lumping_mends_the_rim_and_leaves_the_middle_alone() -> None:
    mesh = pad(RoundedRectangle(24.0, 24.0, 1.0))
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    exact = surface_operator(mesh, gel(0.3223), "bbar", "factor")
    rough = surface_operator(mesh, gel(0.3223), "bbar", "fft")
    mended = surface_operator(mesh, gel(0.3223), "bbar", "fft", lumped=True)

    def errors(at: float) -> list[float]:
        bump = np.exp(-((points[:, 0] - at) ** 2 + points[:, 1] ** 2) / 8)
        u = bump[:, None] * [0.3, 0.1, -0.7]
        truth = exact.force(u)
        return [
            float(np.linalg.norm(o.force(u) - truth) / np.linalg.norm(truth))
            for o in (rough, mended)
        ]

    assert max(errors(0.0)) < 1e-3
    before, after = errors(9.0)
    assert before > 0.05
    assert after < before / 3


@pytest.mark.slow
def test_a_bundle_chooses_the_lumped_rung_and_applies_it() -> None:
    mesh = pad(RoundedRectangle(18.0, 15.0, 1.0))
    ladder = measure_ladder(mesh, gel(0.3223), "bbar")
    rung = next(r for r in ladder.rungs if r.label == "fft (lumped 1)")
    plain = next(r for r in ladder.rungs if r.label == "fft")
    assert rung.error_field < 0.5 * plain.error_field
    assert rung.error_resultant == pytest.approx(plain.error_resultant, abs=2e-6)
    bundle = build_bundle(mesh, gel(0.3223), "bbar", with_stiffness=False)
    u = np.random.default_rng(0).normal(size=(len(mesh.surface), 3))
    found = bundle.surface_operator("fft", **dict(rung.parameters)).force(u)
    assert np.array_equal(found, bundle.surface_operator("fft", lumped=True).force(u))
    assert not np.allclose(found, bundle.surface_operator("fft").force(u))
