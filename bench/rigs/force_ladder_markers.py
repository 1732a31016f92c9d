"""Ladders of marker detection and matching: error against time."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bench.rigs.force_rig import SEED, Rig
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.matching import match
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import RenderedFrame
from gelslim_twin.render.image_sensor import SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Image = NDArray[np.uint8]
LOOKS = {
    "clean": Look(shading=Shading()),
    "noise 8": Look(shading=Shading(), sensor_noise=SensorNoise(8.0, seed=SEED)),
    "blur 1.5 px": Look(
        shading=Shading(), defocus=Defocus(0.0, 22.0, 1.5), sensor_noise=SensorNoise(2.0, seed=SEED)
    ),
}
NEAR_PX, MISPLACED_PX = 4.0, 1.0
PEAKS_PITCH = (0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7)
MISSING, SPURIOUS, DOT_NOISE_PX = 0.05, 0.01, 0.05
WIDTH_MM = (2.5, 4.5)
"""Standard deviations of the displaced region: what a fingertip-sized contact makes."""


def detection(rig: Rig, quick: bool) -> list[dict[str, Any]]:
    """Error (RMS distance, px), missed and spurious dots and ms, for every detector and look.

    Dots at the true places are asked for within 4 px; what is nearer to none is spurious.
    """
    shares = (0.0, 0.6) if quick else (0.0, 0.3, 0.6, 0.9)
    rows = []
    for look, parameters in LOOKS.items():
        draw = rig.renderer(parameters)
        frames = [draw.frame(rig.press.at(s), number=k) for k, s in enumerate(shares)]
        sizes = DetectorSettings.for_diameters(frames[0].diameter_px)
        for name, find in detectors(sizes, frames).items():
            rows.append({"look": look, "detector": name, **judged(find, frames)})
    return rows


def detectors(
    sizes: DetectorSettings, frames: list[RenderedFrame]
) -> dict[str, Callable[[int], Array]]:
    """Centres (n, 2) that each detector finds in frame k."""
    rng = np.random.default_rng(SEED)
    ours = Detector(sizes)
    shapes = [round_moments(f.diameter_px[f.drawn]) for f in frames]
    starts = [
        f.centres_px[f.drawn] + rng.normal(0, MISPLACED_PX, (int(f.drawn.sum()), 2)) for f in frames
    ]

    def near(k: int) -> Array:
        dots = ours.detect_near(frames[k].image, starts[k], shapes[k], compare=False)
        return dots.centres_px[dots.found]

    def weighted(low: float, high: float) -> Callable[[int], Array]:
        other = Detector(
            DetectorSettings(
                sizes.smallest_diameter_px,
                sizes.largest_diameter_px,
                weight_from=low,
                weight_to=high,
            )
        )
        return lambda k: other.detect(frames[k].image).centres_px

    found = {
        "whole frame": lambda k: ours.detect(frames[k].image).centres_px,
        "near predictions": near,
        "weights 0 to 1": weighted(0.0, 1.0),
        "weights 0.4 to 0.6 (area)": weighted(0.4, 0.6),
    }
    return {**found, **opencv_detectors(sizes, frames)}


def round_moments(diameter_px: Array) -> Array:
    """Second moments (n, 3) of discs."""
    square = diameter_px**2 / 16
    return np.column_stack([square, np.zeros_like(square), square])


def blob_detector(sizes: DetectorSettings) -> tuple[Any, Any]:
    """OpenCV's blob detector for dots of these sizes, and its parameters."""
    import cv2

    asked = cv2.SimpleBlobDetector_Params()
    asked.filterByArea = True
    asked.minArea = 0.5 * np.pi / 4 * sizes.smallest_diameter_px**2
    asked.maxArea = 1.5 * np.pi / 4 * sizes.largest_diameter_px**2
    asked.filterByCircularity = asked.filterByConvexity = asked.filterByInertia = False
    asked.minDistBetweenBlobs = sizes.smallest_diameter_px
    asked.minThreshold, asked.maxThreshold, asked.thresholdStep = 10, 220, 10
    return cv2.SimpleBlobDetector_create(asked), asked


def opencv_detectors(
    sizes: DetectorSettings, frames: list[RenderedFrame]
) -> dict[str, Callable[[int], Array]]:
    """Blob detector, and adaptive threshold with moments of components; none without OpenCV."""
    try:
        import cv2
    except ImportError:
        print("OpenCV is not installed: its detectors are left out (pip install '.[vision]')")
        return {}
    cv2.setNumThreads(1)
    blob, asked = blob_detector(sizes)
    block = 2 * int(sizes.largest_diameter_px) + 1

    def grey(k: int) -> Image:
        return np.asarray(cv2.cvtColor(frames[k].image, cv2.COLOR_RGB2GRAY))

    def blobs(k: int) -> Array:
        return np.array([p.pt for p in blob.detect(grey(k))], dtype=float).reshape(-1, 2)

    def moments(k: int) -> Array:
        picture = grey(k)
        dark = cv2.adaptiveThreshold(
            picture, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, block, 12
        )
        _, _, stats, centres = cv2.connectedComponentsWithStats(dark)
        area = stats[:, cv2.CC_STAT_AREA]
        keep = (area >= asked.minArea) & (area <= asked.maxArea)
        keep[0] = False
        return np.asarray(centres[keep])

    return {"OpenCV blob detector": blobs, "OpenCV threshold, moments": moments}


