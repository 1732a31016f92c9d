"""The drawn light of a pressed gel against Mitsuba 3 on the same finger and the same dents.

    DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so python -m bench.optics.drawn_light

Writes docs/data/drawn_light.json and docs/images/drawn_light.png in four minutes of CPU time.
The finger is `gelslim2` with one index for all colours, no absorption and its LEDs in unbroken
rows. Both programs get the same surface of the gel; see `mitsuba_finger` for the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, ROOT, write_data, write_whole
from bench.models.mitsuba_finger import (
    Meshes,
    film_camera,
    finger_shapes,
    rendered,
    renderer,
    sheet,
)
from bench.page.drawn_light_table import table
from bench.rigs.machine import installed, machine
from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile, virtual_camera
from gelslim_cad.light.scene import light_scene
from gelslim_cad.sensor import SMOOTHING_MM
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene, Medium
from gelslim_optics.light.trace import trace_light
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from ifem_export.markers.grid import build_marker_grid

Array = NDArray[np.float64]
DESIGN = ROOT / "designs" / "gelslim2.yaml"
STEP_MM, BORDER_MM = 0.1, 1.0
TRACED_RAYS = 1 << 20


@dataclass(frozen=True, eq=False)
class JudgedFinger:
    """A finger as the tracer, the twin and Mitsuba have it.

    Without `relief` the twin draws by the slopes of the surface alone.
    """

    scene: LightScene
    camera: VirtualCamera
    relief: bool = True

    @classmethod
    def of_design(cls) -> JudgedFinger:
        """`gelslim2` with one index for all colours, no absorption, LEDs in unbroken rows."""
        d = derive(read_spec(DESIGN).spec)
        scene = light_scene(d, guide_profile(d))
        acrylic, gel = (Medium(scene.media[name].index) for name in ("acrylic", "gel"))
        half = scene.gel_x_mm[1] - 1.0
        rows = tuple(
            replace(row, x_mm=tuple(np.arange(-half, half + 0.1, row.size_mm)))
            for row in scene.sources
        )
        media = {"air": Medium(1.0), "acrylic": acrylic, "leg": acrylic, "gel": gel}
        return cls(replace(scene, media=media, sources=rows), replace(virtual_camera(d), lens=None))

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad."""
        face = self.scene.profile.edge(self.scene.face).curve
        return float(np.ptp(self.scene.gel_x_mm)), abs(face.end[0] - face.start[0])

    @cached_property
    def traced(self) -> LightResult:
        """Our trace of the untouched gel."""
        return trace_light(self.scene, TRACED_RAYS)

    @cached_property
    def twin(self) -> FrameRenderer:
        """The twin's renderer with the traced light alone: no vignetting, mottle or print."""
        bins = np.stack([self.traced.irradiance(c) for c in self.traced.colours])
        light = LightMap.from_bins(
            bins, *self.size_mm, azimuth_deg=[90, -90], elevation_deg=[25, 25],
            colour=np.eye(3)[:2], smooth_mm=SMOOTHING_MM, fans=self.traced.fans,
        )  # fmt: skip
        grid = build_marker_grid(5, 5, 1.0, 0.5)
        look = Look(shading=Shading(relief=self.relief))
        return FrameRenderer(self.camera, grid, light, Pad(*self.size_mm), look)

    def surface(self, height: Callable[[Array, Array], Array]) -> SurfaceState:
        """The gel raised by a height of x and y, which falls to 0 at the pad's border."""
        axes = [np.arange(-s / 2, s / 2 + STEP_MM / 2, STEP_MM) for s in self.size_mm]
        x, y = np.meshgrid(*axes)
        inward = np.minimum(*(s / 2 - np.abs(v) for s, v in zip(self.size_mm, (x, y), strict=True)))
        share = np.clip(inward / BORDER_MM, 0, 1)
        raised = height(x, y) * share**2 * (3 - 2 * share)
        return SurfaceState(*axes, np.stack([0 * x, 0 * x, raised], axis=2))

    def drawn(self, surface: SurfaceState, view: View) -> Array:
        """Light (h, w, 2) of the blocks of a view in the twin's picture."""
        ink = np.zeros((self.camera.image_height_px, self.camera.image_width_px), np.float32)
        found = self.twin.values(ink, surface)[..., :2].astype(float)
        b = view.block_px
        rows, columns = (len(v) // b for v in (found, found[0]))
        blocks = found[: rows * b, : columns * b].reshape(rows, b, columns, b, 2).mean(axis=(1, 3))
        return np.asarray(blocks[view.rows, view.columns])

    def judged(
        self, mi: Any, surface: SurfaceState, view: View, runs: int, samples: int, seed: int = 0
    ) -> Array:
        """The same pictures (runs, h, w, 2) by Mitsuba."""
        x, y = np.meshgrid(surface.x_mm, surface.y_mm)
        coat = np.dstack([x, y, 0 * x]) + surface.displacement_mm
        with TemporaryDirectory() as folder:
            shapes = dict(finger_shapes(self.scene, sheet(coat), Meshes(Path(folder))))
            sensor = film_camera(mi, self.camera, view.block_px, (view.rows, view.columns))
            return rendered(mi, shapes, sensor, runs, samples, seed)

    def view(self, half_mm: tuple[float, float], block_px: int) -> View:
        """The blocks that see the part of the pad within `half_mm` of its middle."""
        corners = np.array([(x, y, 0.0) for x in (-1, 1) for y in (-1, 1)]) * [*half_mm, 0.0]
        seen = self.camera.project(corners) / block_px
        (left, top), (right, bottom) = np.floor(seen.min(axis=0)), np.ceil(seen.max(axis=0))
        return View(block_px, slice(int(top), int(bottom)), slice(int(left), int(right)))


@dataclass(frozen=True)
class View:
    """A part of the picture in square blocks of pixels."""

    block_px: int
    rows: slice
    columns: slice


def ripple(slope: float = 0.1, length_mm: float = 4.0) -> Callable[[Array, Array], Array]:
    """Waves across the finger of a largest slope: small slopes without a shift of the whole."""
    wave = 2 * np.pi / length_mm
    return lambda x, y: slope / wave * np.sin(wave * y)


def ball(depth_mm: float, radius_mm: float = 3.0) -> Callable[[Array, Array], Array]:
    """A ball's dent: its cap over a contact as of Hertz, and a decay with the cap's last slope."""
    edge = np.sqrt(radius_mm * depth_mm)
    last = np.sqrt(radius_mm**2 - edge**2)
    level, slope = last - radius_mm + depth_mm, edge / last

    def height(x: Array, y: Array) -> Array:
        r = np.hypot(x, y)
        cap = radius_mm - depth_mm - np.sqrt(radius_mm**2 - np.minimum(r, edge) ** 2)
        outside = -(depth_mm - radius_mm + last) * np.exp(-(r - edge) / (level / slope))
        return np.where(r < edge, cap, outside)

    return height


def strip(
    depth_mm: float, width_mm: float = 4.0, round_mm: float = 0.3
) -> Callable[[Array, Array], Array]:
    """The dent of a flat bar along the finger with round edges; beside it the gel is at 45°."""
    turn = round_mm * np.sqrt(0.5)
    level = depth_mm - round_mm + turn

    def height(x: Array, y: Array) -> Array:
        t = np.maximum(np.abs(y) - width_mm / 2, 0.0)
        arc = round_mm - depth_mm - np.sqrt(round_mm**2 - np.minimum(t, turn) ** 2)
        return np.where(t < turn, arc, -level * np.exp(-(t - turn) / level)) + 0 * x

    return height


def level(x: Array, y: Array) -> Array:
    """The untouched gel."""
    return 0 * x + 0 * y


@dataclass(frozen=True)
class Agreement:
    """The change of one colour, pressed over rest less 1, by the twin and by Mitsuba.

    Attributes:
        colour: Name of the light.
        slope: Of the regression of Mitsuba's change on the twin's, weighted by the light.
        slope_error: Its standard error by the noise of Mitsuba.
        contrast: Mitsuba's standard deviation over the twin's, freed of noise.
        correlation: Of both, freed of noise.
        residual: Root mean square difference, freed of noise.
        noise: Root mean square noise of Mitsuba's change in one block.
    """

    colour: str
    slope: float
    slope_error: float
    contrast: float
    correlation: float
    residual: float
    noise: float


@dataclass(frozen=True, eq=False)
class Profile:
    """Light at rest across the finger over its mean (columns, 2), with the noise of `judged`."""

    drawn: Array
    judged: Array
    noise: Array


RUNS = 8
CASES: dict[str, tuple[Callable[[Array, Array], Array], tuple[float, float], int, int]] = {
    "small ripple": (ripple(0.1), (4.0, 4.0), 8, 48_000),
    "steep ripple": (ripple(0.3), (4.0, 4.0), 8, 18_000),
    "ball": (ball(0.4), (3.0, 3.0), 5, 40_000),
    "bar": (strip(0.4), (4.0, 4.0), 8, 30_000),
}
"""Surface, half lengths of the view in mm, side of its blocks in px, and samples a block."""


def pictures(mi: Any, finger: JudgedFinger, name: str, share: float) -> tuple[Array, ...]:
    """Light at rest and pressed by the twin (h, w, 2), then by Mitsuba (runs, h, w, 2)."""
    height, half_mm, block, samples = CASES[name]
    view, count = finger.view(half_mm, block), max(1, round(samples * share / RUNS))
    surfaces = finger.surface(level), finger.surface(height)
    drawn = [finger.drawn(s, view) for s in surfaces]
    judged = [finger.judged(mi, s, view, RUNS, count, k) for k, s in enumerate(surfaces)]
    return (*drawn, *judged)


def compared(mi: Any, finger: JudgedFinger, name: str, share: float = 1.0) -> list[Agreement]:
    """Agreement of each colour in a case of `CASES`, with a share of its samples."""
    return agreement(finger, pictures(mi, finger, name, share))


def agreement(finger: JudgedFinger, found: tuple[Array, ...]) -> list[Agreement]:
    """Agreement of each colour in what `pictures` returns."""
    rest, pressed, judged_rest, judged_pressed = found
    ours = pressed / rest - 1
    mean_rest, mean_pressed = judged_rest.mean(axis=0), judged_pressed.mean(axis=0)
    # The mean of 1/rest exceeds 1/mean by the relative variance of rest.
    spread = [v.var(axis=0, ddof=1) / len(v) / v.mean(axis=0) ** 2 for v in found[2:]]
    theirs = mean_pressed / mean_rest / (1 + spread[0]) - 1
    variance = (spread[0] + spread[1]) * (1 + theirs) ** 2
    made = []
    for k, source in enumerate(finger.scene.sources):
        x, y, w, noise = (v[..., k].ravel() for v in (ours, theirs, rest, variance))
        square = float((w * x * x).sum())
        mean_noise = float(noise.mean())
        deviation = np.sqrt(max(float(y.var()) - mean_noise, 0.0))
        made.append(
            Agreement(
                source.colour,
                float((w * x * y).sum()) / square,
                float(np.sqrt((w * w * x * x * noise).sum())) / square,
                float(deviation / x.std()),
                float(np.cov(x, y, bias=True)[0, 1] / (x.std() * deviation)),
                float(np.sqrt(max(float(((x - y) ** 2).mean()) - mean_noise, 0.0))),
                float(np.sqrt(mean_noise)),
            )
        )
    return made


def rest_profile(mi: Any, finger: JudgedFinger, share: float = 1.0) -> Profile:
    """The light of the untouched gel across the finger, over its middle 16 mm."""
    view, count = finger.view((8.0, 9.0), 16), max(1, round(12_000 * share / RUNS))
    surface = finger.surface(level)
    drawn = finger.drawn(surface, view).mean(axis=0)
    runs = finger.judged(mi, surface, view, RUNS, count).mean(axis=1)
    runs /= runs.mean(axis=1, keepdims=True)
    judged = runs.mean(axis=0)
    noise = runs.std(axis=0, ddof=1) / np.sqrt(RUNS) / judged
    return Profile(drawn / drawn.mean(axis=0), judged, noise)


def main() -> None:
    """Compare all cases; write figures and picture."""
    mi, finger = renderer(), JudgedFinger.of_design()
    slopes_alone = replace(finger, relief=False)
    found = {name: pictures(mi, finger, name, 1.0) for name in CASES}
    bare = {
        name: (found[name][0], slopes_alone.drawn(slopes_alone.surface(height), view), *judged)
        for name, (height, half_mm, block, _) in CASES.items()
        for view, judged in [(finger.view(half_mm, block), found[name][2:])]
    }
    profile = rest_profile(mi, finger)
    away = profile.drawn / profile.judged - 1
    data = {
        **machine(0),
        "mitsuba": installed("mitsuba"),
        "cases": {
            name: {
                "drawn": [asdict(v) for v in agreement(finger, found[name])],
                "slopes_alone": [asdict(v) for v in agreement(finger, bare[name])],
            }
            for name in CASES
        },
        "rest": {
            "rms": float(np.sqrt((away**2).mean())),
            "noise": float(np.sqrt((profile.noise**2).mean())),
        },
    }
    write_data("drawn_light", data)
    write_whole(DOCS / "images" / "drawn_light.png", figure(found, bare))
    print(table(data))


def figure(found: Mapping[str, tuple[Array, ...]], bare: Mapping[str, tuple[Array, ...]]) -> bytes:
    """Ball and bar by the twin and by Mitsuba, and the profiles across the finger, as PNG."""
    from io import BytesIO

    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    names = ("ball", "bar")
    drawing, axes = plt.subplots(2, 3, figsize=(10, 6.4), width_ratios=(1, 1, 1.5))
    for row, name in zip(axes, names, strict=True):
        rest, pressed, judged_rest, judged = found[name]
        white = 1.6 * rest.mean()
        theirs = judged.mean(axis=0) * rest.mean() / judged_rest.mean()
        for plot, picture, title in zip(row, (pressed, theirs), ("twin", "Mitsuba"), strict=False):
            coloured = np.dstack([picture, np.zeros(picture.shape[:2])]) / white
            plot.imshow(np.clip(coloured, 0, 1) ** (1 / 1.8), interpolation="nearest")
            plot.set(xticks=[], yticks=[], title=f"{name}, {title}")
        middle = (
            slice(None) if name == "bar" else slice(rest.shape[0] // 2 - 2, rest.shape[0] // 2 + 3)
        )
        half = CASES[name][1][1]
        y = np.linspace(-half, half, rest.shape[1])
        for k, colour in enumerate(("tab:red", "tab:green")):

            def change(new: Array, old: Array, k: int = k, rows: slice = middle) -> Array:
                return np.asarray(new[rows, :, k].mean(axis=0) / old[rows, :, k].mean(axis=0) - 1)

            row[2].plot(y, change(pressed, rest), color=colour, label="twin" if k == 0 else None)
            row[2].plot(
                y,
                change(bare[name][1], rest),
                color=colour,
                ls=":",
                label="slopes alone" if k == 0 else None,
            )
            runs = [change(a, judged_rest.mean(axis=0)) for a in judged]
            row[2].errorbar(
                y, np.mean(runs, axis=0), np.std(runs, axis=0) / np.sqrt(len(runs)),
                color=colour, fmt="o", ms=3, label="Mitsuba" if k == 0 else None,
            )  # fmt: skip
        row[2].set(xlabel="y, mm", ylabel="change of the light")
        row[2].legend(fontsize=8, ncol=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    drawing.tight_layout()
    out = BytesIO()
    drawing.savefig(out, format="png", dpi=90)
    return out.getvalue()


if __name__ == "__main__":
    main()
