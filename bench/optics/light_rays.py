"""Light tracer: error against rays and time, facets against exact arcs, brightness against R/t.

    python -m bench.optics.light_rays [--rays 18] [--reference 24] [--docs docs]

Writes data/light_rays.json and images/light_rays.png under the folder of --docs. Errors are the
root mean square over independent runs about a long run of another seed. Times are CPU seconds of
one thread, after the kernel is compiled.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import write_data
from bench.models.facets import facetted_profile
from bench.models.light_ratios import changes, earlier, ratios
from bench.page.light_rays_figure import draw
from bench.rigs.machine import machine
from gelslim_cad.light.study import RAYS
from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import CurvedGuide, GelSection, curved_profile
from gelslim_optics.guide.tir_certificate import certify_tir
from gelslim_optics.light.launch import Sampling
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import EdgeLaunch, LedRow
from gelslim_optics.light.trace import TraceOptions, trace_light

RUNS = 12
REFERENCE_SEED = 10_001
ENTRIES = ("delivered", "leaked.outer_bend_right")
SPLITS = (1.0, 5e-2)
FACETS_DEG = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.5, 10.0, 15.0, 22.5, 30.0)
FACET_RAYS = 1 << 18
GUIDED_NA, N_ACRYLIC = 0.5, 1.4906


def led_scene() -> LightScene:
    """Bare LEDs at R/t = 1.5: leaks at both bends."""
    rows = tuple(
        LedRow(f"foot_{side}", (-7.5, -2.5, 2.5, 7.5), 2.0, 0.1, colour=colour)
        for side, colour in (("left", "red"), ("right", "green"))
    )
    profile = curved_profile(CurvedGuide(20.0, 2.0, 3.0, 5.0), GelSection(20.0, 2.0))
    return LightScene(profile, (-10, 10), (-10, 10), rows)


def timed(scene: LightScene, rays: int, **options: Any) -> tuple[Any, float]:
    start = time.process_time()
    result = trace_light(scene, rays, **options)
    return result, time.process_time() - start


def powers(largest: int) -> list[int]:
    """Powers of 2 of the numbers of rays: every other one, and what `gelslim light` takes."""
    usual = RAYS.bit_length() - 1
    return sorted({*range(10, largest + 1, 2), *([usual] if usual <= largest else [])})


def ladder(largest: int, reference: int) -> dict[str, Any]:
    """Errors by number of rays, points and splitting, about a run of 2^reference rays."""
    scene = led_scene()
    trace_light(scene, 64)
    truth = trace_light(scene, 1 << reference, seed=REFERENCE_SEED).ledger()
    sampling: Sampling
    rows = []
    for power in powers(largest):
        for sampling in ("sobol", "random"):
            for split in SPLITS:
                options: dict[str, Any] = {
                    "sampling": sampling,
                    "options": TraceOptions(split=split),
                }
                runs = [timed(scene, 1 << power, seed=seed, **options) for seed in range(RUNS)]
                row: dict[str, Any] = {
                    "rays": 1 << power,
                    "sampling": sampling,
                    "split": split,
                    "cpu_s": float(np.median([seconds for _, seconds in runs])),
                    "faces_per_ray": float(np.mean([r.crossings for r, _ in runs])),
                }
                for entry in ENTRIES:
                    errors = [r.value(entry) / truth[entry].value - 1 for r, _ in runs]
                    row[f"error_{entry}"] = math.sqrt(float(np.mean(np.square(errors))))
                rows.append(row)
    known = {
        entry: {
            "value": truth[entry].value,
            "relative_error": truth[entry].standard_error / truth[entry].value,
        }
        for entry in ENTRIES
    }
    return {"reference_rays": 1 << reference, "reference": known, "rows": rows}


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


def facets() -> dict[str, Any]:
    """Light of NA 0.5 in a bend that guides it all: what its chords lose."""
    ratio = 1.05 / (math.sqrt(N_ACRYLIC**2 - GUIDED_NA**2) - 1)
    exact = lone_bend(ratio)
    margin = certify_tir(exact, GUIDED_NA, guide_index=N_ACRYLIC).bends[0].margin_deg
    rows = []
    for facet in (0.0, *FACETS_DEG):
        profile = facetted_profile(exact, facet) if facet else exact
        lamp = EdgeLaunch("foot_right", na=GUIDED_NA)
        scene = LightScene(profile, (-10, 10), (-10, 10), (lamp,))
        result, seconds = timed(scene, FACET_RAYS)
        leak = sum(result.value(e) for e in ("leaked.outer_bend", "leaked.inner_bend"))
        rows.append(
            {
                "facet_deg": facet,
                "half_facet_over_margin": facet / 2 / margin,
                "leak": leak,
                "lost": result.value("lost"),
                "cpu_s": seconds,
            }
        )
    return {
        "na": GUIDED_NA,
        "bend_ratio": ratio,
        "margin_deg": margin,
        "rays": FACET_RAYS,
        "rows": rows,
    }


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
    parser.add_argument("--reference", type=int, default=24, help="power of 2 of the long run")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    parser.add_argument("--ladder-alone", action="store_true", help="nothing but the rays' ladder")
    options = parser.parse_args()
    report: dict[str, Any] = {
        **machine(),
        "seed": {"runs": list(range(RUNS)), "reference": REFERENCE_SEED, "others": 0},
        "ladder": ladder(options.rays, options.reference),
    }
    print(f"ladder\n{table(report['ladder']['rows'])}\n")
    if not options.ladder_alone:
        report |= rest()
    if options.docs:
        write_data("light_rays", report, options.docs)
        if not options.ladder_alone:
            draw(report, options.docs / "images" / "light_rays.png")


def rest() -> dict[str, Any]:
    """Facets, speed and ratios, printed."""
    found = {
        "facets": facets(),
        "speed": speed(),
        "ratios": ratios(),
        "earlier": earlier(),
        "changes": changes(),
    }
    for name, part in found.items():
        print(f"{name}\n{table(part['rows'] if isinstance(part, dict) else part)}\n")
    return found


if __name__ == "__main__":
    main()
