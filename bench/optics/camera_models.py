"""Camera models from a pinhole at f to a thick lens: error in px, µm and N against time.

    python -m bench.optics.camera_models             # writes docs/data/camera_models.json
    python -m bench.optics.camera_models --quick     # one design and a coarser picture, prints only

The real camera is the lens of `thick_lens`, traced by bundles of rays, with its sensor and the
target of the build guide in their places. It sees the print at rest and a smooth press. Each model
says where it expects the markers, and turns the motion that is seen into motion of the gel and
force, by the steps of the force pipeline with the depth given.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gelslim
from bench.bench_data import DOCS, write_data
from bench.models.thick_lens import DISTORTION, PUPIL, SEPARATION, ThickLens, centroids_px
from bench.models.thin_lens import ThinLens
from bench.rigs.machine import machine
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec.reader import read_spec
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.design import bundle_camera, bundle_grid
from gelslim_force.calibration.fit import fit_camera
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.bundle.bundle import Bundle
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]
DESIGNS = ("gelslim2", "mini20", "gelslim3_lens")
RAYS, SAMPLES = 64, 64
"""Rays of a bundle of the real camera, and of a pixel of its picture."""
RING = 8
"""Rays of a model's bundle. On a ring of the radius √½ they have the second moment of the pupil."""
NO_DISTORTION = CameraTolerance(k1=1e-9, k2=1e-9, tangential=1e-9)
PRESS_MM, PRESS_WIDTH_MM, PRESS_PLACE = (0.1732, 0.1, -0.3), 2.5, (0.2, -0.15)
"""Motion in the middle, standard deviation, and place as a share of the gel's size."""


@dataclass(frozen=True, eq=False)
class Model:
    """A camera model: a pinhole, or the mean of the rays through points of a pupil."""

    label: str
    camera: VirtualCamera
    pupil_mm: Array | None = None
    """(m, 2) points of the pupil along the camera's right and down."""
    sharp_mm: float = 0.0
    """Distance from the pupil of the plane that is sharp."""

    @property
    def work(self) -> tuple[int, bool, int]:
        """What a projection computes: layers, distortion, rays. Models alike in it take as long."""
        rays = 1 if self.pupil_mm is None else len(self.pupil_mm)
        return len(self.camera.layers), self.camera.lens is not None, rays

    @cached_property
    def pinholes(self) -> list[VirtualCamera]:
        """Ideal pinholes at the points of the pupil, which agree in the plane that is sharp."""
        c, points = self.camera, np.zeros((1, 2)) if self.pupil_mm is None else self.pupil_mm
        return [
            replace(
                c,
                position_mm=c.position_mm + point @ c.axes[:2],
                principal_offset_px=tuple(point * c.focal_px / self.sharp_mm),
                lens=None,
            )
            for point in points
        ]

    def project(self, points_mm: Array) -> Array:
        """Centroids (n, 2) in px of the images of points (n, 3)."""
        c = self.camera
        if self.pupil_mm is None:
            return c.project(points_mm)
        images = [(p.project(points_mm) - c.principal_px) / c.focal_px for p in self.pinholes]
        if c.lens is not None:
            images = [c.lens.distort(image) for image in images]
        return np.asarray(c.focal_px * np.mean(images, axis=0) + c.principal_px)

    def aside_px(self, points_mm: Array) -> Array | float:
        """Centroid minus image by the ray through the middle of the pupil, (n, 2)."""
        if self.pupil_mm is None:
            return 0.0
        return self.project(points_mm) - self.camera.project(points_mm)


