"""Rendering: time of each stage, centre error of each rung, what each effect costs and changes.

    python -m bench.twin.rendering            # prints and writes docs/data/rendering.json
    python -m bench.twin.rendering --quick    # prints only, fewer repeats

The sensor is designs/gelslim2.yaml with its traced light. Errors are over all dots drawn: of the
ink (centroid of the drawn coverage against the outline's) and of the detector, with its own
settings and with weights linear in the darkness. Times are CPU milliseconds of one thread, which
other work on the machine hardly changes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bench.bench_data import DOCS, ROOT, write_data
from bench.rigs.machine import machine
from bench.rigs.sampled_dots import SampledRenderer
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.light.light_map import LED_COLOURS, LightMap, red_green_sides
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
from gelslim_twin.render.image_sensor import Compression
from gelslim_twin.render.look import Look, sensor_look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad

SPEC = ROOT / "designs" / "gelslim2.yaml"
LIGHT_SEED = 0
EFFECTS = (
    "shading",
    "defocus",
    "motion_blur",
    "exposure",
    "sensor_noise",
    "marker_print",
    "dirt",
    "specular",
    "compression",
)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensor:
    """What a renderer needs, and the lens."""

    values: dict[str, Any]
    aperture_mm: float
    focus_mm: float

    def renderer(self, look: Look) -> FrameRenderer:
        return FrameRenderer(**self.values, look=look)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    asked = parser.parse_args()
    repeats = 3 if asked.quick else 25
    sensor = design_sensor()
    data: dict[str, Any] = {
        **machine(LIGHT_SEED),
        "design": SPEC.name,
        "dots": len(sensor.values["grid"]),
        "stages": stage_rows(sensor, repeats),
        "sampling": sampling_rows(sensor, repeats),
        "shading": shading_rows(sensor, repeats),
        "effects": effect_rows(sensor, repeats),
    }
    for name in ("stages", "sampling", "shading", "effects"):
        print(f"\n{name}")
        for row in data[name]:
            print(
                "  ".join(
                    f"{k} {v:.4g}" if isinstance(v, float) else str(v) for k, v in row.items()
                )
            )
    if asked.docs or not asked.quick:
        write_data("rendering", data, asked.docs or DOCS)


def shown(name: str, value: object) -> str:
    return f"{name} {value:.4g}" if isinstance(value, float) else str(value)


def design_sensor() -> Sensor:
    """Camera, print and traced light of the design."""
    from gelslim_cad.dimensions import derive
    from gelslim_cad.geometry.optics import camera_record, guide_profile, virtual_camera
    from gelslim_cad.light.scene import light_scene
    from gelslim_cad.sensor import marker_grid
    from gelslim_cad.spec.reader import read_spec
    from gelslim_optics.light.trace import trace_light

    d = derive(read_spec(SPEC).spec)
    traced = trace_light(light_scene(d, guide_profile(d)), 1 << 16, seed=LIGHT_SEED)
    size = float(d["design.gel.length_mm"]), float(d["design.gel.width_mm"])
    light = LightMap.from_bins(
        np.stack([0.45 * traced.irradiance("red"), traced.irradiance("green")]),
        *size,
        azimuth_deg=np.array([90.0, -90.0]),
        elevation_deg=np.array([25.0, 25.0]),
        colour=LED_COLOURS,
        smooth_mm=0.6,
    )
    values = {"camera": virtual_camera(d), "grid": marker_grid(d), "light": light}
    values["pad"] = Pad(*size, 1.0, mottle=0.04, vignetting=0.7)
    lens: dict[str, Any] = camera_record(d)
    return Sensor(values, lens["aperture_mm"], lens["focus_mm"])


def pressed(shift_mm: float = 0.0) -> SurfaceState:
    """A dent 0.8 mm deep and 5 mm wide that drags the gel along x."""
    axis = np.linspace(-14, 14, 43)
    x, y = np.meshgrid(axis, axis)
    fall = np.exp(-(((x - 2) ** 2 + (y - 3 - shift_mm) ** 2) / 2.5**2))
    u = np.stack([0.3 * fall - 0.1 * (x - 2) * fall, -0.1 * (y - 3) * fall, -0.8 * fall], axis=2)
    return SurfaceState(axis, axis, u)


def fastest_ms(work: Callable[[], Any], repeats: int) -> float:
    """Least time of a call, the first one (compiling, set-up) left out."""
    work()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        times.append(time.process_time() - started)
    return 1e3 * min(times)


def paired_ms(
    first: Callable[[], Any], second: Callable[[], Any], repeats: int
) -> tuple[float, float]:
    """Least times of two calls made in turns, so that a busy machine hinders both alike."""
    first(), second()
    times = np.empty((repeats, 2))
    for k in range(repeats):
        for n, work in enumerate((first, second)):
            started = time.process_time()
            work()
            times[k, n] = time.process_time() - started
    return float(1e3 * times[:, 0].min()), float(1e3 * times[:, 1].min())


def found(frame: RenderedFrame, linear: bool = False) -> Array:
    """Detected centres (m, 2) of the dots drawn, NaN where one is not found; other rows NaN."""
    sizes = DetectorSettings.for_diameters(frame.diameter_px[frame.drawn])
    settings = replace(sizes, weight_from=0.0) if linear else sizes
    seen = Detector(settings).detect(frame.image).centres_px
    apart, nearest = cKDTree(seen).query(frame.centres_px)
    return np.where((frame.drawn & (apart < 2.0))[:, None], seen[nearest], np.nan)


def rms(errors: Array) -> float:
    return float(np.sqrt(np.nanmean(errors**2)))


def stage_rows(sensor: Sensor, repeats: int) -> list[dict[str, Any]]:
    """A frame with everything but compression, stage by stage."""
    from gelslim_twin.render.image_kernel import develop
    from gelslim_twin.render.printed_dots import centroids_px, outlines_px

    look = sensor_look(sensor.aperture_mm, sensor.focus_mm)
    r, now, before = sensor.renderer(look), pressed(0.1), pressed()
    outlines = outlines_px(r.camera, r.dots, now)
    _, area = centroids_px(outlines)
    ink = r._ink(outlines, outlines, r.dots.present, np.abs(area), now)
    values = r.values(ink, now)
    noisy, image = values.copy(), np.empty(values.size, dtype=np.uint8)
    work: dict[str, Callable[[], Any]] = {
        "outlines": lambda: outlines_px(r.camera, r.dots, now),
        "ink, blurred": lambda: r._ink(outlines, outlines, r.dots.present, np.abs(area), now),
        "light and shading": lambda: r.values(ink, now),
        "light, level gel": lambda: r.values(ink),
        "noise": lambda: look.sensor_noise.apply(noisy) if look.sensor_noise else None,
        "rounding": lambda: develop(values.reshape(-1), r._curve, image),
        "whole frame": lambda: r.frame(now, before),
        "whole frame, dots alone": sensor.renderer(Look()).frame,
    }
    setup_ms = fastest_ms(lambda: sensor.renderer(look).still, 3)
    # In rounds, so that a burst of other work does not fall on one stage alone.
    rounds = [{k: fastest_ms(w, repeats) for k, w in work.items()} for _ in range(5)]
    return [{"stage": k, "ms": min(times[k] for times in rounds)} for k in work] + [
        {"stage": "set-up, once per sensor", "ms": setup_ms}
    ]


def sampling_rows(sensor: Sensor, repeats: int) -> list[dict[str, Any]]:
    """Exact areas against n x n samples per pixel, on clean sharp frames."""
    even = replace(sensor, values=sensor.values | {"light": even_light(sensor)})
    rungs = [(even, n, "even") for n in (1, 2, 4, 8, 0)] + [(sensor, 0, "traced")]
    rows = []
    for lit, samples, light in rungs:
        now = pressed()
        r = lit.renderer(Look())
        if samples:
            r = SampledRenderer(**lit.values, look=Look(), samples=samples)
        frame = r.frame(now)
        rows.append(
            {
                "rung": "exact area" if samples == 0 else f"{samples} x {samples} samples",
                "light": light,
                "samples": samples,
                "ms": fastest_ms(partial(r.frame, now), max(2, repeats // 5)),
                "ink_rms_px": rms(ink_centres(r, now) - frame.centres_px),
                "detector_rms_px": rms(found(frame) - frame.centres_px),
                "linear_detector_rms_px": rms(found(frame, linear=True) - frame.centres_px),
            }
        )
    soft = Look(defocus=Defocus(sensor.aperture_mm, sensor.focus_mm, 0.7))
    for lit, light in ((even, "even"), (sensor, "traced")):
        r = lit.renderer(soft)
        frame = r.frame(pressed())
        rows.append(
            {
                "rung": "exact area, the lens' blur",
                "light": light,
                "samples": 0,
                "ms": fastest_ms(partial(r.frame, pressed()), max(2, repeats // 5)),
                "detector_rms_px": rms(found(frame) - frame.centres_px),
                "linear_detector_rms_px": rms(found(frame, linear=True) - frame.centres_px),
            }
        )
    return rows


def even_light(sensor: Sensor) -> LightMap:
    """The same lamps, as bright all over the pad."""
    pad = sensor.values["pad"]
    return red_green_sides(pad.length_mm, pad.width_mm, decay_mm=1e9)


def ink_centres(r: FrameRenderer, state: SurfaceState) -> Array:
    """Centroids (m, 2) of each dot's coverage, drawn alone, from the pixels' values."""
    from gelslim_twin.render.printed_dots import centroids_px, outlines_px

    outlines = outlines_px(r.camera, r.dots, state)
    centres, area = centroids_px(outlines)
    ink = r._ink(outlines, outlines, r.dots.present, np.abs(area), state)
    out = np.full(centres.shape, np.nan)
    for k in np.flatnonzero(r.frame(state).drawn):
        low = np.floor(outlines[k].min(axis=0) - 0.5).astype(int)
        high = np.ceil(outlines[k].max(axis=0) + 0.5).astype(int)
        part = ink[low[1] : high[1] + 1, low[0] : high[0] + 1].astype(float)
        y, x = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1]
        if part.shape == x.shape:
            out[k] = [(part * x).sum() / part.sum(), (part * y).sum() / part.sum()]
    return out


def shading_rows(sensor: Sensor, repeats: int) -> list[dict[str, Any]]:
    """Shading computed on every n-th pixel against every pixel, in grey values."""
    from gelslim_twin.render.shading import Shading

    blank, now = np.zeros((480, 640), dtype=np.float32), pressed()
    exact = sensor.renderer(Look(shading=Shading(pixel_step=1))).values(blank, now)
    rows: list[dict[str, Any]] = []
    for step in (1, 2, 4, 8, 16):
        r = sensor.renderer(Look(shading=Shading(pixel_step=step)))
        gap = np.abs(r.values(blank, now) - exact)
        ms = fastest_ms(partial(r.values, blank, now), max(2, repeats // 3))
        rows.append({"pixel_step": step, "ms": ms, "largest_dn": float(gap.max())})
    level = np.abs(sensor.renderer(Look()).values(blank, now) - exact)
    plain = sensor.renderer(Look())
    ms = fastest_ms(partial(plain.values, blank, now), max(2, repeats // 3))
    rows.append({"pixel_step": "no shading", "ms": ms, "largest_dn": float(level.max())})
    return rows


def effect_rows(sensor: Sensor, repeats: int) -> list[dict[str, Any]]:
    """Each effect left out of a frame that has all: time saved, change of detected centres."""
    everything = replace(
        sensor_look(sensor.aperture_mm, sensor.focus_mm), compression=Compression(90)
    )
    now, before = pressed(0.1), pressed()
    whole = sensor.renderer(everything)
    frame, all_ms = whole.frame(now, before), fastest_ms(lambda: whole.frame(now, before), repeats)
    rows: list[dict[str, Any]] = [{"effect": "all on", "ms_saved": 0.0, "frame_ms": all_ms}]
    for name in EFFECTS:
        left: dict[str, Any] = {name: None}
        less = sensor.renderer(replace(everything, **left))
        without = less.frame(now, before)
        change = found(frame) - found(without)
        with_ms, ms = paired_ms(
            partial(whole.frame, now, before), partial(less.frame, now, before), 2 * repeats
        )
        rows.append(
            {
                "effect": name,
                "ms_saved": with_ms - ms,
                "frame_ms": ms,
                "change_rms_px": rms(change),
                "change_most_px": float(np.nanmax(np.abs(change))),
                "change_mean_dn": float(np.abs(frame.image.astype(float) - without.image).mean()),
            }
        )
    return rows


if __name__ == "__main__":
    main()
