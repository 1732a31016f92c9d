"""Ladders of interpolation, operator, force method and compensation: error against time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import (
    CloughTocher2DInterpolator,
    LinearNDInterpolator,
    NearestNDInterpolator,
    RBFInterpolator,
)
from scipy.spatial import Delaunay

from bench.rigs.force_ladder_markers import median_ms
from bench.rigs.force_rig import GEL, SEED, Rig
from gelslim_force.forces.estimator import ForceEstimator, ForceSettings
from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_force.motion.marker_motion import COMPENSATIONS, MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.operators.ladder import lumped, refined
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Interpolate = Callable[[Array], Array]
PLACE_NOISE_PX, DEPTH_ERROR = 0.04, 0.02
BUMP_MM = (1.8, 4.0)
METHODS = {
    "direct": ForceSettings(method="direct"),
    "low-pass": ForceSettings(method="low_pass"),
    "low-pass 0.4 mm": ForceSettings(method="low_pass", low_pass_mm=0.4),
    "low-pass 0.75 mm": ForceSettings(method="low_pass", low_pass_mm=0.75),
    "masked": ForceSettings(method="masked"),
}
OPERATORS: dict[str, tuple[str, dict[str, float]]] = {
    "paper, one layer": ("paper", {}),
    "fft": ("fft", {}),
    "fft lumped": ("fft", {"lumped": 1}),
    "pcg 1e-2": ("pcg", {"rtol": 1e-2}),
    "pcg 1e-4": ("pcg", {"rtol": 1e-4}),
    "factor": ("factor", {}),
}
DRAWS = 8


def interpolation(rig: Rig, quick: bool) -> list[dict[str, Any]]:
    """Relative L2 error at the nodes of smooth bumps known at the markers, with and without noise.

    "griddata" ones triangulate in every frame, as markers come and go; "fixed triangles" do not.
    """
    rng = np.random.default_rng(SEED)
    nodes = np.asarray(rig.bundle.mesh.surface_mm)[:, :2]
    rest = rig.grid.positions_mm
    fields = [bump(rng) for _ in range(6 if quick else 24)]
    noise = [rng.normal(0, 0.002, rest.shape) for _ in fields]
    rows = []
    for name, method in interpolations(rig, rest, nodes).items():
        clean = [off(method(f(rest)), f(nodes)) for f in fields]
        noisy = [off(method(f(rest) + n), f(nodes)) for f, n in zip(fields, noise, strict=True)]

        def once(k: int, method: Interpolate = method) -> None:
            method(fields[k % len(fields)](rest))

        rows.append(
            {
                "interpolation": name,
                "error": float(np.mean(clean)),
                "worst": float(np.max(clean)),
                "error_noisy": float(np.mean(noisy)),
                "milliseconds": median_ms(once),
            }
        )
    return rows


def interpolations(rig: Rig, rest: Array, nodes: Array) -> dict[str, Interpolate]:
    """Ways from markers (k, 2) to nodes (c, 2)."""
    markers = rig.bundle.markers
    assert markers is not None
    once = Delaunay(rest)

    def filled(inside: Array, values: Array) -> Array:
        return np.where(np.isnan(inside), NearestNDInterpolator(rest, values)(nodes), inside)

    return {
        "sparse": markers.sparse,
        "thin plate": markers.thin_plate,
        "griddata linear": lambda d: filled(LinearNDInterpolator(rest, d)(nodes), d),
        "fixed triangles, linear": lambda d: filled(LinearNDInterpolator(once, d)(nodes), d),
        "griddata cubic": lambda d: filled(CloughTocher2DInterpolator(rest, d)(nodes), d),
        "fixed triangles, cubic": lambda d: filled(CloughTocher2DInterpolator(once, d)(nodes), d),
        "RBF, all markers": lambda d: RBFInterpolator(rest, d)(nodes),
        "RBF, 25 nearest": lambda d: RBFInterpolator(rest, d, neighbors=25)(nodes),
    }


def bump(rng: np.random.Generator) -> Callable[[Array], Array]:
    """A smooth lateral motion (n, 2) in mm of points (n, 2), about 0.1 mm high."""
    middle, width = rng.uniform(-6, 6, 2), rng.uniform(*BUMP_MM)
    way = rng.normal(size=(2, 2))

    def field(points: Array) -> Array:
        away = (points - middle) / width
        share = 0.1 * np.exp(-(away**2).sum(axis=1) / 2)[:, None]
        return np.asarray(share * (way[0] + away * way[1]))

    return field


def operators(rig: Rig, quick: bool) -> list[dict[str, Any]]:
    """Error of the force field and of its resultant from noisy markers with the depth known.

    Places are off by 0.04 px, the depth by 2 % in one piece. Rows of gel "linear" are against
    the linear fine mesh; those of gel "neo-Hookean" against a neo-Hookean fine mesh, for the same
    motion.
    """
    motion = sensor_motion(rig)
    shown = [noisy_motion(rig, motion, k) for k in range(2 if quick else DRAWS)]
    truth = rig.press.force_n
    rows = []
    for name, (rung, parameters) in OPERATORS.items():
        operator = rig.bundle.surface_operator(rung, **parameters)  # type: ignore[arg-type]
        for method in METHODS:
            if method == "masked" and name not in ("fft lumped", "pcg 1e-2"):
                continue
            row = forces(rig, operator, method, None, shown, truth, motion)
            rows.append({"gel": "linear", "operator": name, "method": method, **row})
    if quick:
        return rows
    large = finite_truth(rig)
    law = FiniteStrainForce(rig.bundle)
    for name, chosen in (("linear pcg 1e-2", None), ("neo-Hookean", law)):
        operator = rig.bundle.surface_operator("pcg", rtol=1e-2)
        for method in ("direct", "low-pass"):
            row = forces(rig, operator, method, chosen, shown, large, motion)
            rows.append({"gel": "neo-Hookean", "operator": name, "method": method, **row})
    return rows


def forces(
    rig: Rig,
    operator: SurfaceOperator,
    method: str,
    law: FiniteStrainForce | None,
    shown: list[Array],
    truth: Array,
    motion: SurfaceMotion,
) -> dict[str, float]:
    """Mean errors and median time of one estimator; a masked fit starts from the last forces."""
    estimator = ForceEstimator(rig.bundle.mesh, operator, METHODS[method], law, motion)
    touched = rig.press.touched if method == "masked" else None
    found = [estimator.estimate(u.copy(), touched, noise_px=PLACE_NOISE_PX).force_n for u in shown]
    start = found[0] if method == "masked" else None

    def once(k: int) -> None:
        estimator.estimate(shown[k % len(shown)].copy(), touched, start, PLACE_NOISE_PX)

    resultant = truth.sum(axis=0)
    miss = [np.linalg.norm(f.sum(axis=0) - resultant) for f in found]
    return {
        "error_field": float(np.mean([off(f, truth) for f in found])),
        "error_resultant": float(np.mean(miss) / np.linalg.norm(resultant)),
        "milliseconds": median_ms(once),
    }


def finite_truth(rig: Rig) -> Array:
    """Forces (c, 3) of the press' motion on a neo-Hookean pad of half the pitch, eight layers."""
    fine = refined(rig.mesh)
    pad = build_bundle(fine, GEL, "bbar", with_stiffness=False)
    moved = rig.press.state.at(np.asarray(fine.surface_mm)[:, :2])
    law = replace(FiniteStrainForce(pad), most_steps=60, inner_rtol=1e-4)
    return lumped(law.force(moved), fine, rig.mesh)