@dataclass(frozen=True, eq=False)
class Scene:
    """A finger, and what a traced lens sees of its k markers at rest and pressed."""

    d: Dimensions
    bundle: Bundle
    lens: ThinLens
    nodes_mm: Array
    """(c, 3) true motion of the surface nodes."""
    markers_mm: Array
    """(k, 3) true motion of the markers, bilinear in that of the nodes."""
    rest_px: Array
    pressed_px: Array

    @classmethod
    def of(cls, name: str, lens_of: Callable[[Dimensions], ThinLens] = ThickLens.of) -> Scene:
        """The scene of one of the project's designs."""
        path = DOCS.parent / "designs" / f"{name}.yaml"
        d = derive(read_spec(path).spec)
        bundle, lens = gelslim.make_bundle(path, measure=False).bundle, lens_of(d)
        surface, rest = np.asarray(bundle.mesh.surface_mm), flat(bundle)
        size = np.array([d["design.gel.length_mm"], d["design.gel.width_mm"]])
        away = (surface[:, :2] - PRESS_PLACE * size) / PRESS_WIDTH_MM
        nodes = np.exp(-(away**2).sum(axis=1) / 2)[:, None] * np.array(PRESS_MM)
        moved = marker_to_node(surface, rest) @ nodes
        guess = bundle_camera(bundle).project
        seen = [centroids_px(lens, p, guess(p), RAYS) for p in (rest, rest + moved)]
        return cls(d, bundle, lens, nodes, moved, *seen)

    def motion(self, model: Model) -> SurfaceMotion:
        """The pipeline's step from pixels to motion, for one model."""
        rest = flat(self.bundle)
        view = MarkerView(model.camera, self.rest_px - model.aside_px(rest))
        markers = self.bundle.markers
        assert markers is not None
        ids = np.arange(len(rest))
        return SurfaceMotion(view, ids, markers.sparse, np.asarray(self.bundle.mesh.surface_mm))

    @property
    def reading(self) -> NormalReading:
        """The depth as it is."""
        w = self.nodes_mm[:, 2]
        return NormalReading(w, np.zeros_like(w), w < -0.01)


def flat(bundle: Bundle) -> Array:
    """The markers (k, 3) of a bundle on the gel at rest."""
    positions = bundle_grid(bundle).positions_mm
    return np.column_stack([positions, np.zeros(len(positions))])


def designed(scene: Scene) -> list[Model]:
    """The models that know the design alone."""
    design, thin = bundle_camera(scene.bundle), ThinLens.as_built(scene.d)
    return [
        Model("pinhole at f", replace(design, focal_px=thin.focal_mm / thin.pitch_mm)),
        Model("straight rays, v", replace(design, layers=())),
        Model("pinhole at v", design),
        Model("thin lens at v, 8 rays", design, ring_mm(thin), scene.d["view.focus_mm"]),
    ]


def ring_mm(lens: ThinLens) -> Array:
    """Points (RING, 2) of a pupil, in mm, that stand for its rays."""
    turn = 2 * np.pi * np.arange(RING) / RING
    radius = lens.aperture_mm / 2 * np.sqrt(0.5)
    return np.asarray(radius * np.column_stack([np.cos(turn), np.sin(turn)]))


def calibrated(scene: Scene, samples: int = SAMPLES) -> tuple[list[Model], float]:
    """`gelslim calibrate` by one picture, without distortion and with it, and its CPU seconds."""
    bundle, grid = scene.bundle, bundle_grid(scene.bundle)
    bright = scene.lens.picture(grid.positions_mm[:, :2], grid.diameter_mm, samples)
    picture = np.round(60 + 150 * bright).astype(np.uint8)
    calibrate(bundle, picture)  # Compiles what it needs.
    started = time.process_time()
    full = calibrate(bundle, picture)
    seconds = time.process_time() - started
    shown, diameter = grid.positions_mm[full.markers], grid.diameter_mm[full.markers]
    design = bundle_camera(bundle)
    plain = fit_camera(design, shown, diameter, full.reference_px, NO_DISTORTION).camera
    return [
        Model("calibrated pose and scale", replace(plain, lens=None)),
        Model("calibrated with distortion", full.camera),
    ], seconds


def known(scene: Scene) -> list[Model]:
    """The models that know the thick lens of the scene.

    A pinhole at the entrance pupil sees the plane that is sharp, hence the lens, at the scale v/s.
    The distortion is the polynomial nearest to the lens's own law up to the corner of the picture.

    Raises:
        TypeError: The scene was seen by a thin lens.
    """
    lens, thin, design = scene.lens, ThinLens.as_built(scene.d), bundle_camera(scene.bundle)
    if not isinstance(lens, ThickLens):
        raise TypeError("a thick lens is needed")
    sharp = lens.conjugate_mm - lens.pupil_mm
    focal_mm = lens.sensor_mm * sharp / lens.conjugate_mm
    forward = (lens.centre - thin.centre) @ lens.forward + lens.pupil_mm
    radius = np.linspace(0, 1, 200) * np.hypot(*lens.size_px) / 2 * lens.pitch_mm / focal_mm
    angle = np.arctan(radius * focal_mm / lens.sensor_mm)
    bent = np.tan(lens.bend * angle) / lens.bend * lens.sensor_mm / focal_mm
    k1, k2, k3 = np.linalg.lstsq(radius[:, None] ** np.array([3, 5, 7]), bent - radius)[0]
    camera = replace(
        design,
        position_mm=design.position_mm + forward * design.forward,
        focal_px=focal_mm / lens.pitch_mm,
        lens=LensDistortion(k1=k1, k2=k2, k3=k3),
    )
    return [
        Model("thick lens as it is", camera),
        Model("thick lens as it is, 8 rays", camera, ring_mm(lens), float(sharp)),
    ]


