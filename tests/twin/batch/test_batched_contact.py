"""Contacts side by side: the laws of contact, a closed form, and the solver of single steps."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batch_rig import apart, contacts
from contact_pads import dense_compliance, small_pad, violations
from stepping_rig import at, ball_facets, box_facets, linear_twin, pad_folder, turned, write_stl

from gelslim_twin.batch import engine as engine_module
from gelslim_twin.batch.complementarity import lcp_forces
from gelslim_twin.scene.indenter import Cone, Ring, Sphere, TexturedPlane
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.stepping.twin import Twin

DEVICES = ("cpu", pytest.param("cuda", marks=pytest.mark.slow))


@pytest.fixture(params=DEVICES)
def device(request: pytest.FixtureRequest, engine: Any) -> str:
    if request.param == "cuda" and not engine.torch.cuda.is_available():
        pytest.skip("NOT TESTED: PyTorch finds no graphics card")
    return str(request.param)


def bodies(folder: Path) -> list[tuple[Body, float, float]]:
    """Bodies with the height of the origin over the lowest point, and a tilt."""
    ball = Body.from_mesh(write_stl(folder / "ball.stl", ball_facets(4.0, 12)))
    block = Body.from_mesh(write_stl(folder / "box.stl", box_facets(3, 2, 2)), resolution_mm=0.1)
    return [
        (Body.sphere(4.0), 4.0, 0.0),
        (Body.box(3.0, 2.0, 3.0), 1.5, 5.0),
        (ball, 4.0, 20.0),
        (block, 1.0, 2.0),
        (Body.from_indenters(Sphere(shape="sphere", radius_mm=3.0, x_mm=1.0),
                             Cone(shape="cone", included_angle_deg=120, tip_radius_mm=0.2)),
         0.0, 8.0),
    ]  # fmt: skip


def reliefs() -> list[Body]:
    """Ridges that nodes slide off, and a ring whose wall they meet from a ball within it."""
    ridges = TexturedPlane(
        shape="textured_plane", texture="ridges", pitch_mm=1.2, relief_mm=0.3, length_mm=6,
        width_mm=6,
    )  # fmt: skip
    ring = Ring(shape="ring", inner_radius_mm=1.5, outer_radius_mm=2.2)
    ball = Sphere(shape="sphere", radius_mm=6.0, raised_mm=0.07)
    return [Body.from_indenters(ridges), Body.from_indenters(ring, ball)]


@pytest.mark.parametrize("number", [0, 1])
def test_nodes_that_leave_a_tool_and_meet_its_walls(
    pads: dict[float, Path], engine: Any, number: int
) -> None:
    """They keep their planes as in single steps, and nodes beside the first candidates join."""
    twin = linear_twin(pads[0.32])
    twin.add(reliefs()[number])
    poses = contacts(10, 0.0, tilt_deg=2.0 - number, depths_mm=(0.1, 0.6))
    known, found = twin.batch(poses), twin.batch(poses, backend="torch")
    assert apart(known.require_solved(), found).max() < 1e-9
    np.testing.assert_array_equal(found.touch, known.touch)


def test_nodes_that_slip_off_an_edge(pads: dict[float, Path], engine: Any) -> None:
    """Contacts, out of 150 drawn at random, whose forces would change without the kept planes."""
    twin = linear_twin(pads[0.32])
    twin.add(Body.box(3.0, 2.0, 3.0))
    poses = contacts(150, 1.5, tilt_deg=6.0, depths_mm=(0.2, 0.8))[[1, 12, 20, 45, 63]]
    known, found = twin.batch(poses), twin.batch(poses, backend="torch")
    assert not found.one_by_one.any()
    assert apart(known.require_solved(), found).max() < 1e-9


@pytest.mark.parametrize("poisson", [0.32, 0.45])
def test_contacts_are_those_of_single_steps(
    pads: dict[float, Path], poisson: float, device: str, tmp_path: Path
) -> None:
    """In double precision to rounding of the largest nodal force.

    In single precision to 1e-6 of it, except where the last iteration is at the limit of the
    tolerance, so that there is one more or one less.
    """
    for body, height, tilt in bodies(tmp_path):
        twin = linear_twin(pads[poisson])
        twin.add(body)
        poses = contacts(10, height, tilt_deg=tilt)
        known = twin.batch(poses).require_solved()
        found = twin.batch(poses, backend="torch", device=device)
        # One pose of the cone needs the bisection of normals that only single steps have.
        assert found.one_by_one.sum() <= (body.name == "tool")
        assert apart(known, found).max() < 1e-9, body.name
        np.testing.assert_array_equal(found.touch, known.touch)
        np.testing.assert_allclose(found.displacement_mm, known.displacement_mm, atol=1e-10)
        np.testing.assert_allclose(found.excess, known.excess, rtol=1e-9)
        rough = twin.batch(poses, backend="torch", device=device, precision="single")
        assert np.median(apart(known, rough)) < 1e-6, body.name
        assert apart(known, rough).max() < 1e-3, body.name


def test_the_laws_of_contact_hold_on_another_compliance(
    engine: Any, tmp_path: Path, device: str
) -> None:
    """No pull, no penetration, no force across a gap, by a dense factor of the whole pad.

    At a Poisson's ratio of 0.45 nodes meet a tool at its height over their places at rest.
    """
    size = {"poisson": 0.45, "cells": 10, "layers": 2}
    pad, twin = small_pad(**size), linear_twin(pad_folder(tmp_path, **size))  # type: ignore[arg-type]
    twin.add(Body.sphere(4.0))
    poses = contacts(8, 4.0, reach_mm=6.0)
    batch = twin.batch(poses, backend="torch", device=device).require_solved()
    exact, x, y = dense_compliance(pad), *batch.points_mm[:, :2].T
    for pose, force, moved in zip(poses, batch.force_n, batch.displacement_mm, strict=True):
        far = (x - pose[0, 3]) ** 2 + (y - pose[1, 3]) ** 2
        height = pose[2, 3] - np.sqrt(np.maximum(16.0 - far, 0.0))
        height[far > 16.0] = 100.0
        broken = violations(exact, force, height, np.zeros((len(x), 2)), 0.0)
        assert broken["pull"] == 0.0
        assert broken["penetration"] < 1e-5
        assert broken["complementarity"] < 1e-5
        assert -force[:, 2].sum() > 1e-3
        np.testing.assert_allclose((exact @ force.ravel()).reshape(-1, 3), moved, atol=2e-6)


def test_nodes_in_contact_lie_on_a_ball_that_they_follow(
    pads: dict[float, Path], device: str
) -> None:
    """At 0.32 nodes meet the ball where they have moved: by its equation, at 0.2 % of the depth."""
    twin = linear_twin(pads[0.32])
    twin.add(Body.sphere(5.0))
    poses = contacts(8, 5.0)
    batch = twin.batch(poses, backend="torch", device=device).require_solved()
    places = batch.points_mm + batch.displacement_mm
    off = np.linalg.norm(places - poses[:, None, :3, 3], axis=2) - 5.0
    depth = 5.0 - poses[:, 2, 3]
    on = batch.touch > 0
    assert on.sum(axis=1).min() >= 3
    assert (np.abs(np.where(on, off, 0.0)).max(axis=1) < 2e-3 * depth).all()
    assert (off.min(axis=1) > -2e-3 * depth).all()
    towards = places - poses[:, None, :3, 3]
    normal = towards / np.linalg.norm(towards, axis=2, keepdims=True)
    # Without friction a force points along the normal, away from the ball.
    along = (batch.force_n * normal).sum(axis=2)
    across = np.linalg.norm(batch.force_n - along[..., None] * normal, axis=2)
    assert (along >= 0).all()
    assert (across.max(axis=1) < 2e-3 * along.max(axis=1)).all()


@pytest.mark.slow
def test_thin_compressible_layers(engine: Any, tmp_path: Path) -> None:
    """F = π M R d² / h under a ball much larger than the layer is thick (Johnson 1985, 5.8)."""
    size = {"poisson": 0.2, "cells": 26, "layers": 3, "size": 13.0, "thick": 0.5}
    pad, twin = small_pad(**size), linear_twin(pad_folder(tmp_path, **size))  # type: ignore[arg-type]
    radius, depths = 120.0, np.array([0.03, 0.045, 0.06])
    twin.add(Body.sphere(radius))
    poses = np.array([at(0, 0, radius - d) for d in depths])
    batch = twin.batch(poses, backend="torch").require_solved()
    modulus = pad.material.lame_lambda_mpa + 2 * pad.material.shear_modulus_mpa
    layer = math.pi * modulus * radius * depths**2 / 0.5
    np.testing.assert_allclose(-batch.wrench[:, 2], layer, rtol=0.08)


def test_complementarity_of_random_matrices(engine: Any) -> None:
    """The conditions hold for each of matrices of different sizes that are solved together."""
    rng = np.random.default_rng(2)
    normal, height = np.tile(np.eye(12), (40, 1, 1)), np.full((40, 12), np.inf)
    for number in range(40):
        m = rng.integers(1, 13)
        root = rng.normal(size=(m, m))
        normal[number, :m, :m] = root @ root.T + 0.1 * np.eye(m)
        height[number, :m] = rng.normal(size=m)
    guess = engine.torch.as_tensor(rng.random((40, 12)) < 0.3)
    found = lcp_forces(engine, engine.double(normal), engine.double(height), guess)
    assert bool(found.found.all())
    force = found.force.numpy()
    gap = np.where(np.isinf(height), 1.0, height) - np.einsum("bij,bj->bi", normal, force)
    assert (force <= 0).all()
    assert gap.min() > -1e-9
    assert np.abs(force * gap).max() < 1e-9
    assert not force[np.isinf(height)].any()
    lost = normal.copy()
    lost[3, :2, :2] = [[1.0, 2.0], [2.0, 1.0]]
    height[3, :2] = -1.0
    spoilt = lcp_forces(engine, engine.double(lost), engine.double(height), guess | True)
    assert np.flatnonzero(~spoilt.found.numpy()).tolist() == [3]


def test_what_is_not_solved_together_is_solved_one_by_one(
    pads: dict[float, Path], engine: Any
) -> None:
    twin = linear_twin(pads[0.32])
    twin.add(Body.sphere(3.0))
    twin.add(Body.box(2.0, 2.0, 2.0))
    poses = np.array([[at(-2, 0, 2.8), at(3, 0, 0.9)], [at(-2, 0, 9.0), at(3, 0, 0.9)],
                      [at(-2, 0, 9.0), at(3, 0, 9.0)], [at(-2, 0, 2.9), at(3, 0, -1.5)],
                      [at(-2, 0, 2.9), at(3, 0, 9.0)]])  # fmt: skip
    known, found = twin.batch(poses), twin.batch(poses, backend="torch")
    np.testing.assert_array_equal(found.one_by_one, [True, False, False, True, False])
    assert list(found.errors) == list(known.errors) == [3]
    np.testing.assert_allclose(found.force_n, known.force_n, atol=1e-12)


@pytest.mark.slow
def test_large_strain_is_solved_one_by_one(pads: dict[float, Path], engine: Any) -> None:
    deep = Twin(pads[0.32], tolerance={"force": "5%"})
    deep.add(Body.sphere(4.0))
    press = [at(0, 0, 3.97), at(0, 0, 3.3)]
    both = deep.batch(press, backend="torch")
    np.testing.assert_array_equal(both.large_strain, [False, True])
    np.testing.assert_array_equal(both.one_by_one, [False, True])
    np.testing.assert_array_equal(both.force_n[1], deep.batch(press).force_n[1])


def test_parts_that_fit_into_memory_do_not_change_the_forces(
    pads: dict[float, Path], engine: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One pose a part, whatever the number of candidates of the others."""
    twin = linear_twin(pads[0.32])
    twin.add(Body.box(3.0, 2.0, 3.0))
    poses = contacts(6, 1.5, tilt_deg=2.0)
    whole = twin.batch(poses, backend="torch")
    monkeypatch.setattr(engine_module, "CPU_BYTES", 1)
    assert apart(whole, twin.batch(poses, backend="torch")).max() < 1e-12


