"""Light tracer: error against rays and time, Sobol or chance; exact arcs against facets.

    python bench/light_rays.py [--rays 20] [--out light_rays.json]

Errors are the spread of independent runs about a longer one of another seed. Times are CPU
seconds of one thread, after the kernel is compiled.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_optics.guide_facets import facetted_profile
from gelslim_optics.guide_profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide_shapes import CurvedGuide, GelSection, curved_profile
from gelslim_optics.light_points import Sampling
from gelslim_optics.light_scene import LightScene
from gelslim_optics.light_source import EdgeLaunch, LedRow
from gelslim_optics.trace import TraceOptions, trace_light

RUNS = 12
ENTRIES = ("delivered", "leaked.outer_bend_right")
SPLITS = (1.0, 1e-2)
FACETS_DEG = (1.0, 2.5, 5.0, 10.0, 15.0, 22.5, 30.0)
GUIDED_NA, N_ACRYLIC = 0.5, 1.4906


def curved(ratio: float) -> GuideProfile:
    return curved_profile(CurvedGuide(20.0, 2.0, 2.0 * ratio, 5.0), GelSection(20.0, 2.0))


def led_scene() -> LightScene:
    """Bare LEDs at R/t = 1.5: leaks at both bends."""
    rows = tuple(
        LedRow(f"foot_{side}", (-7.5, -2.5, 2.5, 7.5), 2.0, 0.1, colour=colour)
        for side, colour in (("left", "red"), ("right", "green"))
    )
    return LightScene(curved(1.5), (-10, 10), (-10, 10), rows)


def timed(scene: LightScene, rays: int, **options: Any) -> tuple[Any, float]:
    start = time.process_time()
    result = trace_light(scene, rays, **options)
    return result, time.process_time() - start


def ladder(largest: int) -> list[dict[str, Any]]:
    scene = led_scene()
    trace_light(scene, 64)
    truth = trace_light(scene, 1 << (largest + 2), seed=10_001, options=TraceOptions(split=1e-3))
    rows = []
    for power in range(10, largest + 1, 2):
        sampling: Sampling
        for sampling in ("sobol", "random"):
            for split in SPLITS:
                runs = [
                    timed(
                        scene,
                        1 << power,
                        seed=seed,
                        sampling=sampling,
                        options=TraceOptions(split=split),
                    )
                    for seed in range(RUNS)
                ]
                row: dict[str, Any] = {
                    "rays": 1 << power,
                    "sampling": sampling,
                    "split": split,
                    "cpu_s": float(np.median([seconds for _, seconds in runs])),
                }
                for entry in ENTRIES:
                    exact = truth.value(entry)
                    errors = [result.value(entry) / exact - 1 for result, _ in runs]
                    row[f"error_{entry}"] = math.sqrt(float(np.mean(np.square(errors))))
                rows.append(row)
    return rows


def lone_bend(ratio: float) -> GuideProfile:
    """One bend of thickness 1 between a foot and a black exit, as light returns from a finger."""
    inner = Arc((0.0, 0.0), ratio, math.pi / 2, -math.pi / 2)
    outer = Arc((0.0, 0.0), ratio + 1, 0.0, math.pi / 2)
    curves: dict[str, Segment | Arc] = {
        "inner_bend": inner,
        "foot_right": Segment(inner.end, outer.start),
        "outer_bend": outer,
    }
    exit_edge = Edge("exit", Segment(outer.end, inner.start), "acrylic", "paint")
    return GuideProfile((exit_edge, *(Edge(n, c, "acrylic", "air") for n, c in curves.items())))


def facets() -> list[dict[str, Any]]:
    """Light of NA 0.5 in a bend that guides it all: what its chords lose."""
    ratio = 1.05 / (math.sqrt(N_ACRYLIC**2 - GUIDED_NA**2) - 1)
    sine = math.sqrt(N_ACRYLIC**2 - GUIDED_NA**2) / N_ACRYLIC * ratio / (ratio + 1)
    margin = math.degrees(math.asin(sine) - math.asin(1 / N_ACRYLIC))
    exact = lone_bend(ratio)
    rows = []
    for facet in (0.0, *FACETS_DEG):
        profile = facetted_profile(exact, facet, margin, allow=True) if facet else exact
        lamp = EdgeLaunch("foot_right", na=GUIDED_NA)
        scene = LightScene(profile, (-10, 10), (-10, 10), (lamp,))
        result, seconds = timed(scene, 1 << 16)
        rows.append(
            {
                "facet_deg": facet,
                "half_facet_over_margin": facet / 2 / margin,
                "leak": result.total("leaked").value,
                "lost": result.value("lost"),
                "cpu_s": seconds,
            }
        )
    return rows


def speed(rays: int = 1 << 20) -> list[dict[str, Any]]:
    rows = []
    for split in (1.0, 5e-2, 1e-2, 1e-3):
        _, seconds = timed(led_scene(), rays, options=TraceOptions(split=split))
        rows.append({"split": split, "rays": rays, "million_rays_per_s": rays / seconds / 1e6})
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    heads = list(rows[0])
    lines = ["  ".join(f"{head:>14}" for head in heads)]
    for row in rows:
        cells = (v if isinstance(v, str) else f"{v:.4g}" for v in row.values())
        lines.append("  ".join(f"{cell:>14}" for cell in cells))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rays", type=int, default=18, help="power of 2 of the largest run")
    parser.add_argument("--out", type=Path, help="write the JSON here too")
    options = parser.parse_args()
    report = {"ladder": ladder(options.rays), "facets": facets(), "speed": speed()}
    for name, rows in report.items():
        print(f"{name}\n{table(rows)}\n")
    text = json.dumps(report, indent=1)
    print(text)
    if options.out:
        options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