def errors(scene: Scene, model: Model) -> dict[str, float]:
    """Errors of places in px, of motion at the markers in µm and of force in N and as a share."""
    off = np.hypot(*(model.project(flat(scene.bundle)) - scene.rest_px).T)
    motion = scene.motion(model)
    shown = converted(scene, model, motion)
    wrong = np.hypot(*(shown - scene.markers_mm)[:, :2].T)
    operator = scene.bundle.surface_operator("pcg", rtol=1e-6)
    miss = np.zeros_like(scene.nodes_mm)
    miss[:, :2] = motion.interpolation((shown - scene.markers_mm)[:, :2])
    force, true = operator.force(miss), operator.force(scene.nodes_mm)
    total = float(np.linalg.norm(force.sum(axis=0)))
    return {
        "error_px": rms(off),
        "worst_px": float(off.max()),
        "error_um": 1000 * rms(wrong),
        "worst_um": 1000 * float(wrong.max()),
        "error_n": total,
        "error_force": total / float(np.linalg.norm(true.sum(axis=0))),
        "error_field": float(np.linalg.norm(force) / np.linalg.norm(true)),
    }


def converted(scene: Scene, model: Model, motion: SurfaceMotion) -> Array:
    """Motion (k, 3) of the markers that a model reads from their places in the picture.

    A model with a pupil first takes off what the chief ray does not show.
    """
    seen, rest = scene.pressed_px, motion.view.rest_mm
    found = motion.of_markers(seen - model.aside_px(rest), scene.reading)
    if model.pupil_mm is None:
        return found
    return motion.of_markers(seen - model.aside_px(rest + found), scene.reading)


def rms(sizes: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(sizes**2)))


def cpu_ms(scene: Scene, found: list[Model], rounds: int) -> dict[tuple[int, bool, int], float]:
    """Median CPU time in ms of projecting and back-projecting all markers, by `Model.work`.

    The kinds take turns, so that what else the machine does meets all of them.
    """
    kinds = {model.work: (model, scene.motion(model)) for model in found}
    times: dict[tuple[int, bool, int], list[float]] = {work: [] for work in kinds}
    rest = flat(scene.bundle)
    for _ in range(rounds + 1):
        for work, (model, motion) in kinds.items():
            started = time.process_time()
            model.project(rest)
            converted(scene, model, motion)
            times[work].append(1000 * (time.process_time() - started))
    return {work: float(np.median(spent[1:])) for work, spent in times.items()}


def rows(name: str, quick: bool = False) -> list[dict[str, Any]]:
    """One row for each model of a design."""
    scene = Scene.of(name)
    fitted, seconds = calibrated(scene, 16 if quick else SAMPLES)
    found = [*designed(scene), *fitted, *known(scene)]
    spent = cpu_ms(scene, found, 30 if quick else 300)
    first = spent[found[0].work]
    return [
        {
            "design": name,
            "markers": len(scene.rest_px),
            "model": model.label,
            **errors(scene, model),
            "milliseconds": spent[model.work],
            "of_first": spent[model.work] / first,
            "setup_s": seconds if model in fitted else 0.0,
        }
        for model in found
    ]


def main() -> None:
    """Measure, print, and write the data."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one design, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    asked = parser.parse_args()
    found = [r for name in DESIGNS[: 1 if asked.quick else None] for r in rows(name, asked.quick)]
    for r in found:
        values = "  ".join(f"{k} {v:.4g}" for k, v in r.items() if isinstance(v, float))
        print(f"{r['design']:14s} {r['model']:28s} {values}")
    if asked.docs or not asked.quick:
        lens = {"separation": SEPARATION, "pupil": PUPIL, "distortion": DISTORTION}
        write_data("camera_models", {**machine(), "lens": lens, "rows": found}, asked.docs or DOCS)


if __name__ == "__main__":
    main()