def compensation(rig: Rig, quick: bool) -> list[dict[str, Any]]:
    """What each compensation leaves of projection, in mm at the markers and in N of shear.

    The push has 0.5 mm of depth; what interpolation and mesh add is left out.
    """
    motion = sensor_motion(rig)
    operator = rig.bundle.surface_operator("pcg", rtol=1e-2)
    rows = []
    for model in COMPENSATIONS:
        places = seen_places(rig, motion.view)
        depth = rig.press.markers_mm[:, 2]
        lateral = motion.view.lateral_motion(places, depth, model)
        u = np.zeros_like(rig.press.nodes_mm)
        u[:, :2] = motion.interpolation(lateral - rig.press.markers_mm[:, :2])
        miss = operator.force(u).sum(axis=0)

        def once(k: int, model: Any = model, places: Array = places, depth: Array = depth) -> None:
            motion.view.lateral_motion(places, depth, model)

        error = np.hypot(*(lateral - rig.press.markers_mm[:, :2]).T)
        rows.append(
            {
                "compensation": model,
                "error_mm": float(np.sqrt(np.mean(error**2))),
                "worst_mm": float(error.max()),
                "shear_error_n": float(np.hypot(miss[0], miss[1])),
                "milliseconds": median_ms(once, 0.05 if quick else 0.25),
            }
        )
    return rows


def sensor_motion(rig: Rig) -> SurfaceMotion:
    """Every marker of the sensor, seen from where it is printed."""
    bundle: Bundle = rig.bundle
    assert bundle.markers is not None
    flat = np.column_stack([rig.grid.positions_mm, np.zeros(len(rig.grid))])
    view = MarkerView(rig.camera, rig.camera.project(flat))
    ids = np.arange(len(rig.grid))
    return SurfaceMotion(view, ids, bundle.markers.sparse, np.asarray(bundle.mesh.surface_mm))


def seen_places(rig: Rig, view: MarkerView) -> Array:
    """Places (k, 2) in px of the markers in the full press."""
    return np.asarray(view.camera.project(view.rest_mm + rig.press.markers_mm))


def noisy_motion(rig: Rig, motion: SurfaceMotion, draw: int) -> Array:
    """Nodes' motion (c, 3) as measured: markers with noise, a depth that is off in one piece."""
    rng = np.random.default_rng([SEED, draw])
    places = seen_places(rig, motion.view)
    places = places + rng.normal(0, PLACE_NOISE_PX, places.shape)
    scale = 1 + DEPTH_ERROR * rng.normal()
    lateral = motion.view.lateral_motion(places, scale * rig.press.markers_mm[:, 2])
    u = scale * rig.press.nodes_mm
    u[:, :2] = motion.interpolation(lateral)
    return np.asarray(u)


def off(found: Array, expected: Array) -> float:
    """Relative L2 error."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))