def test_failed_poses_have_the_errors_of_steps(
    pads: dict[float, Path], engine: Any, tmp_path: Path
) -> None:
    lid = np.concatenate([box_facets(4, 4, 0.4), box_facets(6, 4, 1) + np.array([0, 0, 0.9])])
    twin = linear_twin(pads[0.32])
    twin.add(Body.from_mesh(write_stl(tmp_path / "shelf.stl", lid)))
    poses = np.array([at(0, 0, 0.1), at(0, 0, -0.7), np.zeros((4, 4)), at(0, 0, -3.0),
                      at(0.5, 0.5, 0.1, turned("z", 30.0))])  # fmt: skip
    known, found = twin.batch(poses), twin.batch(poses, backend="torch")
    assert {k: str(e) for k, e in found.errors.items()} == {
        k: str(e) for k, e in known.errors.items()
    }
    assert list(found.errors) == [1, 2, 3]
    assert apart_where_solved(known.force_n, found.force_n) < 1e-12


def apart_where_solved(known: Any, found: Any) -> float:
    np.testing.assert_array_equal(np.isnan(known), np.isnan(found))
    return float(np.nanmax(np.abs(known - found)))


@pytest.mark.parametrize(
    "options",
    [{"device": "cuda:7"}, {"device": "mps"}, {"device": "gpu"}, {"precision": "half"}],
)
def test_devices_that_are_refused(
    pads: dict[float, Path], engine: Any, options: dict[str, Any]
) -> None:
    twin = linear_twin(pads[0.32])
    twin.add(Body.sphere(4.0))
    with pytest.raises(StepError, match=r"device|precision"):
        twin.batch([at(0, 0, 3.9)], backend="torch", **options)


def test_twins_that_are_refused(pads: dict[float, Path]) -> None:
    """Friction, a soft layer and large strain, before PyTorch is asked for."""
    rough = linear_twin(pads[0.32], friction=0.3)
    strained = Twin(pads[0.32], effects={"nonlinearity": "on"})
    soft = linear_twin(pads[0.32])
    for twin, body in (
        (rough, Body.sphere(4.0)),
        (strained, Body.sphere(4.0)),
        (soft, Body.sphere(4.0).with_layer(1.0, 0.2)),
    ):
        twin.add(body)
        with pytest.raises(StepError, match="torch"):
            twin.batch([at(0, 0, 3.9)], backend="torch")