def judged(find: Callable[[int], Array], frames: list[RenderedFrame]) -> dict[str, Any]:
    """Error, shares and time of one detector over frames."""
    square, hits, missed, spurious, drawn = 0.0, 0, 0, 0, 0
    for k, frame in enumerate(frames):
        truth, found = frame.centres_px[frame.drawn], find(k)
        drawn += len(truth)
        if not len(found):
            missed += len(truth)
            continue
        gap, _ = cKDTree(found).query(truth)
        square += float((gap[gap < NEAR_PX] ** 2).sum())
        hits += int((gap < NEAR_PX).sum())
        missed += int((gap >= NEAR_PX).sum())
        spurious += int((cKDTree(truth).query(found)[0] >= NEAR_PX).sum())
    return {
        "error_px": float(np.sqrt(square / max(hits, 1))),
        "missed": missed / drawn,
        "spurious": spurious / drawn,
        "milliseconds": median_ms(lambda k: find(k % len(frames))),
    }


def matching(rig: Rig, quick: bool) -> list[dict[str, Any]]:
    """Share of wrong and of tracked markers by peak displacement, in one shot from rest."""
    trials = 10 if quick else 60
    reference = rest_lattice(rig)
    modes: dict[str, Callable[[Array], IntArray]] = {
        "nearest": lambda points: nearest_dots(reference.positions_px, points),
        "robust": lambda points: match(reference, points).dots,
    }
    rows = []
    for peak in PEAKS_PITCH:
        rng = np.random.default_rng(SEED)
        shots = [shot(rig, reference, peak, rng) for _ in range(trials)]
        for mode, find in modes.items():
            wrong = tracked = 0
            for points, truth in shots:
                dots = find(points)
                seen = dots >= 0
                wrong += int((truth[dots[seen]] != np.flatnonzero(seen)).sum())
                tracked += int(seen.sum())

            def once(k: int, find: Any = find, shots: Any = shots) -> None:
                find(shots[k % len(shots)][0])

            rows.append(
                {
                    "peak_pitch": peak,
                    "mode": mode,
                    "wrong": wrong / (trials * len(reference)),
                    "tracked": tracked / (trials * len(reference)),
                    "milliseconds": median_ms(once),
                }
            )
    return rows


def nearest_dots(expected_px: Array, points_px: Array) -> IntArray:
    """(n,) dot nearest to each position, as in the paper; two markers may take the same one."""
    return np.asarray(cKDTree(points_px).query(expected_px)[1])


def rest_lattice(rig: Rig) -> ReferenceLattice:
    """All markers where the camera sees them at rest."""
    flat = np.column_stack([rig.grid.positions_mm, np.zeros(len(rig.grid))])
    return ReferenceLattice(
        sites=np.column_stack([rig.grid.row, rig.grid.column]),
        positions_px=rig.camera.project(flat),
        markers=np.arange(len(rig.grid)),
    )


def shot(
    rig: Rig, reference: ReferenceLattice, peak_pitch: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.int64]]:
    """Dots (m, 2) of a displaced print in random order, and the marker of each, -1 if spurious."""
    places = rig.grid.positions_mm
    middle = rng.uniform(-0.6, 0.6, 2) * np.abs(places).max(axis=0)
    away = ((places - middle) ** 2).sum(axis=1)
    turn, width = rng.uniform(0, 2 * np.pi), rng.uniform(*WIDTH_MM)
    # Sideways as one with a swelling away from the contact.
    share = np.exp(-away / (2 * width**2))[:, None]
    way = np.array([np.cos(turn), np.sin(turn)]) + 0.3 * (places - middle) / width
    moved = share * way
    moved *= peak_pitch * rig.grid.pitch_mm / np.hypot(*moved.T).max()
    flat = np.column_stack([places + moved, np.zeros(len(places))])
    points = rig.camera.project(flat) + rng.normal(0, DOT_NOISE_PX, (len(places), 2))
    kept = np.flatnonzero(rng.random(len(places)) >= MISSING)
    low, high = reference.positions_px.min(axis=0), reference.positions_px.max(axis=0)
    extra = rng.uniform(low, high, (round(SPURIOUS * len(places)), 2))
    dots = np.vstack([points[kept], extra])
    truth = np.concatenate([kept, np.full(len(extra), -1)])
    order = rng.permutation(len(dots))
    return dots[order], truth[order]


def median_ms(run: Callable[[int], Any], least_s: float = 0.25) -> float:
    """Median time of `run(k)` for k = 0, 1, ... in ms, after a first call."""
    run(0)
    times: list[float] = []
    while sum(times) < least_s or len(times) < 5:
        started = time.perf_counter()
        run(len(times))
        times.append(time.perf_counter() - started)
    return float(np.median(times)) * 1000
