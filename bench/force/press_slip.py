"""The animated picture of the site: a ball is pressed, dragged until it slips, and lifted.

    python -m bench.force.press_slip    # writes docs/images/press_slip.webp in two minutes

The twin draws what the camera sees; the force pipeline gets these pictures, a bundle and nothing
else. The simulated gel is the nominal one, and the bands hold its tolerances after a calibration.
The simulation stays in out/press_slip.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import gelslim
from bench.bench_data import DOCS, ROOT, write_whole
from bench.page.press_slip_figure import Moment, Story, frame_picture
from gelslim_force.frames.picture import read_picture
from gelslim_force.sensor import open_sensor
from ifem_export.bundle.bundle import Bundle

FOLDER = ROOT / "out" / "press_slip"
TARGET = DOCS / "images" / "press_slip.webp"
FRICTION = 0.5
SCENE = """\
format: gelslim-scene/1
name: press_slip
sensor: {{spec: {spec}}}
indenters:
  - {{shape: sphere, radius_mm: 16}}
motion:
  start_x_mm: -0.8
  start_y_mm: -2.5
  waypoints:
    - {{move: press, depth_mm: 0.3, steps: 12, duration_s: 0.8}}
    - {{move: shear, x_mm: 0.35, y_mm: 1.2, steps: 26, duration_s: 1.8}}
    - {{move: release, clearance_mm: 0.1, steps: 10, duration_s: 0.7}}
contact: {{friction: {friction}}}
observe: [displacement, force, markers, image]
tolerance: {{force_n: 0.03, image_px: 0.2}}
effects:
  exposure: {{gamma: 1.8}}
  drawing: {{contrast: 0.93}}
"""
MODULUS_SHARE, THICKNESS_SHARE, RATIO = 0.03, 0.015, 0.004
"""Standard deviations of a gel that was calibrated with a ball and a scale."""
FRAME_MS, FIRST_MS, LAST_MS = 90, 700, 2500
"""How long a picture, the first and the last one are shown; a bit slower than the press itself."""
QUALITY = 72


@dataclass(frozen=True, eq=False)
class Truth:
    """What the twin knows of n frames: times (n,) in s, forces (n, 3) in N, and how many nodes
    stick and slip (n, 2)."""

    time_s: NDArray[np.float64]
    force_n: NDArray[np.float64]
    nodes: NDArray[np.int64]


def main() -> None:
    """Simulate, measure, draw; print how far the measurement is off."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    pictures, truth = simulated()
    sensor = open_sensor(calibrated_bundle(), reference=pictures[0])
    results = [
        sensor.process(picture, time_s=float(time))
        for picture, time in zip(pictures, truth.time_s, strict=True)
    ]
    moments = [
        Moment(picture, result, tuple(map(int, nodes)))
        for picture, result, nodes in zip(pictures, results, truth.nodes, strict=True)
    ]
    story = Story.of(moments, truth.time_s, truth.force_n, FRICTION, sensor.calibration.camera)
    off, sigma = story.force_n - truth.force_n, story.sigma_n
    touched = truth.nodes.sum(axis=1) > 0
    print("largest error", np.abs(off).max(axis=0).round(3), "N")
    print("within 2 sigma", (np.abs(off) <= 2 * sigma)[touched].mean(axis=0).round(2))
    write_whole(TARGET, animation([frame_picture(story, k) for k in range(len(moments))]))
    print(f"{TARGET}: {len(moments)} pictures, {TARGET.stat().st_size / 1e6:.2f} MB")


def simulated(folder: Path = FOLDER) -> tuple[list[NDArray[np.uint8]], Truth]:
    """The pictures of the scene and what is true in each; made once."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "press_slip.yaml"
    spec = ROOT / "designs" / "gelslim2.yaml"
    scene.write_text(SCENE.format(spec=spec, friction=FRICTION), encoding="utf-8")
    run = folder / "run"
    gelslim.simulate(scene, run, overwrite=True)
    with open(run / "truth.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    pictures = [read_picture(path) for path in sorted((run / "frames").glob("*.png"))]

    def columns(*names: str) -> list[list[float]]:
        return [[float(row[name]) for name in names] for row in rows]

    return pictures, Truth(
        np.array(columns("time_s"))[:, 0],
        np.array(columns("fx_n", "fy_n", "fz_n")),
        np.array(columns("sticking_nodes", "slipping_nodes"), dtype=np.int64),
    )


def calibrated_bundle() -> Bundle:
    """The bundle of the finger, with the tolerances of a gel that was calibrated."""
    bundle = gelslim.make_bundle(ROOT / "designs" / "gelslim2.yaml").bundle
    tolerances = {
        "youngs_modulus_mpa": MODULUS_SHARE * bundle.material.youngs_modulus_mpa,
        "thickness_mm": THICKNESS_SHARE * float(np.ptp(bundle.mesh.nodes_mm[:, 2])),
        "poissons_ratio": RATIO,
    }
    return replace(bundle, tolerances=tolerances)


def animation(pictures: Sequence[Image.Image]) -> bytes:
    """The pictures as an animated WebP that repeats."""
    stream = io.BytesIO()
    times = [FIRST_MS, *[FRAME_MS] * (len(pictures) - 2), LAST_MS]
    pictures[0].save(
        stream, "WEBP", save_all=True, append_images=pictures[1:], duration=times, loop=0,
        quality=QUALITY, method=4,
    )  # fmt: skip
    return stream.getvalue()


if __name__ == "__main__":
    main()
