"""What a robot reads of a finger: its picture, the motion of its markers and its forces on a grid.

python -m bench.force.robot_observation    # writes docs/images/robot_observation.png
"""

from __future__ import annotations

import argparse
import io

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from bench.bench_data import ROOT
from bench.rigs.force_rig import large_rig
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.outputs.tactile_features import ForceGrid, TactileFeatures
from gelslim_force.pipeline import ForcePipeline

TARGET = ROOT / "docs" / "images" / "robot_observation.png"
STEPS, GRID = 8, (12, 12)
MARKERS_ENLARGED = 4.0
LONGEST_MM = 4.0
"""Length of the largest arrow over the grid."""


def main() -> None:
    """Push in steps, and draw the features of the last picture."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    rig = large_rig()
    draw = rig.renderer()
    pipeline = ForcePipeline(rig.bundle, calibrate(rig.bundle, draw.frame().image))
    for k, share in enumerate(np.linspace(0, 1, STEPS), 1):
        image = draw.frame(rig.press.at(share), number=k).image
        result = pipeline.process(image, normal_mm=share * rig.press.nodes_mm[:, 2])
    rest_px = pipeline.calibration.reference.positions_px
    features = TactileFeatures(ForceGrid.of(pipeline.points_mm, GRID), len(rest_px))
    _draw(image, rest_px, features, features.of(result))


def _draw(image: np.ndarray, rest_px: np.ndarray, features: TactileFeatures, found: dict) -> None:
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    picture, markers, forces = figure.subplots(1, 3)
    picture.imshow(image)
    picture.set(title="picture", xticks=[], yticks=[])
    motion = found["marker_motion_px"].T
    markers.quiver(*rest_px.T, *motion, angles="xy", scale_units="xy", scale=1 / MARKERS_ENLARGED)
    markers.set(
        title=f"marker_motion_px, {MARKERS_ENLARGED:g} times",
        aspect="equal",
        xlim=(0, image.shape[1]),
    )
    markers.set(ylim=(image.shape[0], 0), xlabel="px", ylabel="px")
    grid, points = found["force_grid_n"], features.grid.points_mm
    colours = forces.pcolormesh(
        points[..., 0], points[..., 1], -1000 * grid[..., 2], shading="nearest", cmap="viridis"
    )
    shear = np.moveaxis(grid[..., :2], -1, 0)
    scale = float(np.hypot(*shear).max()) / LONGEST_MM
    forces.quiver(
        *np.moveaxis(points, -1, 0), *shear,
        angles="xy", scale_units="xy", scale=scale, color="white",
    )  # fmt: skip
    forces.set(title="force_grid_n", xlabel="x in mm", ylabel="y in mm", aspect="equal")
    figure.colorbar(colours, ax=forces, label="normal force per point, mN")
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    with io.BytesIO() as file:
        figure.savefig(file, dpi=100)
        # 128 colours: the sensor's noise does not compress otherwise.
        Image.open(file).convert("RGB").quantize(128).save(TARGET, optimize=True)


if __name__ == "__main__":
    main()
