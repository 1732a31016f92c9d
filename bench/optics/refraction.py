"""Refraction through flat layers: points per second of the plain and the compiled loop.

    python -m bench.optics.refraction [--points 1000000] [--runs 7] [--out refraction.json]

Medians of CPU time on one thread, after the loop is compiled; the angle between the two loops'
rays shows that both did the same.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.rays import newton_rays
from gelslim_optics.camera.refraction_kernel import solve_rays, solve_slopes
from gelslim_optics.camera.refraction_newton import newton_slope
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera

HEIGHTS_MM, INDICES = (31.0, 2.5, 2.0), (1.0, 1.4906, 1.41)


def million_per_s(run: Callable[[], object], points: int, runs: int) -> float:
    run()
    seconds = []
    for _ in range(runs):
        start = time.process_time()
        run()
        seconds.append(time.process_time() - start)
    return points / float(np.median(seconds)) / 1e6


def slopes(points: int, runs: int, largest: float, name: str) -> dict[str, object]:
    """Rays of random reach up to `largest` times the stack's height; the gel's height varies."""
    rng = np.random.default_rng(0)
    reach = rng.uniform(0, largest * sum(HEIGHTS_MM), points)
    heights = [*(np.array(h) for h in HEIGHTS_MM[:-1]), rng.uniform(1, 2, points)]
    indices = [np.array(n) for n in INDICES]
    plain, compiled = newton_slope(reach, heights, indices), solve_slopes(reach, heights, indices)
    return {
        "what": name,
        "plain_million_per_s": million_per_s(
            lambda: newton_slope(reach, heights, indices), points, runs
        ),
        "compiled_million_per_s": million_per_s(
            lambda: solve_slopes(reach, heights, indices), points, runs
        ),
        "apart_rad": float(np.abs(np.arctan(plain) - np.arctan(compiled)).max()),
    }


def camera(lens: LensDistortion | None = None) -> VirtualCamera:
    tilt = math.radians(17.7)
    return VirtualCamera(
        position_mm=np.array([-12.37, 0.0, -35.53]),
        right=np.array([0.0, 1.0, 0.0]),
        down=np.array([math.cos(tilt), 0.0, -math.sin(tilt)]),
        forward=np.array([math.sin(tilt), 0.0, math.cos(tilt)]),
        focal_px=634.92,
        image_width_px=640,
        image_height_px=480,
        window_bottom_z_mm=-4.5,
        layers=(Layer(2.5, INDICES[1]), Layer(2.0, INDICES[2])),
        lens=lens,
    )


def projections(points: int, runs: int) -> list[dict[str, object]]:
    rng = np.random.default_rng(1)
    gel = np.column_stack([rng.uniform(-14, 14, (points, 2)), rng.uniform(-1, 0, points)])
    ideal, bent = camera(), camera(LensDistortion(k1=-0.12, k2=0.03, p1=4e-4, p2=-3e-4))
    stack = ideal.stack
    view = ideal.position_mm, stack, ideal.axes
    facts = ideal.position_mm, ideal.axes, np.array(stack.tops_mm), np.array(stack.indices)
    rays = {
        "what": "rays to points on the gel",
        "plain_million_per_s": million_per_s(lambda: newton_rays(*view, gel), points, runs),
        "compiled_million_per_s": million_per_s(lambda: solve_rays(gel, *facts), points, runs),
        "apart_rad": float(np.abs(newton_rays(*view, gel) - solve_rays(gel, *facts)).max()),
    }
    rows: list[dict[str, object]] = [rays]
    for name, view in (("project", ideal), ("project, distorted lens", bent)):
        pixels = view.project(gel)
        for what, run in (
            (name, lambda view=view: view.project(gel)),
            (f"back-{name}", lambda view=view, pixels=pixels: view.backproject(pixels)),
        ):
            speed = million_per_s(run, points, runs)
            rows.append({"what": what, "compiled_million_per_s": speed})
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--out", type=Path, help="write the JSON here too")
    options = parser.parse_args()
    rows = [
        slopes(options.points, options.runs, 0.8, "slopes, up to 40 degrees"),
        slopes(options.points, options.runs, 1e4, "slopes, grazing"),
        *projections(options.points, options.runs),
    ]
    print(f"{'million points/s, CPU':32}{'plain':>8}{'compiled':>10}{'apart':>10}")
    for row in rows:
        plain = f"{row['plain_million_per_s']:.1f}" if "plain_million_per_s" in row else ""
        apart = f"{row['apart_rad']:.0e}" if "apart_rad" in row else ""
        print(f"{row['what']:32}{plain:>8}{row['compiled_million_per_s']:>10.1f}{apart:>10}")
    if options.out:
        options.out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
